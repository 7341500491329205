"""The declaration of a control block: data plus one step function.

Checker, compiler, documentation, templates and the cost model all read the one declaration; nothing about a block
is written anywhere else.

The step function is pure. Its parameters are named after the declaration, in lower case: inputs, coefficients and
states, in any order, and only those it uses. It returns one tuple of plain names: the outputs, then the new states,
both in the order of the declaration; then, where outputs hold, ``writes``, which says whether those are written; and
last, where the block has ``logs``, the number of the problem (0 for none). Its body is straight assignments, ``if``,
``while`` and one ``return`` at the end; it uses integers, floats, booleans, comparisons, numeric constants of its
module and the helpers of ``HELPERS``. So it can be called directly, inlined by the compiler from its syntax tree, and
compiled to machine code.

Long data are buffers that a step reads by index: a table of the CALL, or a state with a ``size``, which it also writes
in place. A step may also have parameters of ``CALL_FACTS``, which are integers known when the task is compiled.

Three habits keep the inlined code fast. Inputs and coefficients are never assigned, so that a literal can replace
them. An optional output is assigned in one statement (``rate = a if c else b``) and never read, so that it vanishes
where it is not programmed. The common case takes the fewest comparisons and no call.

Booleans are ``bool``, INTEGERs ``int``, REALs and coefficients ``float``.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import floor
from typing import Any, ClassVar

from automax_ros.blocks.declare.dynamics import Dynamics
from automax_ros.core.numbers import clamp16, clamp32, round_count, sign_extended, truncated_quotient
from automax_ros.core.types import DataType, Value

HELPERS: dict[str, Callable[..., object]] = {
    "abs": abs,
    "clamp16": clamp16,
    "clamp32": clamp32,
    "float": float,
    "floor": floor,
    "int": int,
    "max": max,
    "min": min,
    "round_count": round_count,
    "sign_extended": sign_extended,
    "truncated_quotient": truncated_quotient,
}
"""The functions that a step function may call."""

CLAMPED = 7001
"""Number that a step function returns for AMX7001: its output was clamped to 16 bits."""
OVERFLOW = 7002
"""Number for AMX7002: a sum left 32 bits."""
DIVIDED_BY_ZERO = 7003
"""Number for AMX7003."""
COEFFICIENT_LIMITED = 7004
"""Number for AMX7004, which no step function returns: it is logged where coefficients are computed."""
NO_SUCH_COLUMN = 7005
"""Number for AMX7005."""


class Platform(enum.Enum):
    """A kind of controller that can run a block; the value is the word of ``automax check --target``."""

    AUTOMAX = "automax"
    PC3000 = "pc3000"
    UDC = "udc"


EVERYWHERE = frozenset(Platform)
NOT_ON_UDC = frozenset({Platform.AUTOMAX, Platform.PC3000})
UDC_ONLY = frozenset({Platform.UDC})


class Form(enum.Enum):
    """The forms in which a parameter may be written."""

    ANY = "variable or literal"
    VARIABLE = "variable only"
    LITERAL = "literal only"


class Special(enum.Enum):
    """Parameters that are not values: the name of an event, of an array, of a data structure."""

    EVENT = "event name"
    TABLE = "INTEGER array"
    BITS = "BOOLEAN data structure"
    WORDS = "INTEGER data structure"

    @property
    def element(self) -> DataType | None:
        """The type given by the name's type character, None for an event."""
        return {Special.TABLE: DataType.INTEGER, Special.WORDS: DataType.INTEGER, Special.BITS: DataType.BOOLEAN}.get(
            self
        )


ParameterType = DataType | Special


@dataclass(frozen=True)
class Input:
    """An input parameter (3.1: required, default or optional).

    ``default`` None with ``required`` False makes it optional: the block works without it. ``low`` and ``high`` bound a
    literal (both ends allowed), ``one_of`` lists the values it may have; ``symbol`` is the abbreviation in the manual's
    graphic, the name itself where the manual prints none; ``text`` says what it does. ``also`` is a second type that a
    variable may have. ``runs_on`` names the processors whose tasks may program it. ``wants_common``: the manual asks
    for a COMMON variable. ``sample`` is its value in a template, where that is not the default. ``drive_parameter`` is
    the parameter of the drive, as the rack file calls it, that a constant must be equal to; ``module`` the number of
    the module whose slot a literal names.
    """

    name: str
    type: ParameterType
    symbol: str
    text: str
    required: bool = False
    default: Value | None = None
    form: Form = Form.ANY
    low: int | float | None = None
    high: int | float | None = None
    one_of: tuple[int, ...] = ()
    also: DataType | None = None
    runs_on: frozenset[Platform] = EVERYWHERE
    wants_common: bool = False
    sample: Value | None = None
    drive_parameter: str = ""
    module: str = ""

    @property
    def variable(self) -> str:
        """Its name in the step function."""
        return self.name.lower()

    @staticmethod
    def integer(name: str, symbol: str, text: str, default: int | None = None, **more: Any) -> Input:
        """Return an INTEGER input, which is required without a default; ``more`` are further fields."""
        return Input(name, DataType.INTEGER, symbol, text, default is None, default, **more)

    @staticmethod
    def boolean(name: str, symbol: str, text: str, *, default: bool | None = None, **more: Any) -> Input:
        """Return a BOOLEAN input, which is required without a default; ``more`` are further fields."""
        return Input(name, DataType.BOOLEAN, symbol, text, default is None, default, **more)

    @staticmethod
    def real(name: str, symbol: str, text: str, default: float | None = None, **more: Any) -> Input:
        """Return a REAL input, which is required without a default; ``more`` are further fields."""
        return Input(name, DataType.REAL, symbol, text, default is None, default, **more)


