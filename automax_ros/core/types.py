"""The five data types of the AutoMax languages (J-3676-5, 2.4.3)."""

from __future__ import annotations

import enum
import struct
from collections.abc import Sequence

from automax_ros.core.numbers import INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN, REAL_MAX

Value = int | float | bool | str
"""A value of a variable: int for INTEGER and DOUBLE, float for REAL, bool for BOOLEAN, str for STRING."""
Latched = tuple[Value, ...]
"""The commons that a scan latched, in the order of its plan (3.3)."""

NAME_LIMIT = 16
"""Longest variable name without its type character (2.4.1)."""
TASK_NAME_LIMIT = 8
"""Longest task name (2.4.1)."""
DEFAULT_STRING_LENGTH = 31
MAX_STRING_LENGTH = 255
MAX_DIMENSIONS = 4
MAX_SUBSCRIPT = 65534
"""Largest subscript that can be declared: a dimension has at most 65535 elements, the first is 0 (2.4.4)."""
MAX_ARRAY_ELEMENTS = 1_000_000
"""Most elements of one array (decision: a bound on memory for untrusted sources)."""


_DOUBLE = struct.Struct("<d")


class DataType(enum.Enum):
    """A data type; the value is its type character."""

    INTEGER = "%"
    DOUBLE = "!"
    REAL = ""
    BOOLEAN = "@"
    STRING = "$"

    @property
    def is_integer(self) -> bool:
        """INTEGER or DOUBLE."""
        return self is DataType.INTEGER or self is DataType.DOUBLE

    @property
    def is_numeric(self) -> bool:
        """INTEGER, DOUBLE or REAL."""
        return self.is_integer or self is DataType.REAL

    @property
    def word(self) -> str:
        """The manual's word for the type, for messages and YAML files."""
        return _WORDS[self]

    @property
    def zero(self) -> Value:
        """The value at installation (2.4.5)."""
        return _ZEROS[self]

    @property
    def range(self) -> tuple[int | float, int | float]:
        """The smallest and the largest value (2.4.2); 0 and 1 for a BOOLEAN, two zeros for a STRING."""
        return _RANGES[self]

    @property
    def number(self) -> int:
        """The number of the type in messages: ``Variable.type``."""
        return _NUMBERS[self]

    @classmethod
    def numbered(cls, number: int) -> DataType:
        """Return the type with a number in a message.

        Raises:
            ValueError: no type has the number.
        """
        for kind, known in _NUMBERS.items():
            if known == number:
                return kind
        raise ValueError(f"no data type has the number {number}")

    @property
    def latched(self) -> bool:
        """TRUE for the types whose simple commons a scan latches (3.3)."""
        return self is not DataType.REAL and self is not DataType.STRING


_WORDS = {
    DataType.INTEGER: "INTEGER",
    DataType.DOUBLE: "DOUBLE INTEGER",
    DataType.REAL: "REAL",
    DataType.BOOLEAN: "BOOLEAN",
    DataType.STRING: "STRING",
}
_ZEROS: dict[DataType, Value] = {
    DataType.INTEGER: 0,
    DataType.DOUBLE: 0,
    DataType.REAL: 0.0,
    DataType.BOOLEAN: False,
    DataType.STRING: "",
}
_RANGES: dict[DataType, tuple[int | float, int | float]] = {
    DataType.INTEGER: (INT16_MIN, INT16_MAX),
    DataType.DOUBLE: (INT32_MIN, INT32_MAX),
    DataType.REAL: (-REAL_MAX, REAL_MAX),
    DataType.BOOLEAN: (0, 1),
    DataType.STRING: (0, 0),
}
_NUMBERS = {kind: number for number, kind in enumerate(DataType, 1)}
_BY_SUFFIX = {kind.value: kind for kind in DataType if kind.value}


def type_of_name(name: str) -> DataType:
    """Return the data type for the last character of a variable's full name."""
    return _BY_SUFFIX.get(name[-1:], DataType.REAL)


def bare_name(name: str) -> str:
    """Return a variable's name without its type character."""
    return name[:-1] if name[-1:] in _BY_SUFFIX else name


def declaration_text(name: str, dimensions: Sequence[int] = (), length: int = 0) -> str:
    """Return a variable's declaration as in COMMON and rack files: ``TABLE%(10)``, ``NOTE$:8(3)``.

    ``dimensions`` are numbers of elements, ``length`` is a STRING's, 0 for other types.
    """
    maximum = f":{length}" if length not in (0, DEFAULT_STRING_LENGTH) else ""
    subscripts = f"({','.join(str(size - 1) for size in dimensions)})" if dimensions else ""
    return f"{name}{maximum}{subscripts}"


def same_bits(one: Value, other: Value) -> bool:
    """Return whether two values are the same to the last bit: -0.0 is not 0.0, and NaN is NaN."""
    if isinstance(one, float) and isinstance(other, float):
        return (one == other and one != 0.0) or _DOUBLE.pack(one) == _DOUBLE.pack(other)
    return one == other and type(one) is type(other)
