"""The functions that compiled BASIC statements call: built-in functions and operations that can fail.

A function that can fail returns its result and the number of the problem, 0 for none; the others return the result.
Nothing here raises, whatever the arguments.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.core.numbers import (
    INT32_MAX,
    INT32_MIN,
    REAL_MAX,
    clamp16,
    clamp32,
    sign_extended,
    stored_real,
    truncated_quotient,
)
from automax_ros.core.types import DataType, Value

OVERFLOW = 7023
DIVISION_BY_ZERO = 7024
BAD_ARGUMENT = 7025
WRONG_DATA = 7032
INTEGER_CLAMPED, DOUBLE_CLAMPED, REAL_CLAMPED = 7020, 7021, 7022
WORD = 16
"""Bits of the word that the bit functions, shifts and rotations work on (decision: an INTEGER)."""
TEMPORARY_STRING = 132
"""Longest string that an expression works with (J-3675 p. 5-4)."""

Fallible = tuple[float, int]


def integer_quotient(left: int, right: int) -> tuple[int, int]:
    """Divide integers, truncating toward zero; by zero gives the clamp of the numerator's sign, 0/0 gives 0."""
    if right == 0:
        return (INT32_MAX if left > 0 else INT32_MIN if left < 0 else 0), DIVISION_BY_ZERO
    return truncated_quotient(left, right), 0


def real_quotient(left: float, right: float) -> Fallible:
    """Divide REALs; by zero gives the largest REAL of the numerator's sign, 0/0 gives 0."""
    if right == 0:
        return (REAL_MAX if left > 0 else -REAL_MAX if left < 0 else 0.0), DIVISION_BY_ZERO
    return left / right, 0


def integer_power(base: int, exponent: int) -> tuple[int, int]:
    """Raise an integer to an integer in bounded steps, clamped to 32 bits; a negative exponent truncates."""
    if exponent < 0:
        if base == 0:
            return INT32_MAX, DIVISION_BY_ZERO
        return (1 if exponent % 2 == 0 else int(base)) if abs(base) == 1 else 0, 0
    if base in (0, 1) or exponent == 0:
        return 1 if exponent == 0 else int(base), 0
    if base == -1:
        return 1 if exponent % 2 == 0 else -1, 0
    if exponent > 31:
        return INT32_MIN if base < 0 and exponent % 2 else INT32_MAX, OVERFLOW
    power = base**exponent
    clamped = clamp32(power)
    return clamped, 0 if clamped == power else OVERFLOW


def real_power(base: float, exponent: float) -> Fallible:
    """Raise a REAL to a power: a negative base needs a whole exponent; overflow gives the largest REAL."""
    try:
        power = base**exponent
    except ZeroDivisionError:
        return REAL_MAX, DIVISION_BY_ZERO
    except OverflowError:
        if base >= 0:
            return REAL_MAX, OVERFLOW
        if exponent != int(exponent):
            return 0.0, BAD_ARGUMENT
        return -REAL_MAX if int(exponent) % 2 else REAL_MAX, OVERFLOW
    if isinstance(power, complex):
        return 0.0, BAD_ARGUMENT
    return power, 0


def whole(value: float) -> int:
    """Return a REAL without its fraction; NaN gives 0, an infinite one a value beyond 32 bits."""
    if math.isnan(value):
        return 0
    if value >= 1e18:
        return 10**18
    return -(10**18) if value <= -1e18 else int(value)


def store_real(value: float) -> tuple[float, bool]:
    """Return the value that a REAL variable stores, and whether it was clamped."""
    return stored_real(value)


def sign(value: float) -> int:
    """SGN: -1, 0 or 1."""
    return (value > 0) - (value < 0)


def square_root(value: float) -> Fallible:
    """SQRT: of a negative number 0, and a problem."""
    return (math.sqrt(value), 0) if 0 <= value < math.inf else (0.0, BAD_ARGUMENT)


def sine(angle_rad: float) -> Fallible:
    """SIN of an angle in radians."""
    return (math.sin(angle_rad), 0) if math.isfinite(angle_rad) else (0.0, BAD_ARGUMENT)


