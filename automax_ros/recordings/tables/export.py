"""Export of recordings to CSV tables, and the columns and rows that all table formats share."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from automax_ros.core.safe_file import atomic_write, open_at_once
from automax_ros.core.text import printable
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType
from automax_ros.core.values import real_text
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Cell
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Series, Window


@dataclass(frozen=True)
class Column:
    """A column: its heading, its engineering unit, the type code of its numbers, the function that formats a cell.

    The type code is that of ``array``; it is empty for texts.
    """

    label: str
    unit: str
    typecode: str
    text: Callable[[Cell], str]


class Table(Protocol):
    """A table to export; a row is a time in ns and the cells that differ from the row before, None for unknown."""

    @property
    def columns(self) -> Sequence[Column]:
        """The columns after the time."""

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """The rows, to be read once."""


def column(label: str, kind: DataType, unit: str = "") -> Column:
    """Return the column of a variable."""
    return Column(label, unit, _TYPECODES[kind], _TEXTS[kind])


def count_column(label: str, unit: str = "") -> Column:
    """Return a column of integers that may need more than 32 bits."""
    return Column(label, unit, "q", _whole)


def require_another_file(bag: Path, output: Path) -> None:
    """Refuse to overwrite the recording that is read.

    Raises:
        BagError: the output is one of the recording's files.
    """
    own = [bag] if bag.is_file() else [*bag.glob("*.mcap*"), bag / "metadata.yaml"]
    for file in own:
        with contextlib.suppress(OSError):  # one of them does not exist
            if output.samefile(file):
                raise BagError("AMX6824", output, "belongs to the recording itself", "name another file")


@contextlib.contextmanager
def whole_output(output: Path) -> Iterator[Path]:
    """Yield the path of an output to write to; it appears only when it is complete (``atomic_write``).

    Raises:
        BagError: it cannot be written.
    """
    try:
        with atomic_write(output) as place:
            yield place
    except OSError as error:
        raise BagError("AMX6824", output, f"cannot be written: {error.strerror or error}") from error


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


TIME = "time_s"
"""Heading of the column of times, which count from the start of the run."""


class CommonTable:
    """Common memory as a table: a row for each instant at which a watched variable changed, or of the window's grid.

    A value holds until it changes. Without ``watch`` all simple numeric and boolean variables are watched.

    Raises:
        BagError: the recording cannot be read or has no common memory, or a name in ``watch`` is unknown.
    """

    def __init__(
        self,
        bag: Path,
        watch: Sequence[str] | None = None,
        window: Window = WHOLE_RUN,
        progress: Progress | None = None,
    ) -> None:
        self._series = Series(bag, watch, window, progress)
        self.columns: Sequence[Column] = [column(item.label, item.kind, item.unit) for item in self._series.columns]

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """Return the rows: time, and the cells that differ from the row before.

        Raises:
            BagError: the recording is damaged, or the window is empty.
        """
        yield from self._series.changes()


def write_csv(table: Table, output: Path) -> int:
    """Write a table to a CSV file, which appears only when it is complete; return the number of rows below the header.

    Columns are ``time_s``, counted from the start of the run, and those of the table. A value holds until it changes; a
    cell is empty while it is unknown. Booleans are 0 and 1. Memory use does not grow with the recording.

    Raises:
        BagError: the recording is damaged, or the output cannot be written.
    """
    formats = [item.text for item in table.columns]
    cells = [""] * len(formats)
    count = 0
    with whole_output(output) as place, open(place, "w", encoding="utf-8", newline="", opener=open_at_once) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([TIME, *(item.label for item in table.columns)])
        for time, changed in table.rows():
            for index, value in changed.items():
                cells[index] = "" if value is None else formats[index](value)
            writer.writerow([seconds_text(time), *cells])
            count += 1
    return count
