"""The AutoMax modules that a rack file may name, and the reasons why it may not name the others.

Numbers and uses are those of the manuals' module tables; a letter after the number is the revision (57C413B), which the
emulator does not distinguish (decision), except for the 57C430.
"""

from __future__ import annotations

import re

from automax_ros.core.json_schema import Schema, either, named, words
from automax_ros.rackfile.modules.common_memory import COMMON_MEMORY
from automax_ros.rackfile.modules.drive import DRIVE_ANALOG, DRIVE_CONTROLLER
from automax_ros.rackfile.modules.io import ANALOG_IO, DIGITAL_IO, PULSETACH, RESOLVER
from automax_ros.rackfile.modules.kind import ModuleKind
from automax_ros.rackfile.modules.network import NETWORK
from automax_ros.rackfile.modules.processor import PC3000, PROCESSOR
from automax_ros.rackfile.modules.udc import UDC

KINDS: tuple[ModuleKind, ...] = (
    PROCESSOR,
    PC3000,
    COMMON_MEMORY,
    DIGITAL_IO,
    ANALOG_IO,
    RESOLVER,
    PULSETACH,
    DRIVE_CONTROLLER,
    DRIVE_ANALOG,
    NETWORK,
    UDC,
)
"""All kinds of modules."""
SUPPORTED: dict[str, ModuleKind] = {model: kind for kind in KINDS for model in kind.models}
"""The kind of each number that a rack file may name."""

REFUSED = {
    "57C430": (
        "AMX6204",
        "the 57C430 Processor may not share a rack with the others and does not run this software",
        "the module that does is the 57C430A",
    ),
    "57C565": (
        "AMX6211",
        "the 57C565 is the Serial module of a PC3000: it is not a Processor and runs no tasks",
        "the Processor of a PC3000 is the 57C560, which a 57C570 has in it; a rack file names no Serial module",
    ),
}
"""Modules that no rack file may name: the problem's code, the error and the remedy (1.1, 1.3)."""
NOT_YET = {
    "57C414": "Modbus interface module",
    "57C416": "remote I/O module",
    "57C417": "R-Net module",
    "57C418": "A-B interface module",
}
"""Modules that exist but that are not emulated yet."""

_NUMBER = re.compile(r"(57C?[0-9]{3})[A-Z]?\Z")


def spellings(model: str) -> Schema:
    """Return the schema of a module's number, in all spellings that ``module_number`` accepts."""
    letters = "".join(f"[{char}{char.lower()}]" if char.isalpha() else char for char in model)
    revision = "" if model[-1].isalpha() else "[A-Za-z]?"
    text = f"The module's number: {model}, {SUPPORTED[model].models[model]}."
    numbers = [model, int(model)] if model.isdecimal() else [model]
    return either(text, words(text, numbers), named(text, f"^([Bb]/[Mm] *)?{letters}{revision}$"))


def module_number(text: str) -> str:
    """Return a module's number in the form of these tables: ``57c413b`` is 57C413, ``B/M 57552`` is 57552."""
    plain = text.upper().removeprefix("B/M").replace("-", "").strip()
    if plain in SUPPORTED:
        return plain
    match = _NUMBER.match(plain)
    return match.group(1) if match else plain