def cosine(angle_rad: float) -> Fallible:
    """COS of an angle in radians."""
    return (math.cos(angle_rad), 0) if math.isfinite(angle_rad) else (0.0, BAD_ARGUMENT)


def tangent(angle_rad: float) -> Fallible:
    """TAN of an angle in radians."""
    return (math.tan(angle_rad), 0) if math.isfinite(angle_rad) else (0.0, BAD_ARGUMENT)


def arc_tangent(value: float) -> Fallible:
    """ATN: the angle in radians."""
    return (0.0, BAD_ARGUMENT) if math.isnan(value) else (math.atan(value), 0)


def natural_logarithm(value: float) -> Fallible:
    """LN: of zero or less 0, and a problem."""
    return (math.log(value), 0) if 0 < value < math.inf else (0.0, BAD_ARGUMENT)


def exponential(value: float) -> Fallible:
    """EXP: e to a power; beyond the range of a REAL the largest, and a problem."""
    return (math.exp(value), 0) if value < 700 else (REAL_MAX, OVERFLOW)


def length(text: str) -> int:
    """LEN%: number of characters."""
    return len(text)


def character_code(text: str) -> tuple[int, int]:
    """ASC%: code of the first character; of an empty string 0, and a problem."""
    return (ord(text[0]) & 255, 0) if text else (0, BAD_ARGUMENT)


def character(code: float) -> tuple[str, int]:
    """CHR$: the character of a code from 0 to 255."""
    number = whole(code)
    return (chr(number), 0) if 0 <= number <= 255 else ("", BAD_ARGUMENT)


def real_text(value: float) -> str:
    """Return a REAL as text for PRINT and STR$: eight significant digits, no unnecessary zeros."""
    text = f"{value + 0.0:.8G}"
    if "E" in text:
        mantissa, _, exponent = text.partition("E")
        return f"{mantissa}E{int(exponent):+03d}"
    return text


