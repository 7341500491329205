"""Reads and writes values as text: one spelling per data type everywhere.

Command lines, CSV tables and presets follow one rule (decision):

- digits are 0 to 9, without underscores; a sign may precede them;
- an INTEGER or DOUBLE INTEGER is a whole number of its range, also as spreadsheets write one: ``100.0``;
- a REAL is any decimal number, ``100``, ``100.0`` or ``1E3``, within the range of 2.4.2; one that is too small is 0;
- a BOOLEAN is TRUE, FALSE, ON or OFF in any case, or 1 or 0;
- a STRING is the unchanged text, up to the variable's length.

Blanks around a number or a boolean do not matter.
"""

from __future__ import annotations

import math
import re
import struct

from automax_ros.core.numbers import stored_real
from automax_ros.core.text import printable, quoted
from automax_ros.core.types import MAX_STRING_LENGTH, DataType, Value

_WHOLE = re.compile(r"([-+]?[0-9]{1,40})(?:\.0{0,40})?")
_DECIMAL = re.compile(r"[-+]?(?:[0-9]{1,60}(?:\.[0-9]{0,60})?|\.[0-9]{1,60})(?:[eE][-+]?[0-9]{1,4})?")
_TRUTH = {"TRUE": True, "ON": True, "FALSE": False, "OFF": False}
_SINGLE = struct.Struct("<f")
_FEWEST, _MOST = 6, 9
"""A single keeps any decimal with 6 digits, and 9 digits distinguish any two singles (IEEE 754)."""


def number(text: str) -> float:
    """Return the decimal number in a text.

    Raises:
        ValueError: the text is not a number, or it is beyond the range of a double.
    """
    if not is_number(text):
        raise ValueError(f"{quoted(text)} is not a number")
    found = float(text)
    if math.isinf(found):
        raise ValueError(f"{quoted(text)} is too large a number")
    return found


def whole_number(text: str) -> int:
    """Return the whole number in a text, such as ``100``, ``-3`` or ``100.0``.

    Raises:
        ValueError: the text is not a whole number.
    """
    match = _WHOLE.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{quoted(text)} is not a whole number")
    return int(match[1])


def is_number(text: str) -> bool:
    """Return whether a text is a decimal number of reasonable length."""
    return _DECIMAL.fullmatch(text.strip()) is not None


def value_of(text: str, kind: DataType, length: int = MAX_STRING_LENGTH) -> Value | None:
    """Return the value of a type in a text, as a variable would hold it; None if the text is not such a value.

    ``length`` is the most characters of a STRING.
    """
    if kind is DataType.STRING:
        return text if len(text) <= length and _can_be_sent(text) else None
    try:
        if kind is DataType.REAL:
            held, clamped = stored_real(number(text))
            return None if clamped else held
        if kind is DataType.BOOLEAN:
            truth = _TRUTH.get(text.strip().upper())
            return truth if truth is not None else {0: False, 1: True}.get(whole_number(text))
        low, high = kind.range
        whole = whole_number(text)
    except ValueError:
        return None
    return whole if low <= whole <= high else None


def wanted(kind: DataType, length: int = MAX_STRING_LENGTH) -> str:
    """Return in words what ``value_of`` accepts: ``a whole number from -32768 to 32767``."""
    if kind is DataType.STRING:
        return f"a text of at most {length} characters"
    if kind is DataType.BOOLEAN:
        return "0 or 1, FALSE or TRUE"
    return f"a {'whole ' if kind.is_integer else ''}number from {range_text(kind)}"


def range_text(kind: DataType) -> str:
    """Return the range of a numeric type for a message."""
    low, high = kind.range
    return f"{low} to {high}" if kind.is_integer else "-9.2233717E18 to 9.2233717E18"


def value_text(value: Value) -> str:
    """Return a value as in tables and status lines: booleans 1 and 0, REALs with no more digits than they have."""
    if isinstance(value, bool):
        return "1" if value else "0"
    return real_text(value) if isinstance(value, float) else str(value)


def source_text(value: Value) -> str:
    """Return a value as in a task's source: TRUE and FALSE, strings in quotes."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return f'"{printable(value)}"' if isinstance(value, str) else value_text(value)


def real_text(value: float) -> str:
    """Return the shortest text that gives the same single-precision value, as Python writes it: ``0.1``, ``2.0``.

    A number that is not a single is written in full.
    """
    for digits in range(_FEWEST, _MOST + 1):
        candidate = float(f"{value:.{digits}g}")
        try:
            if _SINGLE.unpack(_SINGLE.pack(candidate))[0] == value:
                return repr(candidate)
        except OverflowError:
            break
    return repr(value)


def _can_be_sent(text: str) -> bool:
    """Return whether a text can be encoded; input from a terminal that is not UTF-8 cannot."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
