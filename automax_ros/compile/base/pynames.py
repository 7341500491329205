"""Names in generated code: readable and without collisions.

A BASIC variable gets its name with the letter of its type; the names of generated helpers are in lower case.
"""

from __future__ import annotations

from automax_ros.core.types import DataType, bare_name, type_of_name

_LETTERS = {
    DataType.INTEGER: "i",
    DataType.DOUBLE: "d",
    DataType.REAL: "r",
    DataType.BOOLEAN: "b",
    DataType.STRING: "s",
}


def variable_name(full_name: str) -> str:
    """Return the Python name of a variable: ``SPEED_REF%`` is ``SPEED_REF_i``."""
    return f"{bare_name(full_name)}_{_LETTERS[type_of_name(full_name)]}"


def latched_name(full_name: str) -> str:
    """Return the Python name of a latched value, with which END compares."""
    return f"latched_{variable_name(full_name)}"


def forced_name(full_name: str) -> str:
    """Return the Python name of the flag that says whether a force holds a variable."""
    return f"forced_{variable_name(full_name)}"


def block_prefix(line: int, occurrence: int) -> str:
    """Return the prefix of the names of a block's locals; ``occurrence`` counts the calls of one line from 0."""
    return f"b{line}_" if occurrence == 0 else f"b{line}_{occurrence + 1}_"


def structure_prefix(full_name: str) -> str:
    """Return the prefix of the names of a data structure's states: ``QUEUE%`` gives ``QUEUE_i_``."""
    return f"{variable_name(full_name)}_"
