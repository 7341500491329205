"""A checked task for the compiler, the rack and the documentation of a task.

Also finds which commons it can write, and where: by BASIC statements and by the outputs of blocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from automax_ros.blocks.declare.channels import programmed_channels
from automax_ros.blocks.declare.declaration import Block
from automax_ros.core.diagnostics import Span
from automax_ros.core.numbers import stored_real
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.language.tree import tree
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.language.tree.walk import statements_in_order, targets_of

Place = tuple[int, Span]
"""The BASIC line, and the place of the variable in the text."""


@dataclass(frozen=True)
class TuningLimits:
    """The tuning of a tunable variable, in its own type: ``low <= current <= high``, ``step > 0``."""

    current: Value
    low: Value
    high: Value
    step: Value


@dataclass(frozen=True)
class Symbol:
    """A declared variable. ``dimensions`` are numbers of elements (largest subscript + 1), () for a simple one."""

    name: str
    type: DataType
    scope: tree.Scope
    span: Span
    dimensions: tuple[int, ...] = ()
    length: int = 0
    tuning: TuningLimits | None = None

    @property
    def elements(self) -> int:
        """Number of values the variable holds."""
        count = 1
        for size in self.dimensions:
            count *= size
        return count

    @property
    def latched(self) -> bool:
        """Whether the scan latches it: a simple common INTEGER, DOUBLE INTEGER or BOOLEAN (3.3)."""
        return self.scope is tree.Scope.COMMON and not self.dimensions and self.type.latched


@dataclass(frozen=True)
class CommonSpec:
    """A common variable as the rack defines it, for comparison with a task's COMMON statement.

    ``name`` is the full name; ``dimensions`` are numbers of elements, () for a simple variable; ``length`` is a
    string's maximum, 0 for other types. ``place`` is the place of the definition for messages, such as
    ``rack.yaml:14``.
    """

    name: str
    type: DataType
    place: str
    dimensions: tuple[int, ...] = ()
    length: int = 0
    is_input: bool = False


@dataclass(frozen=True)
class DataStructure:
    """A data structure that a SHIFT block makes: ``columns`` from 0 (input) on, each of ``channels`` from 1 on."""

    name: str
    type: DataType
    columns: int
    channels: int


@dataclass(frozen=True)
class BoundCall:
    """A CALL whose block and keywords are known and checked.

    ``arguments`` has the given parameters by keyword (a literal keeps its node, rounded and checked);
    ``defaults`` has the value of every other input that has a default. Optional parameters without a default that
    were not given are in neither. ``line`` is the BASIC line number. ``structure`` is the data structure that the block
    makes or uses; ``elements`` the number of elements of its tables, 0 without one.
    """

    call: tree.Call
    block: Block
    line: int
    arguments: dict[str, tree.Expression]
    defaults: dict[str, Value]
    structure: DataStructure | None = None
    elements: int = 0

    @property
    def targets(self) -> list[tree.Expression]:
        """The targets of the outputs: variables and array elements, in the order of the declaration."""
        return [self.arguments[output.name] for output in self.block.outputs if output.name in self.arguments]

    @property
    def facts(self) -> dict[str, Value]:
        """Values that the CALL fixes for the block, by lower-case name: literals, defaults, and the ``CALL_FACTS``."""
        facts: dict[str, Value] = {name.lower(): value for name, value in self.defaults.items()}
        for name, given in self.arguments.items():
            if isinstance(given, (tree.IntegerLiteral, tree.RealLiteral, tree.BooleanLiteral)):
                facts[name.lower()] = given.value
        facts["programmed"] = programmed_channels(self.arguments)
        facts["elements"] = self.elements
        if self.structure is not None:
            facts["max_columns"], facts["channels"] = self.structure.columns, self.structure.channels
        return facts


@dataclass(frozen=True)
class OpenedFile:
    """A number after # in a BASIC task: a port by its name, or one end of a channel with items of ``types``."""

    number: int
    port: str = ""
    direction: tree.Direction | None = None
    types: tuple[DataType, ...] = ()

    @property
    def words(self) -> str:
        """Its description, for messages."""
        if self.direction is None:
            return f"port {self.port}"
        return f"a channel FOR {self.direction.value}"