def text_of(value: object) -> str:
    """STR$: a number as text; a boolean is TRUE or FALSE."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, float):
        return real_text(value)
    return str(value)


def number_of(text: str) -> Fallible:
    """VAL: the number in a text; 0 and a problem where there is none."""
    stripped = text.strip()
    if not stripped or set(stripped) - set("0123456789+-.Ee"):
        return 0.0, BAD_ARGUMENT
    try:
        value, overflowed = stored_real(float(stripped))
    except ValueError:
        return 0.0, BAD_ARGUMENT
    return value, OVERFLOW if overflowed else 0


def left_part(text: str, count: float) -> tuple[str, int]:
    """LEFT$: the first characters."""
    number = whole(count)
    return (text[:number], 0) if number >= 0 else ("", BAD_ARGUMENT)


def right_part(text: str, count: float) -> tuple[str, int]:
    """RIGHT$: the last characters."""
    number = whole(count)
    return (text[max(0, len(text) - number) :], 0) if number >= 0 else ("", BAD_ARGUMENT)


def middle_part(text: str, start: float, count: float = 255) -> tuple[str, int]:
    """MID$: ``count`` characters from ``start`` on; the first character is number 1."""
    first, number = whole(start), whole(count)
    if first < 1 or number < 0:
        return "", BAD_ARGUMENT
    return text[first - 1 : first - 1 + number], 0


def joined(left: str, right: str) -> str:
    """Join two strings; a temporary string has at most 132 characters."""
    return (left + right)[:TEMPORARY_STRING]


def bit_set(value: int, bit: int) -> tuple[int, int]:
    """BIT_SET%: the low 16 bits of the value, sign-extended, with a bit (0 to 15) set."""
    return (sign_extended(value | 1 << bit, WORD), 0) if 0 <= bit < WORD else (value, BAD_ARGUMENT)


def bit_clear(value: int, bit: int) -> tuple[int, int]:
    """BIT_CLR%: the low 16 bits of the value, sign-extended, with a bit (0 to 15) cleared."""
    return (sign_extended(value & ~(1 << bit), WORD), 0) if 0 <= bit < WORD else (value, BAD_ARGUMENT)


def bit_test(value: int, bit: int) -> tuple[bool, int]:
    """BIT_TST@: whether a bit (0 to 31) of the 32-bit value is set."""
    return (bool(value >> bit & 1), 0) if 0 <= bit <= 31 else (False, BAD_ARGUMENT)


def shift_left(value: int, count: int) -> tuple[int, int]:
    """SHIFTL%: the low 16 bits of the value shifted left by 0 to 15 places, filled with zeros."""
    return (sign_extended(value << count, WORD), 0) if 0 <= count < WORD else (value, BAD_ARGUMENT)


def shift_right(value: int, count: int) -> tuple[int, int]:
    """SHIFTR%: the low 16 bits of the value shifted right by 0 to 15 places, filled with zeros."""
    return (sign_extended((value & 0xFFFF) >> count, WORD), 0) if 0 <= count < WORD else (value, BAD_ARGUMENT)


def rotate_left(value: int, count: int) -> tuple[int, int]:
    """ROTATEL%: the low 16 bits of the value rotated left by 0 to 15 places."""
    if not 0 <= count < WORD:
        return value, BAD_ARGUMENT
    pattern = value & 0xFFFF
    return sign_extended(pattern << count | pattern >> (WORD - count), WORD), 0


def rotate_right(value: int, count: int) -> tuple[int, int]:
    """ROTATER%: the low 16 bits of the value rotated right by 0 to 15 places."""
    return rotate_left(value, -count % WORD) if 0 <= count < WORD else (value, BAD_ARGUMENT)


def data_value(value: Value, suffix: str, limit: int) -> tuple[Value, int]:
    """Return a DATA value converted by READ for a variable of a type character, and the problem, 0 for none.

    ``limit`` is the length of a string variable.
    """
    kind = DataType(suffix)
    if kind is DataType.STRING:
        return (value[:limit], 0) if isinstance(value, str) else ("", WRONG_DATA)
    if kind is DataType.BOOLEAN:
        return (value, 0) if isinstance(value, bool) else (False, WRONG_DATA)
    if isinstance(value, (bool, str)):
        return kind.zero, WRONG_DATA
    if kind is DataType.REAL:
        single, overflowed = stored_real(float(value))
        return single, REAL_CLAMPED if overflowed else 0
    number = whole(value)
    stored = clamp16(number) if kind is DataType.INTEGER else clamp32(number)
    return stored, 0 if stored == number else INTEGER_CLAMPED if kind is DataType.INTEGER else DOUBLE_CLAMPED


@dataclass(frozen=True)
class Builtin:
    """The implementation of a BASIC function: ``fallible`` ones return a problem with the result.

    ``low`` and ``high`` bound an integer result.
    """

    carry_out: Callable[..., object]
    fallible: bool
    low: int = INT32_MIN
    high: int = INT32_MAX


BUILTINS: dict[str, Builtin] = {
    "SGN": Builtin(sign, False, -1, 1),
    "SQRT": Builtin(square_root, True),
    "SIN": Builtin(sine, True),
    "COS": Builtin(cosine, True),
    "TAN": Builtin(tangent, True),
    "ATN": Builtin(arc_tangent, True),
    "LN": Builtin(natural_logarithm, True),
    "EXP": Builtin(exponential, True),
    "LEN%": Builtin(length, False, 0, 255),
    "ASC%": Builtin(character_code, True, 0, 255),
    "CHR$": Builtin(character, True),
    "STR$": Builtin(text_of, False),
    "VAL": Builtin(number_of, True),
    "LEFT$": Builtin(left_part, True),
    "MID$": Builtin(middle_part, True),
    "RIGHT$": Builtin(right_part, True),
    "BIT_SET%": Builtin(bit_set, True),
    "BIT_CLR%": Builtin(bit_clear, True),
    "BIT_TST@": Builtin(bit_test, True),
    "SHIFTL%": Builtin(shift_left, True),
    "SHIFTR%": Builtin(shift_right, True),
    "ROTATEL%": Builtin(rotate_left, True),
    "ROTATER%": Builtin(rotate_right, True),
}
"""The functions that are plain calls; ABS, INT, MIN, MAX and those of the task are in the compiler."""

OPERATIONS: dict[str, Callable[..., object]] = {
    function.__name__: function
    for function in (integer_quotient, real_quotient, integer_power, real_power, whole, store_real, joined, data_value)
}
"""The operations of expressions that generated code calls, by name."""
