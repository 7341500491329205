"""The statements of BASIC tasks in the syntax tree: events, times, channels and ports (J-3675 6.6, 6.7, 6.8)."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Span
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.language.tree.expression_tree import Expression, Target, span_field

ITEM_TYPES = {
    "I": DataType.INTEGER,
    "D": DataType.DOUBLE,
    "R": DataType.REAL,
    "S": DataType.STRING,
    "B": DataType.BOOLEAN,
}
"""The letters of TYPE (J-3675 p. 6-20)."""


class Unit(enum.Enum):
    """A unit of DELAY and START EVERY, always plural (J-3675 p. 6-22)."""

    TICKS = "TICKS"
    SECONDS = "SECONDS"
    MINUTES = "MINUTES"
    HOURS = "HOURS"

    def ns(self, tick_ns: int) -> int:
        """Return one unit in ns, on a Processor with this tick."""
        seconds = {Unit.SECONDS: 1, Unit.MINUTES: 60, Unit.HOURS: 3600}
        return tick_ns if self is Unit.TICKS else seconds[self] * NS_PER_S


class Direction(enum.Enum):
    """The end of a channel that a task opens."""

    INPUT = "INPUT"
    OUTPUT = "OUTPUT"


@dataclass(frozen=True)
class SetEvent:
    """SET event: sets the event."""

    event: str
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class WaitOn:
    """WAIT ON event: the task is suspended until the event is set."""

    event: str
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Delay:
    """DELAY count unit: the task is suspended for a time."""

    count: Expression
    unit: Unit
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class StartEvery:
    """START EVERY count unit: after END the task continues at the statement after this one, once per period."""

    count: Expression
    unit: Unit
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class OpenChannel:
    """OPEN CHANNEL FOR direction AS FILE #file, TYPE = (types) [, DEPTH = depth]; the reader gives the depth."""

    direction: Direction
    file: int
    types: tuple[DataType, ...]
    depth: Expression | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class OpenPort:
    """OPEN "PORTx" AS FILE #file, SETUP = word, baud rate; or ACCESS = EXCLUSIVE or NON_EXCLUSIVE."""

    port: str
    file: int
    setup: Expression | None = None
    baud: Expression | None = None
    access: str = ""
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Close:
    """CLOSE #file: of a port."""

    file: int
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class InputFile:
    """INPUT[:EMPTY=line] #file, targets: one message of a channel; if there is none, a jump to the line ``empty``."""

    file: int
    targets: tuple[Target, ...]
    empty: int | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class PrintFile:
    """PRINT[:FULL=line] #file, items: one message of a channel, or a line of a port; ``separators`` as in PRINT."""

    file: int
    items: tuple[Expression, ...] = ()
    separators: tuple[str, ...] = ()
    full: int | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Get:
    """GET[:EMPTY=line] #file, target: one character of a port."""

    file: int
    target: Target
    empty: int | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Put:
    """PUT #file, item: characters to a port."""

    file: int
    item: Expression
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


WaitingStatement = WaitOn | Delay | StartEvery | OpenChannel | OpenPort | Close | InputFile | PrintFile | Get | Put
"""The statements that only a BASIC task has."""