@dataclass(frozen=True)
class Output:
    """An output parameter: always a variable, never inverted.

    ``holds``: it is written only where the step function says so; otherwise its variable is neither read nor written.
    With ``dimensions``, numbers of elements, it is a whole array of exactly these. ``alias`` is another spelling of its
    name in the manual, which is accepted with a warning.
    """

    name: str
    type: DataType
    symbol: str
    text: str
    required: bool = True
    holds: bool = False
    wants_common: bool = False
    dimensions: tuple[int, ...] = ()
    alias: str = ""

    @property
    def variable(self) -> str:
        """Its name in the step function."""
        return self.name.lower()


@dataclass(frozen=True)
class State:
    """A value that a block keeps from scan to scan: ``initial`` at its first execution since RUN.

    INTEGER states are ints of any width the step function keeps to; REAL states and coefficients are double precision,
    not a REAL's 24 bits (decision). A state with a ``size`` is a buffer: ``size`` gives the number of its elements from
    the facts of the CALL by lower-case name, which are its literals and defaults, and the ``CALL_FACTS``. A place in a
    buffer, or a count of places, is always 0 or more and less than what ``below`` gives; a snapshot that breaks this is
    refused.
    """

    name: str
    type: DataType
    initial: Value
    size: Callable[[Mapping[str, Value]], int] | None = None
    below: Callable[[Mapping[str, Value]], int] | None = None


CALL_FACTS = ("elements", "channels", "max_columns", "programmed")
"""Facts of its CALL that a step function may read: the elements of TABLE1, channels and columns of the data structure,
and which of the inputs INPUT1, INPUT2 ... are programmed, as the bits 0, 1 ... of a number."""


@dataclass(frozen=True)
class Given:
    """A parameter of a CALL as rules see it: a literal's ``value``, a one-dimensional array's ``size``.

    Both are None for other variables; the size also for an array whose declaration is at fault.
    """

    value: Value | None = None
    size: int | None = None


@dataclass(frozen=True)
class Fault:
    """A rule that a CALL breaks: ``keyword`` is the parameter at fault, None for the CALL as a whole."""

    message: str
    keyword: str | None = None
    code: str = "AMX4082"


