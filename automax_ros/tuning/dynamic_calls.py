"""The dynamic blocks of a task, by line, with the values of their parameters where they are known."""

from __future__ import annotations

import enum
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import Block
from automax_ros.blocks.declare.dynamics import Dynamics
from automax_ros.core.text import quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import source_text
from automax_ros.language.printer import print_expression
from automax_ros.language.program import BoundCall, Program
from automax_ros.language.tree.tree import (
    BooleanLiteral,
    Call,
    Expression,
    For,
    Gosub,
    IntegerLiteral,
    OnJump,
    RealLiteral,
    Return,
    Statement,
    Unary,
)
from automax_ros.language.tree.walk import bodies, statements_in_order
from automax_ros.tuning.tuning import Tuning, tuning

_LABEL = re.compile(r"0*([0-9]{1,6})(?:\.0*([1-9][0-9]{0,2}))?")
_LEADING_ZEROS = re.compile(r"(?<=[(,])0+(?=[0-9])")


class CallFault(UserError):
    """A dynamic block that cannot be used as it is called."""


class NoDynamicBlock(UserError):
    """A requested line has no dynamic block."""


class ValueFault(UserError):
    """A value was given for a variable that no block uses."""


class Source(enum.Enum):
    """The source of a parameter's value."""

    LITERAL = "literal"
    DEFAULT = "default"
    TUNABLE = "tunable"
    SET = "set"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Parameter:
    """An input of a CALL: its value, None for a variable without a known value; ``variable`` is its text.

    The value is the one at the block's input: that of an ``inverted`` variable has the opposite sign.
    """

    keyword: str
    value: Value | None
    source: Source
    variable: str = ""
    inverted: bool = False

    @property
    def text(self) -> str:
        """The variable as written in the CALL, with its minus sign."""
        return f"-{self.variable}" if self.inverted else self.variable


@dataclass(frozen=True)
class DynamicCall:
    """A CALL of a block with coefficients: ``label`` is its line as in state names, ``output`` the variable it writes.

    ``parameters`` are the programmed inputs, by keyword. ``inside`` is set if it may not run once in every scan:
    ``IF``, ``FOR`` or ``subroutine``, the innermost.
    """

    label: str
    bound: BoundCall
    output: str
    parameters: Mapping[str, Parameter]
    inside: str = ""

    @property
    def block(self) -> Block:
        """The block."""
        return self.bound.block

    @property
    def dynamics(self) -> Dynamics:
        """The block as a function of frequency."""
        assert self.block.coefficients is not None
        return self.block.coefficients.dynamics

    @property
    def title(self) -> str:
        """Line, block and output as a heading."""
        return f"{self.label} {self.block.name} -> {self.output}"

    @property
    def coefficients(self) -> dict[str, float | None]:
        """The programmed parameters of coefficients, None where a value is not known."""
        declared = self.block.coefficients
        assert declared is not None
        found = {name: self.parameters[name].value for name in declared.parameters if name in self.parameters}
        return {name: float(value) if isinstance(value, (int, float)) else None for name, value in found.items()}

    def standing_inputs(self) -> tuple[dict[str, Value], list[str]]:
        """Return the inputs but the signal, by keyword, and the assumptions on variables without a known value."""
        inputs: dict[str, Value] = {}
        assumed: list[str] = []
        for name, given in self.parameters.items():
            if name in self.dynamics.signals:
                continue
            value = given.value
            if given.source is Source.UNKNOWN:
                value = _unprogrammed_value(self.block, name)
                assumed.append(f"{name} = {source_text(value)} ({given.text})")
            if value is not None:
                inputs[name] = value
        return inputs, assumed


def _unprogrammed_value(block: Block, name: str) -> Value:
    """Return the value of an input that the CALL does not program."""
    item = next(item for item in block.inputs if item.name == name)
    if item.default is not None:
        return item.default
    return item.type.zero if isinstance(item.type, DataType) else 0


def dynamic_calls(
    program: Program, values: Mapping[str, Value], label: str | None, *, driven: bool = False
) -> list[DynamicCall]:
    """Return the dynamic blocks of a task in the order of the text, or the one on a line.

    ``values`` are those of variables, by the label of ``core.names``: the sources of coefficients and, for blocks that
    are to be driven, every other input but the signal.

    Raises:
        NoDynamicBlock: there is none on that line.
        ValueFault: no block uses a value.
    """
    bound = _label_blocks(program)
    if label is not None:
        chosen = _choose_label(label, bound, program)
        bound = {chosen: bound[chosen]}
    calls = [
        DynamicCall(name, item, _output(item), _parameters(program, item, values), inside)
        for name, (item, inside) in bound.items()
    ]
    free = _free(calls, driven=driven)
    for name in values:
        if name not in {_plain(item) for item in free}:
            _refuse(name, calls)
            what = "no dynamic block takes it" if label is None else "the block does not take it"
            raise ValueFault(f"{name}: {what}", _free_text(free))
    return calls


def tuning_of(call: DynamicCall, program: Program) -> Tuning:
    """Return the tuning of a CALL in its task."""
    return tuning(call.block, program.period_ns / NS_PER_S, call.coefficients)


def require_running(call: DynamicCall) -> None:
    """Refuse a block that holds its output; raises CallFault if an input that stops it, such as RESET, is TRUE."""
    for name, what in call.dynamics.stopped_by:
        given = call.parameters.get(name)
        if given is not None and given.value is True:
            raise CallFault(f"{call.title}: {name} is TRUE, {what}")


