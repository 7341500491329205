"""The syntax tree of a task: typed, frozen, equal by meaning.

Every node carries the span of its text; spans (and the spelling of constants) do not take part in equality,
so that a printed tree parses back to an equal one. The statements of BASIC tasks alone, of events, times, channels and
ports (J-3675 6.6, 6.7, 6.8), are at the end.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Span
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, type_of_name

NO_SPAN = Span(0, 0, 0)
"""The span of a node made without a text."""


@dataclass(frozen=True, kw_only=True)
class Node:
    """A part of the tree: ``span`` is the place of its text."""

    span: Span = field(default=NO_SPAN, compare=False)


@dataclass(frozen=True, kw_only=True)
class Statement(Node):
    """A statement: ``number`` is the line number before it, None for a further statement of the same line."""

    number: int | None = None


@dataclass(frozen=True)
class IntegerLiteral(Node):
    """A decimal or hexadecimal integer constant; ``value`` is the signed 32-bit value (decimal ones may exceed it)."""

    value: int
    hexadecimal: bool = False


@dataclass(frozen=True)
class RealLiteral(Node):
    """A real constant; ``text`` is its spelling."""

    value: float
    text: str = field(default="", compare=False)


@dataclass(frozen=True)
class StringLiteral(Node):
    """A string constant without its quotes."""

    value: str


@dataclass(frozen=True)
class BooleanLiteral(Node):
    """TRUE, ON, FALSE or OFF."""

    value: bool


@dataclass(frozen=True)
class Named(Node):
    """A node with a variable's name, which ends with the type character."""

    name: str

    @property
    def type(self) -> DataType:
        """The data type, given by the name."""
        return type_of_name(self.name)


@dataclass(frozen=True)
class Reference(Named):
    """A simple variable by its name, or a whole array where one is expected."""


@dataclass(frozen=True)
class Element(Named):
    """An array element."""

    subscripts: tuple[Expression, ...]


@dataclass(frozen=True)
class Unary(Node):
    """A sign or NOT: ``operator`` is ``-``, ``+`` or ``NOT``. ``-NAME@`` in a block parameter inverts."""

    operator: str
    operand: Expression