class Rule(ABC):
    """A rule over the set of parameters that a CALL gives, beyond those of each parameter."""

    sentence: ClassVar[str]
    """The rule for the documentation, a format string of the ``rule``'s fields."""

    @property
    def text(self) -> str:
        """The rule as a sentence for the documentation."""
        return self.sentence.format(rule=self)

    @abstractmethod
    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of the given parameters, which are by keyword in the order of the CALL."""


Bound = Callable[[float, Mapping[str, float]], float]
"""A limit of a coefficient: from the scan period in seconds and the REAL parameters in force."""


@dataclass(frozen=True)
class Limit:
    """The limits of one REAL parameter at a scan period, both ends allowed.

    ``uses`` names the other parameters that the bounds read; ``low_text`` and ``high_text`` are the formulas.
    """

    parameter: str
    low: Bound
    high: Bound
    low_text: str
    high_text: str
    uses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Relation:
    """A rule between parameters that are each within their limits.

    Where ``holds`` is not met, the last values that met it stay in force (36, 44.1). ``first(period_s, values)`` gives
    the values in force as long as there are none. No parameter of a relation may be 0. ``ratio`` are the bounds of the
    ratio of the larger of two parameters to the smaller, where that is the rule.
    """

    parameters: tuple[str, ...]
    holds: Callable[[Mapping[str, float]], bool]
    first: Callable[[float, Mapping[str, float]], Mapping[str, float]]
    text: str
    ratio: tuple[float, float] | None = None


@dataclass(frozen=True)
class Coefficients:
    """Values that are computed outside a dynamic block's step function, first and when a variable parameter changes.

    ``parameters`` are the inputs they come from; ``names`` the values passed to the step function;
    ``compute(period_s, values)`` returns them, from parameters already limited. A parameter that is not programmed,
    such as WM, is filled in by ``defaults(period_s)`` before. A variable one that leaves its limits counts as the
    nearest limit and logs AMX7004 on the scan in which it leaves them, not while it stays beyond (decision). A literal
    beyond them is an error of the task, unless ``limits_literals``: then it is limited and logged too. ``dynamics`` is
    the block's behavior with them. ``executed_every`` names a literal that gives the time between executions in s.
    """

    parameters: tuple[str, ...]
    names: tuple[str, ...]
    limits: tuple[Limit, ...]
    defaults: Callable[[float], Mapping[str, float]]
    compute: Callable[[float, Mapping[str, float]], tuple[float, ...]]
    dynamics: Dynamics
    relation: Relation | None = None
    limits_literals: bool = False
    executed_every: str = ""

    @property
    def period_name(self) -> str:
        """The name of the time between executions: T, the scan period, or the parameter that gives it."""
        return self.executed_every or "T"


class Access(enum.Enum):
    """Whether a block makes or uses the data structure that its STRUCTURE_NAME names."""

    MAKES = "makes"
    USES = "uses"


@dataclass(frozen=True)
class Time:
    """An execution time in microseconds: ``base`` plus a term for each letter of the manual's tables 4 to 6.

    n outputs, k input pairs, j inputs of numbered channels, p input/output pairs, m elements searched, o order of the
    filter; t, i, b, d: common variables referenced (all latched ones, INTEGER, BOOLEAN, DOUBLE INTEGER). ``alone`` is
    added where only one task runs on a UDC module (x and z of table 5). The elements searched are those that a scan
    looks at, from the first of the table to the one that matches (decision).
    """

    base: float
    n: float = 0.0
    k: float = 0.0
    j: float = 0.0
    p: float = 0.0
    m: float = 0.0
    o: float = 0.0
    t: float = 0.0
    i: float = 0.0
    b: float = 0.0
    d: float = 0.0
    alone: float = 0.0


@dataclass(frozen=True)
class BlockTimes:
    """Execution times by Processor: 7010 (57C435), 6010/6011 (57C430A, 57C431), UDC, PC3000; None: cannot run it."""

    model_7010: Time | None
    model_6010: Time | None
    udc: Time | None
    pc3000: Time | None


Step = Callable[..., tuple[Any, ...]]


@dataclass(frozen=True)
class LineScan:
    """The scans of a task whose block begins them by interrupts in step with an AC line, not by the clock (52.0).

    ``frequency`` is the literal that gives the line's frequency in Hz, ``per_cycle`` the number of scans in a cycle,
    ``tick_ns`` the only tick that the Processor may have.
    """

    frequency: str
    per_cycle: int
    tick_ns: int


@dataclass(frozen=True)
class Block:
    """A control block. ``function`` is its equation in one or a few lines, ``notes`` what else a user must know.

    ``step`` is None for a block that only ``begins_scan``: the task itself executes it; ``line_scan`` says that
    interrupts begin the scan. ``logs`` are the problems whose number the step function returns. ``structure`` says what
    the block does with a data structure: the states of the block that makes it are the structure's, and the step
    functions of those that use it have them as parameters too, to read, or to write a buffer in place. ``expected_on``
    are Processors whose every task should call the block, for the reason ``expected_since``. ``searched_to`` is the
    output that gives the last element searched, or a negative number where all were: ``Time.m`` counts them.
    ``also_called`` are its names in the manuals or in other controllers, ``for_booleans`` names what does its work with
    BOOLEANs; both are for hints.
    """

    name: str
    section: str
    title: str
    function: str
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    times: BlockTimes
    step: Step | None
    states: tuple[State, ...] = ()
    coefficients: Coefficients | None = None
    rules: tuple[Rule, ...] = ()
    logs: tuple[str, ...] = ()
    structure: Access | None = None
    runs_on: frozenset[Platform] = EVERYWHERE
    notes: tuple[str, ...] = ()
    begins_scan: bool = False
    line_scan: LineScan | None = None
    expected_on: frozenset[Platform] = frozenset()
    expected_since: str = ""
    searched_to: str = ""
    also_called: tuple[str, ...] = ()
    for_booleans: str = ""

    @property
    def parameters(self) -> tuple[Input | Output, ...]:
        """Inputs, then outputs."""
        return (*self.inputs, *self.outputs)

    @property
    def holds(self) -> bool:
        """Whether the block does not always write its outputs."""
        return any(output.holds for output in self.outputs)

    @property
    def problems(self) -> tuple[str, ...]:
        """Codes of all problems that the block can log: ``logs``, and AMX7004 where it has coefficients."""
        return self.logs if self.coefficients is None else (*self.logs, f"AMX{COEFFICIENT_LIMITED}")

    def parameter(self, keyword: str) -> Input | Output | None:
        """Return the parameter of that name or alias, None where the block has none."""
        return next((item for item in self.parameters if keyword in (item.name, getattr(item, "alias", ""))), None)