def _refuse(name: str, calls: Sequence[DynamicCall]) -> None:
    for call in calls:
        for item in call.parameters.values():
            if not item.variable or _plain(item.variable) != name:
                continue
            where = f"{item.keyword} of {call.label} {call.block.name}"
            if item.keyword in call.dynamics.signals:
                raise ValueFault(f"{name}: it carries the signal, {where}", _free_text(_free([call])))
            if item.keyword in dict(call.dynamics.stopped_by):
                require_running(call)
            raise ValueFault(f"{name}: it is {where}, no coefficient", _free_text(_free(calls)))


def _free(calls: Sequence[DynamicCall], *, driven: bool = False) -> set[str]:
    return {item.variable for call in calls for item in _settable(call, driven=driven) if item.variable}


def _free_text(free: Collection[str]) -> str | None:
    return f"to be set are {', '.join(sorted(free))}" if free else None


def _settable(call: DynamicCall, *, driven: bool) -> list[Parameter]:
    names = call.coefficients if not driven else [name for name in call.parameters if name not in call.dynamics.signals]
    return [call.parameters[name] for name in names]


def _label_blocks(program: Program) -> dict[str, tuple[BoundCall, str]]:
    """Return the dynamic blocks by line, with the statement around each.

    A further CALL of one line counts from 2, whatever the first one is.
    """
    found: dict[str, tuple[BoundCall, str]] = {}
    counts: dict[int, int] = {}
    for statement, inside in _calls_in_order(program.scan, _subroutines(program), ""):
        if statement.span not in program.calls:
            continue
        bound = program.calls[statement.span]
        number = counts[bound.line] = counts.get(bound.line, 0) + 1
        if bound.block.coefficients is not None:
            found[f"{bound.line}" if number == 1 else f"{bound.line}.{number}"] = bound, inside
    return found


def _calls_in_order(
    statements: Iterable[Statement], subroutines: Collection[int], inside: str
) -> Iterator[tuple[Call, str]]:
    """Yield every CALL in the order of the text, with the statement around it: a subroutine ends at its RETURN."""
    here = inside
    for statement in statements:
        if statement.number in subroutines:
            here = inside or "subroutine"
        if isinstance(statement, Call):
            yield statement, here
        elif isinstance(statement, Return):
            here = inside
        kind = "FOR" if isinstance(statement, For) else "IF"
        for body in bodies(statement):
            yield from _calls_in_order(body, subroutines, kind)


def _subroutines(program: Program) -> set[int]:
    found: set[int] = set()
    for statement, _ in statements_in_order((*program.startup, *program.scan)):
        if isinstance(statement, Gosub):
            found.add(statement.line)
        elif isinstance(statement, OnJump) and statement.gosub:
            found.update(statement.lines)
    return found


def _choose_label(label: str, bound: Mapping[str, tuple[BoundCall, str]], program: Program) -> str:
    match = _LABEL.fullmatch(label.strip())
    if match is None:
        raise NoDynamicBlock(f"{quoted(label)} is not a BASIC line such as 210 or 210.2", _list_blocks(bound))
    line, number = int(match[1]), int(match[2] or 1)
    name = f"{line}" if number == 1 else f"{line}.{number}"
    if name in bound:
        return name
    there = {item.line for item in program.calls.values()}
    what = "that is not a dynamic block" if line in there else "there is no block on this line"
    raise NoDynamicBlock(f"{name}: {what}", _list_blocks(bound))


def _list_blocks(bound: Mapping[str, tuple[BoundCall, str]]) -> str:
    if not bound:
        return "the task has no dynamic block"
    return "dynamic blocks are " + ", ".join(f"{name} {item.block.name}" for name, (item, _) in bound.items())


def _output(bound: BoundCall) -> str:
    assert bound.block.coefficients is not None
    wanted = bound.block.coefficients.dynamics.output
    return print_expression(bound.arguments[wanted]) if wanted in bound.arguments else "-"


def _parameters(program: Program, bound: BoundCall, values: Mapping[str, Value]) -> dict[str, Parameter]:
    return {
        item.name: _parameter(program, item.name, bound.arguments[item.name], values)
        for item in bound.block.inputs
        if item.name in bound.arguments
    }


def _parameter(program: Program, keyword: str, given: Expression, values: Mapping[str, Value]) -> Parameter:
    if isinstance(given, (IntegerLiteral, RealLiteral, BooleanLiteral)):
        return Parameter(keyword, given.value, Source.LITERAL)
    inverted = isinstance(given, Unary)
    text = print_expression(given.operand if isinstance(given, Unary) else given)
    symbol = program.symbols.get(text)
    if _plain(text) in values:
        value, source = values[_plain(text)], Source.SET
    elif symbol is not None and symbol.tuning is not None:
        value, source = symbol.tuning.current, Source.TUNABLE
    else:
        return Parameter(keyword, None, Source.UNKNOWN, text, inverted)
    return Parameter(keyword, not value if inverted else value, source, text, inverted)


def _plain(text: str) -> str:
    """Return a variable's text as ``element`` labels it: no blanks, capitals, round brackets, no leading zeros."""
    return _LEADING_ZEROS.sub("", "".join(text.split()).upper().replace("[", "(").replace("]", ")"))
