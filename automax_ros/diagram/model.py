"""The block diagram of a task: what is drawn and what is joined, without places; from the checked program alone.

A box is a CALL, or consecutive BASIC statements. A wire leads from the last writer above its reader in the order of
execution. What is read before the scan has written it is the value of the last scan: feedback. Blocks see what blocks
wrote to a latched common, BASIC what BASIC wrote (3.3): for the others it counts from the next scan on. A common that
the scan does not write comes from a flag; what no scan writes, as a tunable, stands at the pin. The part before
SCAN_LOOP is not drawn: it runs once (decision).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from textwrap import wrap
from typing import NamedTuple

from automax_ros.blocks.declare.declaration import Special
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import printable
from automax_ros.core.types import DataType
from automax_ros.language.parse.parser import parse
from automax_ros.language.printer import print_expression, print_module, print_simple
from automax_ros.language.program import BoundCall, Program
from automax_ros.language.tree import tree
from automax_ros.language.tree.walk import arguments_of, expressions_of, statements_in_order, targets_of, variables_in

MOST_BOXES = 250
"""Most boxes of a drawing (decision: a bound on time for hostile sources; no eye follows more)."""
MOST_LINES, LINE_WIDTH = 14, 40
"""Most lines of a BASIC box, and characters of a line (decision); the source has them all."""
_STRAIGHT = (tree.Assignment, tree.If, tree.Print, tree.Stop, tree.IoWrite, tree.ClearErrorLog, tree.SetEvent)
_SILENT = (tree.Remark, tree.Data, tree.Event)


@dataclass(frozen=True)
class Pin:
    """A parameter of a block, or a variable of a BASIC box; ``symbol`` is the manual's, ``box`` the box's number.

    One of three is given: ``net``, the number of the net that it reads or writes; ``var``, a variable that the scan
    does not write or an element; ``value``, the text of a literal, an array, an event or a data structure.
    """

    box: int
    symbol: str
    name: str
    out: bool
    negated: bool = False
    value: str = ""
    var: str = ""
    net: int | None = None


@dataclass(frozen=True)
class Box:
    """A block, or BASIC statements with their ``text``; ``rows`` are its first and last row of the source, from 1."""

    title: str
    line: int
    rows: tuple[int, int]
    basic: bool = False
    text: tuple[str, ...] = ()


@dataclass(frozen=True)
class Flag:
    """A common at the edge: where it comes from, or where it goes (``out``)."""

    name: str
    out: bool
    net: int


@dataclass(frozen=True)
class Net:
    """What one writer writes in BASIC line ``line``; line 0: a common at the start of the scan.

    ``kept``: memory holds this value between scans. ``watch`` is the variable's name in a rack.
    """

    name: str
    watch: str
    line: int
    boolean: bool
    kept: bool


class End(NamedTuple):
    """An end of a wire: a flag or a pin, by its number."""

    is_flag: bool
    number: int


@dataclass(frozen=True)
class Wire:
    """From a writer to a reader; ``feedback`` carries the value of the last scan."""

    net: int
    source: End
    target: End
    feedback: bool = False


@dataclass(frozen=True)
class Row:
    """A row of the source, from 1; the BASIC line that begins in it or 0, and the simple variables in it."""

    row: int
    line: int
    text: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Diagram:
    """A task's drawing. ``why`` says why nothing is drawn; then only the source is there."""

    task: str
    source: tuple[Row, ...]
    why: str = ""
    boxes: tuple[Box, ...] = ()
    pins: tuple[Pin, ...] = ()
    flags: tuple[Flag, ...] = ()
    nets: tuple[Net, ...] = ()
    wires: tuple[Wire, ...] = ()


@dataclass(frozen=True)
class _Use:
    """A pin before its net is known: the simple variable that it reads or writes, "" without one, and the line.

    ``only_above``: it is an input only if something above writes it, as BASIC may leave the variable as it is.
    """

    pin: Pin
    variable: str
    line: int
    only_above: bool = False


class _Writer(NamedTuple):
    box: int
    basic: bool
    pin: int
    net: int


def diagram_of(program: Program, source: SourceText, written_elsewhere: Collection[str] = ()) -> Diagram:
    """Return the diagram of a checked task.

    ``written_elsewhere`` are commons that others write too: they come from a flag, not from the task's own last scan.
    """
    empty = Diagram(program.name, tuple(_rows(program, source)), why=_obstacle(program))
    if empty.why:
        return empty
    boxes, uses = _boxes(program, source)
    if len(boxes) > MOST_BOXES:
        return replace(empty, why=f"its {len(boxes)} boxes: more than {MOST_BOXES} are not drawn")
    joined = _Joints(program, boxes, uses, written_elsewhere)
    return replace(
        empty, boxes=tuple(boxes), pins=tuple(joined.pins), flags=tuple(joined.flags), nets=tuple(joined.nets),
        wires=tuple(joined.wires),
    )  # fmt: skip


