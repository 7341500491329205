"""Columns of the tables that a recording is exported to, and what is common to all formats of tables."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from automax_ros.bags.common_log import Cell
from automax_ros.bags.errors import BagError
from automax_ros.core.text import printable
from automax_ros.core.types import DataType
from automax_ros.core.values import real_text


@dataclass(frozen=True)
class Column:
    """A column: its heading, the engineer's unit, the type code of its numbers, how a cell is written.

    The type code is that of ``array``; texts have an empty one.
    """

    label: str
    unit: str
    typecode: str
    text: Callable[[Cell], str]


class Table(Protocol):
    """What can be exported: rows of a time in ns and the cells that differ from the row before, None for unknown."""

    @property
    def columns(self) -> Sequence[Column]:
        """The columns after the time."""

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """The rows, to be read once."""


def column(label: str, kind: DataType, unit: str = "") -> Column:
    """Return the column of a variable."""
    return Column(label, unit, _TYPECODES[kind], _TEXTS[kind])


def count_column(label: str, unit: str = "") -> Column:
    """Return a column of numbers that may pass 32 bits."""
    return Column(label, unit, "q", _whole)


def require_another_file(bag: Path, output: Path) -> None:
    """Refuse to write over the recording that is read.

    Raises:
        BagError: the output is one of its files.
    """
    own = [bag] if bag.is_file() else [*bag.glob("*.mcap*"), bag / "metadata.yaml"]
    for file in own:
        with contextlib.suppress(OSError):  # one of them does not exist
            if output.samefile(file):
                raise BagError("AMX6824", output, "belongs to the recording itself", "name another file")


def unwritable(output: Path, error: OSError) -> BagError:
    """Return the error that says why an output cannot be written."""
    return BagError("AMX6824", output, f"cannot be written: {error.strerror or error}")


def _whole(value: Cell) -> str:
    return f"{value:.0f}"


def _real(value: Cell) -> str:
    assert isinstance(value, float)
    return real_text(value)


def _text(value: Cell) -> str:
    return printable(str(value))


_TEXTS: dict[DataType, Callable[[Cell], str]] = {
    DataType.INTEGER: _whole,
    DataType.DOUBLE: _whole,
    DataType.REAL: _real,
    DataType.BOOLEAN: _whole,
    DataType.STRING: _text,
}
_TYPECODES: dict[DataType, str] = {
    DataType.INTEGER: "i",
    DataType.DOUBLE: "i",
    DataType.REAL: "d",
    DataType.BOOLEAN: "b",
    DataType.STRING: "",
}
