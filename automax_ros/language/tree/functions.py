"""The functions of the language, as data: names, arguments, results, where they may be used.

The available manuals describe hardly any of them: names, arguments and results are ours unless a source is named
(decision).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from automax_ros.core.types import DataType


class ArgumentKind(enum.Enum):
    """Kind of an argument."""

    NUMBER = "number"
    INTEGER = "integer"
    STRING = "string"


class Result(enum.Enum):
    """The type of a function's value."""

    INTEGER = "INTEGER"
    DOUBLE = "DOUBLE INTEGER"
    REAL = "REAL"
    BOOLEAN = "BOOLEAN"
    STRING = "STRING"
    SAME = "as the argument; REAL if any argument is REAL"

    def of(self, arguments: tuple[DataType, ...]) -> DataType:
        """Return the type of the value for arguments of these types; booleans and INTEGERs count as DOUBLE INTEGER."""
        if self is not Result.SAME:
            return _FIXED[self]
        return DataType.REAL if DataType.REAL in arguments else DataType.DOUBLE


_FIXED = {
    Result.INTEGER: DataType.INTEGER,
    Result.DOUBLE: DataType.DOUBLE,
    Result.REAL: DataType.REAL,
    Result.BOOLEAN: DataType.BOOLEAN,
    Result.STRING: DataType.STRING,
}
ALL_TARGETS = frozenset({"automax", "pc3000", "udc"})
RACK_TARGETS = frozenset({"automax", "pc3000"})
MOST_ARGUMENTS = 16
"""Most arguments of MIN and MAX (decision)."""


@dataclass(frozen=True)
class Function:
    """A built-in function.

    ``arguments`` are the kinds of its arguments; with ``repeats`` the last kind may occur up to MOST_ARGUMENTS in all.
    ``unconfirmed``: no source confirms name or form. ``targets`` are the words of ``automax check --target``.
    ``text`` says what it returns and for which arguments; angles are in radians.
    """

    name: str
    arguments: tuple[ArgumentKind, ...]
    result: Result
    text: str
    repeats: bool = False
    unconfirmed: bool = False
    targets: frozenset[str] = ALL_TARGETS

    @property
    def most(self) -> int:
        """Largest number of arguments."""
        return MOST_ARGUMENTS if self.repeats else len(self.arguments)


_N, _I, _S = ArgumentKind.NUMBER, ArgumentKind.INTEGER, ArgumentKind.STRING


def _word(name: str, what: str) -> Function:
    """Return a function of a 16-bit word: the low 16 bits of the value, the result sign-extended (decision)."""
    text = f"{name}(x, n), n from 0 to 15: {what}; the word is the low 16 bits of x, another n is logged and gives x."
    return Function(name, (_I, _I), Result.INTEGER, text, unconfirmed=True)


_TABLE = (
    Function("ABS", (_N,), Result.SAME, "Absolute value (35.1); that of -2147483648 is clamped and logged."),
    Function("SQRT", (_N,), Result.REAL, "Square root; a negative argument is logged and gives 0."),
    Function("SIN", (_N,), Result.REAL, "Sine of an angle in radians."),
    Function("COS", (_N,), Result.REAL, "Cosine of an angle in radians."),
    Function("TAN", (_N,), Result.REAL, "Tangent of an angle in radians."),
    Function("ATN", (_N,), Result.REAL, "Arc tangent, -pi/2 to pi/2 radians."),
    Function("LN", (_N,), Result.REAL, "Natural logarithm; an argument of 0 or less is logged and gives 0."),
    Function("EXP", (_N,), Result.REAL, "e to the power of the argument; overflow is clamped and logged."),
    Function("INT", (_N,), Result.DOUBLE, "The integer part, truncated toward zero, clamped to 32 bits."),
    Function("SGN", (_N,), Result.INTEGER, "-1, 0 or 1: the sign."),
    Function("MIN", (_N, _N), Result.SAME, "The smallest of 2 to 16 numbers.", repeats=True),
    Function("MAX", (_N, _N), Result.SAME, "The largest of 2 to 16 numbers.", repeats=True),
    Function("LEN%", (_S,), Result.INTEGER, "Number of characters of a string."),
    Function("ASC%", (_S,), Result.INTEGER, "Code of a string's first character; an empty string is logged, gives 0."),
    Function(
        "CHR$", (_I,), Result.STRING, "The character with a code of 0 to 255; another is logged, gives an empty one."
    ),
    Function("STR$", (_N,), Result.STRING, "A number in decimal digits, as PRINT shows it."),
    Function(
        "VAL", (_S,), Result.REAL, "The number that a string holds; a string that is not a number is logged, gives 0."
    ),
    Function("LEFT$", (_S, _I), Result.STRING, "The first n characters; all of them if the string is shorter."),
    Function(
        "MID$", (_S, _I, _I), Result.STRING, "n characters from place p on, the first place being 1: MID$(s, p, n)."
    ),
    Function("RIGHT$", (_S, _I), Result.STRING, "The last n characters; all of them if the string is shorter."),
    _word("BIT_SET%", "the word with bit n set"),
    _word("BIT_CLR%", "the word with bit n cleared"),
    Function(
        "BIT_TST@", (_I, _I), Result.BOOLEAN, "TRUE if bit n, 0 to 31, of the 32-bit value is set.", unconfirmed=True
    ),
    _word("SHIFTL%", "the word shifted left by n places, zeros coming in"),
    _word("SHIFTR%", "the word shifted right by n places, zeros coming in"),
    _word("ROTATEL%", "the word rotated left by n places"),
    _word("ROTATER%", "the word rotated right by n places"),
    Function("TST_ERRLOG@", (), Result.BOOLEAN, "TRUE if the task's error log holds an error (J2-3106-1, 13)."),
    Function(
        "IOREAD%",
        (_I, _I),
        Result.INTEGER,
        "A register of the module in a slot: IOREAD%(slot, register).",
        unconfirmed=True,
        targets=RACK_TARGETS,
    ),
)
FUNCTIONS: dict[str, Function] = {function.name: function for function in _TABLE}
"""Every function by its full name."""

REFUSED_FUNCTIONS = {
    "RND": "random numbers would make a run that cannot be repeated",
    "VARPTR!": "a task of the emulator has no physical addresses",
    "GATEWAY_CMD_OK@": "it blocks the task until a network answers, which a control-block task must not",
}
"""Functions of the hardware's language that are refused, each with the reason (decision)."""
