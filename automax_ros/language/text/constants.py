"""Constants (2.4.2): their values and faults."""

from __future__ import annotations

from automax_ros.core.numbers import REAL_LIMIT, sign_extended
from automax_ros.language.text.tokens import SourceFault

HEX_DIGITS = 8
REAL_DIGITS = 8
STRING_LIMIT = 132
LARGEST_INTEGER = 2**31
"""Largest decimal constant; with a minus sign before it."""
LARGEST_REAL = REAL_LIMIT
SMALLEST_POSITIVE = 5.4210107e-20
SMALLEST_NEGATIVE = 2.7105054e-20


def hexadecimal_fault(text: str) -> tuple[int, SourceFault | None]:
    """Return the value of a hexadecimal constant, a signed 32-bit integer, and its fault (J-3675, 4.3)."""
    digits = text[:-1].lstrip("0") or "0"
    if len(digits) > HEX_DIGITS:
        return 0, SourceFault("AMX0024", f"a hexadecimal constant has at most {HEX_DIGITS} digits, here {len(digits)}")
    return sign_extended(int(digits, 16), 32), None


def integer_value(text: str) -> tuple[int, SourceFault | None]:
    """Return the value of a decimal constant and its fault; 2147483648 is allowed, for the minus sign before it."""
    digits = text.lstrip("0") or "0"
    value = int(digits) if len(digits) <= 10 else LARGEST_INTEGER + 1
    if value > LARGEST_INTEGER:
        return LARGEST_INTEGER - 1, SourceFault(
            "AMX0027",
            "the integer constant does not fit 32 bits",
            "it is at most 2147483647; a REAL constant has a decimal point",
        )
    return value, None


def real_fault(text: str) -> SourceFault | None:
    """Return the fault of a real constant; its sign is not known yet."""
    mantissa = text.partition("E")[0].replace(".", "")
    digits = len(mantissa.lstrip("0"))
    if digits > REAL_DIGITS:
        return SourceFault("AMX0025", f"a real constant has at most {REAL_DIGITS} digits, here {digits}")
    value = float(text)
    if value > LARGEST_REAL:
        return SourceFault(
            "AMX0026", "the real constant is too large", "a REAL reaches from -9.2233717E18 to 9.2233717E18"
        )
    if digits and value < SMALLEST_NEGATIVE:
        return SourceFault("AMX0026", "the real constant is too small", "the smallest positive REAL is 5.4210107E-20")
    return None


def string_fault(value: str) -> SourceFault | None:
    """Return the fault of a string constant."""
    if len(value) > STRING_LIMIT:
        return SourceFault("AMX0021", f"a string constant has at most {STRING_LIMIT} characters, here {len(value)}")
    bad = next((char for char in value if char != "\t" and not char.isprintable()), None)
    if bad is not None:
        return SourceFault(
            "AMX0004", f"character with the code {ord(bad):02X} hex in a string", "use CHR$ for control characters"
        )
    return None
