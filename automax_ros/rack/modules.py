"""The AutoMax modules that a rack file may name, and why it may not name the others.

Numbers and uses are those of the manuals' module tables; a letter after the number is the revision (57C413B), which
the emulator does not tell apart (decision), except for the 57C430.
"""

from __future__ import annotations

import re

PROCESSORS = {"57C430A": "6010", "57C431": "6011", "57C435": "7010"}
"""Processor modules and their names (J2-3106-1 p. 10-1)."""
COMMON_MEMORY_REGISTERS = {"57C413": 65536, "57C423": 131072}
"""Common memory modules and their 16-bit registers in slot 0 (J-3636 p. 1-1)."""
PROCESSOR_REGISTERS = 65536
"""Registers for commons where a Processor works alone (decision: as many as the 57C413 has)."""
SUPPORTED = (*PROCESSORS, *COMMON_MEMORY_REGISTERS)

NOT_YET = {
    "57552": "UDC module",
    "57C402": "digital output module",
    "57C403": "digital output module",
    "57C404": "DCS-NET network module",
    "57C405": "drive analog I/O module",
    "57C406": "DC drive controller",
    "57C408": "drive digital I/O module",
    "57C409": "2-channel analog input module",
    "57C410": "analog output module",
    "57C411": "resolver input module",
    "57C414": "Modbus interface module",
    "57C416": "remote I/O module",
    "57C417": "R-Net module",
    "57C418": "A-B interface module",
    "57C419": "32-channel digital input module",
    "57C421": "pulsetach input module",
    "57C560": "AutoMax PC3000",
    "57C565": "AutoMax PC3000",
    "57C570": "AutoMax PC3000",
}
"""Modules that exist but that the emulator cannot be yet."""

_NUMBER = re.compile(r"(57C?[0-9]{3})[A-Z]?\Z")


def module_number(text: str) -> str:
    """Return a module's number as the tables here have it: ``57c413b`` is 57C413, ``B/M 57552`` is 57552."""
    plain = text.upper().removeprefix("B/M").replace("-", "").strip()
    if plain in PROCESSORS:
        return plain
    match = _NUMBER.match(plain)
    return match.group(1) if match else plain