def _rows(program: Program, source: SourceText) -> Iterator[Row]:
    lines: dict[int, int] = {}
    found: list[tree.Named] = []
    for statement, _ in statements_in_order(parse(source)[0].statements):
        if statement.number is not None:
            lines[statement.span.line] = statement.number
        if isinstance(statement, tree.Declaration):
            found += statement.variables
        for value in (*expressions_of(statement), *(argument.value for argument in arguments_of(statement))):
            found += variables_in(value)
    names: dict[int, dict[str, None]] = defaultdict(dict)
    for variable in sorted(found, key=lambda variable: variable.span):
        if _is_simple(program, variable.name):
            names[variable.span.line][variable.name] = None
    for row, text in enumerate(source.lines, 1):
        yield Row(row, lines.get(row, 0), printable(text), tuple(names[row]))


def _is_simple(program: Program, name: str) -> bool:
    return name in program.symbols and not program.symbols[name].dimensions


def _obstacle(program: Program) -> str:
    """Return the place and the word of what keeps a task from being drawn, "" where nothing does."""
    if program.is_basic:
        return "a BASIC task: it may wait and jump anywhere"
    top = {id(statement) for statement in program.scan}
    for statement, line in statements_in_order(program.scan):
        if isinstance(statement, tree.For):
            return f"line {line}: FOR"
        if isinstance(statement, (tree.Call, tree.End)) and id(statement) not in top:
            return f"line {line}: {'CALL' if isinstance(statement, tree.Call) else 'END'} inside IF"
        if not isinstance(statement, (*_STRAIGHT, *_SILENT, tree.Label, tree.Call, tree.End)):
            return f"line {line}: {print_simple(statement).split(maxsplit=1)[0]}"
    return ""


def _boxes(program: Program, source: SourceText) -> tuple[list[Box], list[_Use]]:
    """Return the boxes in the order of execution, and their pins."""
    boxes: list[Box] = []
    uses: list[_Use] = []
    if program.cml is not None:
        uses += _block(program, program.cml, source, boxes)
    straight: list[tree.Statement] = []
    begins = line = 0
    for statement in program.scan:
        line = statement.number or line
        if isinstance(statement, (tree.Call, tree.End)) and straight:
            uses += _basic(program, straight, begins, source, boxes)
            straight = []
        if isinstance(statement, tree.Call):
            uses += _block(program, program.calls[statement.span], source, boxes)
        elif isinstance(statement, _STRAIGHT) or (straight and isinstance(statement, tree.Label)):
            begins = begins if straight else line
            straight.append(statement)
    return boxes, uses


def _last_row(source: SourceText, row: int) -> int:
    """Return the last row of the line that begins in ``row``, which ``&`` continues."""
    while row < len(source.lines) and source.lines[row - 1].rstrip().endswith("&"):
        row += 1
    return row


def _block(program: Program, bound: BoundCall, source: SourceText, boxes: list[Box]) -> Iterator[_Use]:
    first = bound.call.span.line
    boxes.append(Box(bound.block.name, bound.line, (first, _last_row(source, first))))
    for parameter in bound.block.parameters:
        given = bound.arguments.get(parameter.name)
        if given is None:
            continue
        negated = isinstance(given, tree.Unary) and given.operator == "-"
        operand = given.operand if isinstance(given, tree.Unary) and negated else given
        text = print_expression(operand).replace(", ", ",")
        pin = Pin(len(boxes) - 1, parameter.symbol, parameter.name, parameter in bound.block.outputs, negated)
        is_value = not isinstance(parameter.type, Special)
        if is_value and isinstance(operand, tree.Reference) and _is_simple(program, operand.name):
            yield _Use(pin, operand.name, bound.line)
        elif isinstance(operand, tree.Element) and all(
            isinstance(at, tree.IntegerLiteral) for at in operand.subscripts
        ):
            yield _Use(replace(pin, var=text), "", bound.line)
        else:
            yield _Use(replace(pin, value=text), "", bound.line)


def _basic(
    program: Program, statements: Sequence[tree.Statement], line: int, source: SourceText, boxes: list[Box]
) -> Iterator[_Use]:
    reads: dict[str, None] = {}
    writes: dict[str, int] = {}
    surely = _follow(program, statements, set(), line, reads, writes)
    last = max(statement.span.line for statement, _ in statements_in_order(statements))
    rows = (statements[0].span.line, _last_row(source, last))
    boxes.append(Box("BASIC", line, rows, basic=True, text=_text(statements, line)))
    for name in dict.fromkeys((*reads, *(name for name in writes if name not in surely))):
        yield _Use(Pin(len(boxes) - 1, name, name, out=False), name, line, only_above=name not in reads)
    for name, written in writes.items():
        yield _Use(Pin(len(boxes) - 1, name, name, out=True), name, written)