@dataclass(frozen=True)
class Binary(Node):
    """Two operands: ``** * / + - = <> < > <= >= AND OR XOR``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class FunctionCall(Node):
    """A call of a built-in function; ``name`` keeps its type character, such as ``BIT_SET%``."""

    name: str
    arguments: tuple[Expression, ...] = ()


Expression = (
    IntegerLiteral | RealLiteral | StringLiteral | BooleanLiteral | Reference | Element | Unary | Binary | FunctionCall
)
Target = Reference | Element


@dataclass(frozen=True)
class Tuning(Node):
    """The bracket of a tunable: expressions are constants, possibly with a sign; None where a key is absent."""

    current: Expression | None
    high: Expression | None = None
    low: Expression | None = None
    step: Expression | None = None


@dataclass(frozen=True)
class Declared(Named):
    """One variable of a LOCAL or COMMON statement.

    ``subscripts`` are the largest subscripts of an array, () for a simple variable;
    ``length`` is a string's maximum, None for the default.
    """

    subscripts: tuple[int, ...] = ()
    length: int | None = None
    tuning: Tuning | None = None


class Scope(enum.Enum):
    """The control type of a variable (2.4.5)."""

    LOCAL = "LOCAL"
    COMMON = "COMMON"


@dataclass(frozen=True)
class Declaration(Statement):
    """LOCAL, COMMON or GLOBAL (which is COMMON)."""

    scope: Scope
    variables: tuple[Declared, ...]


@dataclass(frozen=True)
class Assignment(Statement):
    """[LET] target = value."""

    target: Target
    value: Expression


@dataclass(frozen=True)
class If(Statement):
    """IF condition THEN ... [ELSE ...] [END_IF]. ``one_line`` is the form; ``IF c THEN 200`` contains a Goto."""

    condition: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...] = ()
    one_line: bool = False


@dataclass(frozen=True)
class For(Statement):
    """FOR variable = start TO stop [STEP step] ... NEXT variable."""

    variable: Reference
    start: Expression
    stop: Expression
    step: Expression | None
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Goto(Statement):
    """GOTO line."""

    line: int


@dataclass(frozen=True)
class Gosub(Statement):
    """GOSUB line."""

    line: int


@dataclass(frozen=True)
class Return(Statement):
    """RETURN from a subroutine."""


@dataclass(frozen=True)
class OnJump(Statement):
    """ON selector GOTO lines, or GOSUB lines; the first line is number 1."""

    selector: Expression
    lines: tuple[int, ...]
    gosub: bool = False


@dataclass(frozen=True)
class Read(Statement):
    """READ targets: the next DATA values."""

    targets: tuple[Target, ...]


@dataclass(frozen=True)
class Data(Statement):
    """DATA constants, each possibly with a sign."""

    values: tuple[Expression, ...]


@dataclass(frozen=True)
class Restore(Statement):
    """RESTORE [line]: READ continues at the first DATA of the task, or at the first from that line on."""

    line: int | None = None


@dataclass(frozen=True)
class Print(Statement):
    """PRINT items; ``separators`` follow the items: ``,`` or ``;``, the last one may be absent ("")."""

    items: tuple[Expression, ...] = ()
    separators: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stop(Statement):
    """STOP: the task ends."""


@dataclass(frozen=True)
class Event(Statement):
    """EVENT NAME = event [, INTERRUPT_STATUS = variable, TIMEOUT = count]."""

    name: str
    interrupt_status: Reference | None = None
    timeout: int | None = None


@dataclass(frozen=True)
class Argument(Node):
    """KEYWORD = value inside a CALL. The name of an event or a data structure parses as a Reference."""

    keyword: str
    value: Expression


@dataclass(frozen=True)
class Call(Statement):
    """CALL block(KEYWORD = value, ...)."""

    block: str
    arguments: tuple[Argument, ...] = ()


@dataclass(frozen=True)
class IoWrite(Statement):
    """IOWRITE slot, register, value."""

    slot: Expression
    register: Expression
    value: Expression


@dataclass(frozen=True)
class ClearErrorLog(Statement):
    """CLR_ERRLOG."""


@dataclass(frozen=True)
class End(Statement):
    """END: the end of the scan."""


@dataclass(frozen=True)
class Remark(Statement):
    """A remark; ``costs`` is true for ``!`` remarks, which take execution time, and false for REM (section 53)."""

    text: str
    costs: bool


@dataclass(frozen=True)
class Label(Statement):
    """A numbered line that does nothing but can be the target of a jump.

    The lines of ELSE, END_IF and NEXT give one: ELSE as the last statement of ``then``, NEXT as the last of the loop's
    body (a jump there takes the next turn), END_IF after the If. A line with only a number is one too.
    """


@dataclass(frozen=True)
class Module:
    """A whole task: its statements in order."""

    statements: tuple[Statement, ...]


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
class SetEvent(Statement):
    """SET event: sets the event."""

    event: str


@dataclass(frozen=True)
class WaitOn(Statement):
    """WAIT ON event: the task is suspended until the event is set."""

    event: str


@dataclass(frozen=True)
class Delay(Statement):
    """DELAY count unit: the task is suspended for a time."""

    count: Expression
    unit: Unit


@dataclass(frozen=True)
class StartEvery(Statement):
    """START EVERY count unit: after END the task continues at the statement after this one, once per period."""

    count: Expression
    unit: Unit


@dataclass(frozen=True)
class OpenChannel(Statement):
    """OPEN CHANNEL FOR direction AS FILE #file, TYPE = (types) [, DEPTH = depth]; the reader gives the depth."""

    direction: Direction
    file: int
    types: tuple[DataType, ...]
    depth: Expression | None = None


@dataclass(frozen=True)
class OpenPort(Statement):
    """OPEN "PORTx" AS FILE #file, SETUP = word, baud rate; or ACCESS = EXCLUSIVE or NON_EXCLUSIVE."""

    port: str
    file: int
    setup: Expression | None = None
    baud: Expression | None = None
    access: str = ""


@dataclass(frozen=True)
class Close(Statement):
    """CLOSE #file: of a port."""

    file: int


@dataclass(frozen=True)
class InputFile(Statement):
    """INPUT[:EMPTY=line] #file, targets: one message of a channel; if there is none, a jump to the line ``empty``."""

    file: int
    targets: tuple[Target, ...]
    empty: int | None = None


@dataclass(frozen=True)
class PrintFile(Statement):
    """PRINT[:FULL=line] #file, items: one message of a channel, or a line of a port; ``separators`` as in PRINT."""

    file: int
    items: tuple[Expression, ...] = ()
    separators: tuple[str, ...] = ()
    full: int | None = None


@dataclass(frozen=True)
class Get(Statement):
    """GET[:EMPTY=line] #file, target: one character of a port."""

    file: int
    target: Target
    empty: int | None = None


@dataclass(frozen=True)
class Put(Statement):
    """PUT #file, item: characters to a port."""

    file: int
    item: Expression
