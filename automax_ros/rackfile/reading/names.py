"""Names of the rack file: rack, tasks, and common variables with type, length and subscripts (2.4.1 to 2.4.4).

Words that cannot name a common variable, since no task could use it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from automax_ros.core.faults import UserError
from automax_ros.core.types import (
    DEFAULT_STRING_LENGTH,
    MAX_ARRAY_ELEMENTS,
    MAX_DIMENSIONS,
    MAX_STRING_LENGTH,
    MAX_SUBSCRIPT,
    NAME_LIMIT,
    TASK_NAME_LIMIT,
    DataType,
    type_of_name,
)
from automax_ros.language.text.tokens import RESERVED_WORDS
from automax_ros.language.tree.functions import FUNCTIONS, REFUSED_FUNCTIONS

_RACK = re.compile(r"[A-Z0-9]{1,8}\Z")
RACK_NAME = "^[A-Za-z0-9]{1,8}$"
TASK_NAME = f"^[A-Za-z][A-Za-z0-9_]{{0,{TASK_NAME_LIMIT - 1}}}$"
COMMON_NAME = f"^[A-Za-z_][A-Za-z0-9_]{{0,{NAME_LIMIT - 1}}}([%!@]|\\$(:[0-9]{{1,3}})?)?\\s*([(\\[][0-9, ]*[)\\]])?$"
"""The same as patterns of a JSON schema, in lower case too: the reader says so and goes on."""
_TASK = re.compile(r"[A-Z][A-Z0-9_]*\Z")
_BARE = re.compile(r"[A-Z_][A-Z0-9_]*\Z")
_DECLARATION = re.compile(
    r"(?P<name>[^%!@$:()\[\]\s]*)(?P<type>[%!@$]?)(?::(?P<length>[^()\[\]\s]*))?\s*"
    r"(?:\((?P<round>[^()\[\]]*)\)|\[(?P<square>[^()\[\]]*)\])?\Z"
)
_SIZE = re.compile(r"[0-9]{1,9}\Z")


class DeclarationFault(UserError):
    """A name breaks a rule; ``code`` is the problem's."""

    def __init__(self, code: str, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint, code=code)


@dataclass(frozen=True)
class VariableName:
    """A variable as a key of ``common`` declares it; ``dimensions`` are numbers of elements."""

    name: str
    type: DataType
    length: int
    dimensions: tuple[int, ...]


def is_rack_name(text: str) -> bool:
    """Whether a text is a rack's name: 1 to 8 letters and digits (J2-3045 p. 5-23)."""
    return _RACK.match(text) is not None


def check_task_name(text: str) -> None:
    """Check a task's name in upper case.

    Raises:
        DeclarationFault: AMX6300, not 1 to 8 letters, digits and underscores, the first a letter (2.4.1).
    """
    if not _TASK.match(text):
        raise DeclarationFault("AMX6300", "a task's name has letters, digits and underscores, and begins with a letter")
    if len(text) > TASK_NAME_LIMIT:
        raise DeclarationFault(
            "AMX6300", f"a task's name has at most {TASK_NAME_LIMIT} characters, this one {len(text)}"
        )


def variable_name(text: str) -> VariableName:
    """Return what a key of ``common`` in upper case declares: ``A%``, ``TABLE%(10)``, ``MESSAGE$:50(3)``.

    Raises:
        DeclarationFault: AMX6400 not a name, AMX6404 subscripts, AMX6405 length of a string.
    """
    match = _DECLARATION.match(text)
    if not match:
        raise DeclarationFault(
            "AMX6400", "not a variable's name", "write NAME%, NAME!, NAME@, NAME$ or NAME, then (10) for an array"
        )
    bare = match["name"]
    if not _BARE.match(bare):
        raise DeclarationFault("AMX6400", "a variable's name has letters, digits and underscores, and no digit first")
    if len(bare) > NAME_LIMIT:
        message = f"a variable's name has at most {NAME_LIMIT} characters before its type, this one {len(bare)}"
        raise DeclarationFault("AMX6400", message)
    kind = type_of_name(bare + match["type"])
    subscripts = match["round"] if match["round"] is not None else match["square"]
    length = _length(kind, match["length"])
    return VariableName(bare + match["type"], kind, length, _dimensions(subscripts))


def _length(kind: DataType, text: str | None) -> int:
    if kind is not DataType.STRING:
        if text is not None:
            raise DeclarationFault(
                "AMX6405", f"only a string has a length, not a {kind.word}", "a string's name ends in $"
            )
        return 0
    if text is None:
        return DEFAULT_STRING_LENGTH
    if not _SIZE.match(text) or not 1 <= int(text) <= MAX_STRING_LENGTH:
        raise DeclarationFault("AMX6405", f"the length of a string is 1 to {MAX_STRING_LENGTH}")
    return int(text)


def _dimensions(text: str | None) -> tuple[int, ...]:
    if text is None:
        return ()
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > MAX_DIMENSIONS:
        raise DeclarationFault("AMX6404", f"an array has at most {MAX_DIMENSIONS} subscripts, this one {len(parts)}")
    sizes: list[int] = []
    elements = 1
    for part in parts:
        if not _SIZE.match(part) or int(part) > MAX_SUBSCRIPT:
            raise DeclarationFault(
                "AMX6404", f"the largest subscript of an array is a whole number from 0 to {MAX_SUBSCRIPT}"
            )
        sizes.append(int(part) + 1)
        elements *= int(part) + 1
    if elements > MAX_ARRAY_ELEMENTS:
        raise DeclarationFault(
            "AMX6404", f"the array has {elements} elements; at most {MAX_ARRAY_ELEMENTS} are possible"
        )
    return tuple(sizes)


def is_reserved(name: str) -> bool:
    """Whether a variable's name with its type character is a word or a function of the language."""
    return name in RESERVED_WORDS or name in FUNCTIONS or name in REFUSED_FUNCTIONS