@dataclass(frozen=True)
class Program:
    """A task without errors.

    ``startup`` are the statements before SCAN_LOOP, which run once when the task goes into RUN; ``scan`` those after
    it up to END; neither contains declarations or SCAN_LOOP. ``calls`` maps the span of each Call node to its binding
    by the checker, SCAN_LOOP included; ``data`` is the pool of DATA values, ``data_lines`` the line number of
    each DATA line and the index in the pool at which it begins. ``events`` are declared by EVENT; ``event`` is the one
    that starts the scan, None where the clock does. ``scan_loop_line`` is the BASIC line of SCAN_LOOP.

    A BASIC task has no SCAN_LOOP: its statements are ``scan``, ``ticks`` is 0, and ``files`` are the ports and channels
    that it opens.

    ``cml`` is the CALL that begins the scans of a task in step with an AC line, in place of SCAN_LOOP; there ``ticks``
    is 0. It is None for other tasks.
    """

    name: str
    symbols: dict[str, Symbol]
    startup: tuple[tree.Statement, ...]
    scan: tuple[tree.Statement, ...]
    ticks: int
    tick_ns: int
    calls: dict[Span, BoundCall]
    data: tuple[Value, ...] = ()
    data_lines: tuple[tuple[int, int], ...] = ()
    events: tuple[tree.Event, ...] = ()
    event: str | None = None
    scan_loop_line: int = 0
    target: str = "automax"
    source_hash: str = ""
    kind: TaskKind = TaskKind.CONTROL_BLOCK
    files: tuple[OpenedFile, ...] = ()
    cml: BoundCall | None = None

    @property
    def is_basic(self) -> bool:
        """Whether it is a BASIC task, which may wait anywhere and latches nothing."""
        return self.kind is TaskKind.BASIC

    @property
    def period_ns(self) -> int:
        """The scan period, ns: TICKS x tick, or the part of a line cycle between two interrupts."""
        if self.cml is None or self.cml.block.line_scan is None:
            return self.ticks * self.tick_ns
        return NS_PER_S // (self.cml.block.line_scan.per_cycle * self.line_hz)

    @property
    def line_hz(self) -> int:
        """The frequency in Hz of the AC line that begins the scans, 0 for a task that does not follow one."""
        if self.cml is None or self.cml.block.line_scan is None:
            return 0
        return int(self.cml.facts[self.cml.block.line_scan.frequency.lower()])


def places_that_write(program: Program, scope: tree.Scope = tree.Scope.COMMON) -> dict[str, list[Place]]:
    """Return the places at which the task can write each common (or local), in the order of the text."""
    found: dict[str, list[Place]] = {}

    def note(target: tree.Expression | None, line: int | None) -> None:
        if not isinstance(target, (tree.Reference, tree.Element)) or line is None:
            return
        symbol = program.symbols.get(target.name)
        if symbol is not None and symbol.scope is scope:
            found.setdefault(symbol.name, []).append((line, target.span))

    if program.cml is not None:
        for given in program.cml.targets:
            note(given, program.cml.line)
    for statement, line in statements_in_order((*program.startup, *program.scan)):
        for target in targets_of(statement):
            note(target, line)
        if isinstance(statement, tree.Call) and statement.span in program.calls:
            bound = program.calls[statement.span]
            for output in bound.block.outputs:
                note(bound.arguments.get(output.name), bound.line)
    return found


def lines_that_write(program: Program) -> dict[str, tuple[int, ...]]:
    """Return the BASIC lines that can write each common of a task, each once, in the order of the text."""
    return {
        name: tuple(dict.fromkeys(line for line, _ in places)) for name, places in places_that_write(program).items()
    }


def tunable_value(symbol: Symbol, name: str, value: object) -> int | float:
    """Return the value that a tunable would have if it were set to ``value``; ``name`` identifies it in messages.

    Raises KeyError if it cannot be tuned, ValueError if the value is outside its limits or not of its type.
    """
    if symbol.tuning is None:
        raise KeyError(name)
    low, high = symbol.tuning.low, symbol.tuning.high
    assert not isinstance(low, str)
    assert not isinstance(high, str)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{name} cannot be {value!r}: that is not a number")
    # A limit such as 0.1 is held in single precision too, so the stored value is what must lie inside.
    stored = stored_real(float(value))[0] if symbol.type is DataType.REAL else int(value)
    if symbol.type is not DataType.REAL and stored != value:
        raise ValueError(f"{name} = {value} is not a whole number")
    if not low <= stored <= high:
        raise ValueError(f"{name} = {value:.8g} lies outside {low:.8g} to {high:.8g}")
    return stored