def _follow(
    program: Program, statements: Sequence[tree.Statement], known: set[str], line: int, reads: dict[str, None],
    writes: dict[str, int],
) -> set[str]:  # fmt: skip
    """Note what straight BASIC reads before it has surely written it, and what it writes, with the last line that does.

    ``known`` are the variables surely written before; returned are those surely written afterwards.
    """
    for statement in statements:
        line = statement.number or line
        targets = targets_of(statement)
        values = [value for value in expressions_of(statement) if not any(value is target for target in targets)]
        values += [at for target in targets if isinstance(target, tree.Element) for at in target.subscripts]
        for variable in (variable for value in values for variable in variables_in(value)):
            if _is_simple(program, variable.name) and variable.name not in known:
                reads[variable.name] = None
        if isinstance(statement, tree.If):
            ways = [
                _follow(program, way, set(known), line, reads, writes) for way in (statement.then, statement.otherwise)
            ]
            known = ways[0] & ways[1]
        for target in targets:
            if _is_simple(program, target.name):
                writes[target.name] = line
                known = known | {target.name}
    return known


def _text(statements: Sequence[tree.Statement], line: int) -> tuple[str, ...]:
    """Return the lines of BASIC statements as the printer writes them, long ones wrapped, too many left out."""
    text = print_module(tree.Module((replace(statements[0], number=line), *statements[1:])))
    shown = [part for row in text.splitlines() for part in wrap(row, LINE_WIDTH, subsequent_indent=" " * 7)]
    if len(shown) > MOST_LINES:
        shown[MOST_LINES - 1 :] = [f"... {len(shown) - MOST_LINES + 1} more lines"]
    return tuple(map(printable, shown))


class _Joints:
    """Joins the pins: nets, flags and wires."""

    def __init__(
        self, program: Program, boxes: Sequence[Box], uses: Iterable[_Use], elsewhere: Collection[str]
    ) -> None:
        self._program, self._boxes, self._elsewhere = program, boxes, elsewhere
        self.pins: list[Pin] = []
        self.nets: list[Net] = []
        self.flags: list[Flag] = []
        self.wires: list[Wire] = []
        self._from: dict[str, int] = {}
        self._writers: dict[str, list[_Writer]] = defaultdict(list)
        for use in sorted(uses, key=lambda use: not use.pin.out):  # writers first, so that readers find them
            if use.pin.out and use.variable:
                number = self._net(use.variable, use.line)
                writer = _Writer(use.pin.box, boxes[use.pin.box].basic, self._pin(use, number), number)
                self._writers[use.variable].append(writer)
            elif use.pin.out or not use.variable:
                self._pin(use)
            else:
                self._read(use)
        for name, writers in self._writers.items():
            self._keep(name, writers)

    def _pin(self, use: _Use, net: int | None = None) -> int:
        self.pins.append(replace(use.pin, net=net))
        return len(self.pins) - 1

    def _net(self, name: str, line: int) -> int:
        symbol = self._program.symbols[name]
        watch = name if self._is_common(name) else f"{self._program.name}.{name}"
        self.nets.append(Net(name, watch, line, symbol.type is DataType.BOOLEAN, kept=False))
        return len(self.nets) - 1

    def _is_common(self, name: str) -> bool:
        return self._program.symbols[name].scope is tree.Scope.COMMON

    def _is_mixed(self, name: str) -> bool:
        """Whether blocks and BASIC both write a latched common: then none surely wrote what the next scan reads."""
        return self._program.symbols[name].latched and len({writer.basic for writer in self._writers[name]}) > 1

    def _read(self, use: _Use) -> None:
        """Join an input to its writer or flag; without either its variable stands at the pin."""
        name, box = use.variable, use.pin.box
        basic, latched = self._boxes[box].basic, self._program.symbols[name].latched
        writers, is_common = self._writers.get(name, []), self._is_common(name)
        above = [item for item in writers if item.box < box and (item.basic is basic or not latched)]
        if above:
            self._join(use, above[-1])
        elif use.only_above:
            return
        elif writers and not self._is_mixed(name) and not (is_common and name in self._elsewhere):
            if not (basic and writers[-1].box == box):  # BASIC that goes on from its own value needs no wire
                self._join(use, writers[-1], feedback=True)
        elif is_common:
            if name not in self._from:
                self._from[name] = len(self.flags)
                self.flags.append(Flag(name, out=False, net=self._net(name, 0)))
            flag = self._from[name]
            net = self.flags[flag].net
            self.nets[net] = replace(self.nets[net], kept=not writers)
            self.wires.append(Wire(net, End(True, flag), End(False, self._pin(use, net))))
        else:
            self._pin(replace(use, pin=replace(use.pin, var=name)))

    def _join(self, use: _Use, writer: _Writer, *, feedback: bool = False) -> None:
        pin = self._pin(use, writer.net)
        self.wires.append(Wire(writer.net, End(False, writer.pin), End(False, pin), feedback))

    def _keep(self, name: str, writers: Sequence[_Writer]) -> None:
        """Mark the net that memory keeps, and lead a common to its flag; END writes what blocks wrote, over BASIC."""
        mixed = self._is_mixed(name)
        last = [writer for writer in writers if not (mixed and writer.basic)][-1]
        self.nets[last.net] = replace(self.nets[last.net], kept=not mixed)
        if self._is_common(name):
            self.wires.append(Wire(last.net, End(False, last.pin), End(True, len(self.flags))))
            self.flags.append(Flag(name, out=True, net=last.net))
