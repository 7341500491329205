"""The syntax tree of a .BLK task: typed, frozen, equal by meaning.

Every node carries the span of its text; spans (and the spelling of constants) do not take part in equality,
so that a printed tree parses back to an equal one.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Span
from automax_ros.core.types import DataType, type_of_name
from automax_ros.language.tree.basic_tree import SetEvent, WaitingStatement
from automax_ros.language.tree.expression_tree import (
    NO_SPAN,
    Binary,
    BooleanLiteral,
    Element,
    Expression,
    FunctionCall,
    IntegerLiteral,
    RealLiteral,
    Reference,
    StringLiteral,
    Target,
    Unary,
    span_field,
)

__all__ = [
    "NO_SPAN",
    "Argument",
    "Assignment",
    "Binary",
    "BooleanLiteral",
    "Call",
    "ClearErrorLog",
    "Data",
    "Declaration",
    "Declared",
    "Element",
    "End",
    "Event",
    "Expression",
    "For",
    "FunctionCall",
    "Gosub",
    "Goto",
    "If",
    "IntegerLiteral",
    "IoWrite",
    "Label",
    "Module",
    "OnJump",
    "Print",
    "Read",
    "RealLiteral",
    "Reference",
    "Remark",
    "Restore",
    "Return",
    "Scope",
    "SetEvent",
    "Statement",
    "Stop",
    "StringLiteral",
    "Target",
    "Tuning",
    "Unary",
    "WaitingStatement",
]


@dataclass(frozen=True)
class Tuning:
    """The bracket of a tunable: expressions are constants, possibly with a sign; None where a key is absent."""

    current: Expression | None
    high: Expression | None = None
    low: Expression | None = None
    step: Expression | None = None
    span: Span = span_field()


@dataclass(frozen=True)
class Declared:
    """One variable of a LOCAL or COMMON statement.

    ``subscripts`` are the largest subscripts of an array, () for a simple variable;
    ``length`` is a string's maximum, None for the default.
    """

    name: str
    subscripts: tuple[int, ...] = ()
    length: int | None = None
    tuning: Tuning | None = None
    span: Span = span_field()

    @property
    def type(self) -> DataType:
        """The data type, given by the name."""
        return type_of_name(self.name)


class Scope(enum.Enum):
    """The control type of a variable (2.4.5)."""

    LOCAL = "LOCAL"
    COMMON = "COMMON"


@dataclass(frozen=True)
class Declaration:
    """LOCAL, COMMON or GLOBAL (which is COMMON)."""

    scope: Scope
    variables: tuple[Declared, ...]
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Assignment:
    """[LET] target = value."""

    target: Target
    value: Expression
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class If:
    """IF condition THEN ... [ELSE ...] [END_IF]. ``one_line`` is the form; ``IF c THEN 200`` contains a Goto."""

    condition: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...] = ()
    one_line: bool = False
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class For:
    """FOR variable = start TO stop [STEP step] ... NEXT variable."""

    variable: Reference
    start: Expression
    stop: Expression
    step: Expression | None
    body: tuple[Statement, ...]
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Goto:
    """GOTO line."""

    line: int
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Gosub:
    """GOSUB line."""

    line: int
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Return:
    """RETURN from a subroutine."""

    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class OnJump:
    """ON selector GOTO lines, or GOSUB lines; the first line is number 1."""

    selector: Expression
    lines: tuple[int, ...]
    gosub: bool = False
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Read:
    """READ targets: the next DATA values."""

    targets: tuple[Target, ...]
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Data:
    """DATA constants, each possibly with a sign."""

    values: tuple[Expression, ...]
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Restore:
    """RESTORE [line]: READ continues at the first DATA of the task, or at the first from that line on."""

    line: int | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Print:
    """PRINT items; ``separators`` follow the items: ``,`` or ``;``, the last one may be absent ("")."""

    items: tuple[Expression, ...] = ()
    separators: tuple[str, ...] = ()
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Stop:
    """STOP: the task ends."""

    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Event:
    """EVENT NAME = event [, INTERRUPT_STATUS = variable, TIMEOUT = count]."""

    name: str
    interrupt_status: Reference | None = None
    timeout: int | None = None
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Argument:
    """KEYWORD = value inside a CALL. The name of an event or a data structure parses as a Reference."""

    keyword: str
    value: Expression
    span: Span = span_field()


@dataclass(frozen=True)
class Call:
    """CALL block(KEYWORD = value, ...)."""

    block: str
    arguments: tuple[Argument, ...] = ()
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class IoWrite:
    """IOWRITE slot, register, value."""

    slot: Expression
    register: Expression
    value: Expression
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class ClearErrorLog:
    """CLR_ERRLOG."""

    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class End:
    """END: the end of the scan."""

    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Remark:
    """A remark; ``costs`` is true for ``!`` remarks, which take execution time, and false for REM (section 53)."""

    text: str
    costs: bool
    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


@dataclass(frozen=True)
class Label:
    """A numbered line that does nothing but can be the target of a jump.

    The lines of ELSE, END_IF and NEXT give one: ELSE as the last statement of ``then``, NEXT as the last of the loop's
    body (a jump there takes the next turn), END_IF after the If. A line with only a number is one too.
    """

    number: int | None = field(default=None, kw_only=True)
    span: Span = span_field()


Statement = (
    Declaration
    | Assignment
    | If
    | For
    | Goto
    | Gosub
    | Return
    | OnJump
    | Read
    | Data
    | Restore
    | Print
    | Stop
    | Event
    | Call
    | IoWrite
    | ClearErrorLog
    | End
    | Remark
    | Label
    | SetEvent
    | WaitingStatement
)


@dataclass(frozen=True)
class Module:
    """A whole task: its statements in order.

    ``number`` of a statement is the line number before it, None for a further statement of the same line.
    """

    statements: tuple[Statement, ...]
