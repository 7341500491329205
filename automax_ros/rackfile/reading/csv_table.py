"""A CSV table: a header with names of columns, then rows; and the times of its rows.

The table is read line by line, so that one of millions of rows takes no more memory than one of ten.
"""

from __future__ import annotations

import codecs
import csv
import os
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from automax_ros.core.text import printable, quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.core.values import is_number
from automax_ros.rackfile.reading.files import open_regular

MAX_LINE = 1_000_000
"""Longest line of a CSV table, in bytes (decision: a bound on memory for untrusted files)."""
TIME = "time_s"
"""The usual name of the column with the times of rows, s."""
_LATEST_S = 10**10
"""Greatest time in a table; times of day, counted from 1970 on, are below it, s."""
_LONGEST_NS = 10**6 * NS_PER_S
"""A table lasts at most 11 days (decision): a longer one probably has ms instead of s."""

_SIGNS = {".": "dot", ",": "comma"}
NO_VALUE = "leave the cell empty where there is no value"
"""Hint for a cell with a word, as historians write it where they have no value."""
ONE_SIGN = "write one of both throughout, and nothing between thousands"
"""Hint for a table with two decimal signs."""
TIMES = "seconds, not dates: docs/howto/week.md turns dates into seconds"
"""Hint for a time that is none."""

_Table = TypeVar("_Table", bound="CsvTable")


class CsvFault(UserError):
    """An error in a table: ``code`` AMX6910 to AMX6916; ``place`` is the file and the line."""


class CsvTable:
    """An open table, closed at the end of a ``with``. ``header`` has the cells of its first line, at least one.

    Cells are separated by commas, or by semicolons where the header has one (decision: no variable's name has):
    spreadsheets write semicolons where the decimal point is a comma.
    """

    names = ("variables", "REF%,RUN@")
    """What the header names, and an example."""

    def __init__(self, path: Path, *, regular: bool = False) -> None:
        """Open a table and read its header; with ``regular`` pipes and devices are refused.

        Raises:
            UsageError: the file cannot be read.
            CsvFault: the header is not a line of CSV.
        """
        self.path = path
        self.separator = ","
        self._line = 0
        self._sign: tuple[str, int] | None = None
        try:
            self._stream = open_regular(path) if regular else path.open("rb")
        except (OSError, ValueError) as error:
            raise UsageError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from error
        try:
            self.header = self._header()
        except BaseException:
            self.close()
            raise

    def __enter__(self: _Table) -> _Table:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    @property
    def size(self) -> int:
        """Size of the whole table in bytes; 0 where it is not known beforehand."""
        return os.fstat(self._stream.fileno()).st_size

    @property
    def position(self) -> int:
        """Number of bytes read so far."""
        return self._stream.tell() if self._stream.seekable() else 0

    def fault(self, code: str, message: str, hint: str | None = None, line: int | None = None) -> CsvFault:
        """Return a fault of a line, by default of the one that was read last."""
        return CsvFault(message, hint, code=code, place=f"{self.path}:{line or self._line or 1}")

    def decimal(self, cell: str, line: int) -> str:
        """Return the number of a cell with a decimal point; in a table with semicolons a comma is understood.

        The first such sign in a table's values decides: where a comma is the decimal sign, a dot may stand between
        thousands, and 1.500 is no longer clear (decision).

        Raises:
            ValueError: an earlier cell has the other sign.
        """
        text = cell.strip()
        sign = next((item for item in text if item in _SIGNS), None)
        if self.separator != ";" or sign is None or not is_number(text.replace(",", ".")):
            return cell
        before, first = self._sign = self._sign or (sign, line)
        if sign != before:
            raise ValueError(f"the decimal sign is a {_SIGNS[before]} in line {first}, and here a {_SIGNS[sign]}")
        return cell.replace(",", ".")

    def numbered_rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield each row's line number and its cells, as many as the header has.

        Empty lines at the end are not rows; in a table of one column, earlier ones are rows with an empty cell.

        Raises:
            UsageError: the file can no longer be read.
            CsvFault: a row is wrong.
        """
        last_row = self._line
        while (cells := self._next_line()) is not None:
            if not cells:
                continue
            for line in self._empty_rows(range(last_row + 1, self._line)):
                yield line, [""]
            last_row = self._line
            if len(cells) != len(self.header):
                message = f"the row has {len(cells)} cells, the header {len(self.header)}"
                raise self.fault("AMX6914", message)
            yield self._line, cells

    def _empty_rows(self, lines: range) -> range:
        """Return the empty lines between two rows, which are rows in a table of one column."""
        if lines and len(self.header) > 1:
            raise self.fault(
                "AMX6914",
                "the line is empty, and rows follow",
                f"write every {self.separator} of an empty row",
                lines[0],
            )
        return lines

    def _header(self) -> list[str]:
        names = self._next_line()
        if not names:
            what, example = self.names
            raise self.fault("AMX6910", f"the first line must name the {what}", f"such as {example}")
        return names

    def _next_line(self) -> list[str] | None:
        try:
            line = self._stream.readline(MAX_LINE + 1)
        except OSError as error:
            raise UsageError(f"{self.path} cannot be read: {error.strerror or error}") from error
        if not line:
            return None
        self._line += 1
        if len(line) > MAX_LINE:
            raise self.fault("AMX6910", f"the line has more than {MAX_LINE} bytes")
        if self._line == 1:
            line = line.removeprefix(codecs.BOM_UTF8)
        return self._cells(line)

    def _cells(self, line: bytes) -> list[str]:
        try:
            text = line.decode().rstrip("\r\n")
        except UnicodeDecodeError as error:
            message = f"the table is not UTF-8: here is a byte {line[error.start]:#04x}"
            raise self.fault("AMX6910", message, "save the table as UTF-8") from error
        if not text.strip():
            return []
        if self._line == 1 and ";" in text:
            self.separator = ";"
        try:
            if "\0" in text:
                raise csv.Error("a NUL character")
            return next(csv.reader((text,), delimiter=self.separator, strict=True, skipinitialspace=True))
        except csv.Error as error:
            hint = "a cell with quotes begins and ends with them on one line"
            raise self.fault("AMX6910", f"not CSV: {printable(str(error))}", hint) from error


class RowTimes:
    """The times of a table's rows, counted from that of the first one; ``column`` is the name of their column."""

    def __init__(self, column: str = TIME) -> None:
        self._column = column
        self._first_ns: int | None = None
        self._before_ns = 0

    def since_first(self, cell: str) -> int:
        """Return the time of the next row, ns after that of the first; a decimal comma is understood.

        Raises:
            ValueError: the cell is not a time in s, is earlier than the row before, or days after the first row.
        """
        text = cell.strip().replace(",", ".")
        if not is_number(text) or not 0 <= (seconds := Decimal(text)) <= _LATEST_S:
            raise ValueError(f"{self._column} = {quoted(cell, marks='')}, it must be a time in s, 0 or more")
        time_ns = int(seconds * NS_PER_S)
        if self._first_ns is None:
            self._first_ns = self._before_ns = time_ns
        if time_ns < self._before_ns:
            raise ValueError(f"{quoted(cell, marks='')} s is earlier than the row before")
        if time_ns - self._first_ns > _LONGEST_NS:
            raise ValueError(f"{quoted(cell, marks='')} s is days after the first row")
        self._before_ns = time_ns
        return time_ns - self._first_ns
