"""The CSV table that ``automax trace`` reads: a header with names of variables, then a row a scan, one line each.

The table is read line by line, so that one of millions of rows takes no more memory than one of ten.
"""

from __future__ import annotations

import codecs
import csv
import os
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType

from automax_ros.cli.lone_task import LoneTask, LoneVariable, UnknownVariableError
from automax_ros.cli.usage import UsageError
from automax_ros.core.decimal_text import real_text
from automax_ros.core.diagnostics import printable
from automax_ros.core.types import DataType, Value
from automax_ros.language.constant_values import range_text
from automax_ros.language.program import Symbol
from automax_ros.rack.findings import quoted

MAX_LINE = 1_000_000
"""Longest line of a table, in bytes (decision: a bound on memory for untrusted files)."""

_WHOLE = re.compile(r"([-+]?[0-9]{1,40})(\.0{0,40})?")
"""A whole number; spreadsheets write 100.0 into columns with empty cells."""
_DECIMAL = re.compile(r"[-+]?([0-9]{1,60}(\.[0-9]{0,60})?|\.[0-9]{1,60})([eE][-+]?[0-9]{1,4})?")
_TRUTH = {"0": False, "FALSE": False, "OFF": False, "0.0": False, "1": True, "TRUE": True, "ON": True, "1.0": True}


class CsvFault(Exception):
    """Something is wrong with a table: ``code`` AMX6910 to AMX6916, the line from 1, and what to do if known."""

    def __init__(self, code: str, line: int, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.line = line
        self.hint = hint

    def render(self, path: Path) -> str:
        """Return the fault as the person reads it."""
        text = f"{path}:{self.line}: error[{self.code}]: {self}"
        return f"{text}\n  hint: {self.hint}" if self.hint else text


class InputTable(AbstractContextManager["InputTable"]):
    """An open table. ``columns`` are the variables that the header names, in its order."""

    def __init__(self, path: Path, task: LoneTask) -> None:
        """Open a table and read its header.

        Raises:
            UsageError: the file cannot be read.
            CsvFault: the header is at fault.
        """
        self._path = path
        self._line = 0
        try:
            self._stream = path.open("rb")
        except (OSError, ValueError) as error:
            raise UsageError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from error
        try:
            self.columns = self._header(task)
        except BaseException:
            self._stream.close()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._stream.close()

    @property
    def size(self) -> int:
        """Bytes of the whole table; 0 where that is not known beforehand."""
        return os.fstat(self._stream.fileno()).st_size

    @property
    def position(self) -> int:
        """Bytes that were read so far."""
        return self._stream.tell() if self._stream.seekable() else 0

    def rows(self) -> Iterator[int]:
        """Set the variables to each row's cells in turn, and yield the row's line.

        A row has as many cells as the header; an empty cell leaves its variable as it is. Empty lines at the end are no
        rows; in a table of one column an empty line before is a row with an empty cell.

        Raises:
            UsageError: the file cannot be read any more.
            CsvFault: a row is at fault.
        """
        last_row = self._line
        while (cells := self._next_line()) is not None:
            if not cells:
                continue
            yield from self._empty_rows(range(last_row + 1, self._line))
            last_row = self._line
            self._set(cells)
            yield self._line

    def _empty_rows(self, lines: range) -> range:
        """Return the empty lines between two rows, as rows."""
        if lines and len(self.columns) > 1:
            raise CsvFault(
                "AMX6914", lines[0], "the line is empty, and rows follow", "write the commas of an empty row"
            )
        return lines

    def _set(self, cells: list[str]) -> None:
        if len(cells) != len(self.columns):
            message = f"the row has {len(cells)} cells, the header {len(self.columns)}"
            raise CsvFault("AMX6914", self._line, message)
        for variable, cell in zip(self.columns, cells, strict=True):
            if cell:
                self._set_one(variable, cell)

    def _set_one(self, variable: LoneVariable, cell: str) -> None:
        symbol = variable.symbol
        text = cell if symbol.type is DataType.STRING else cell.strip()
        if not text:
            return
        value = cell_value(text, symbol.type)
        try:
            if value is None:
                raise ValueError
            variable.write(value)
        except ValueError:
            tuned = symbol.tuning is not None and value is not None
            message = f"{variable.label} = {quoted(text, marks='')}, it must be {_wanted(symbol, tuned=tuned)}"
            raise CsvFault("AMX6916" if tuned else "AMX6915", self._line, message) from None

    def _header(self, task: LoneTask) -> list[LoneVariable]:
        names = self._next_line()
        if not names:
            raise CsvFault("AMX6910", 1, "the first line must name the variables", "such as REF%,RUN@")
        columns: dict[str, LoneVariable] = {}
        for name in names:
            try:
                variable = task.variable(name)
            except UnknownVariableError as fault:
                raise CsvFault(fault.code, 1, str(fault), fault.hint) from fault
            if variable.label in columns:
                raise CsvFault("AMX6912", 1, f"there are two columns for {variable.label}")
            columns[variable.label] = variable
        return list(columns.values())

    def _next_line(self) -> list[str] | None:
        """Return the cells of the next line, [] for an empty one, None at the end."""
        try:
            line = self._stream.readline(MAX_LINE + 1)
        except OSError as error:
            raise UsageError(f"{self._path} cannot be read: {error.strerror or error}") from error
        if not line:
            return None
        self._line += 1
        if len(line) > MAX_LINE:
            raise CsvFault("AMX6910", self._line, f"the line has more than {MAX_LINE} bytes")
        if self._line == 1:
            line = line.removeprefix(codecs.BOM_UTF8)
        return self._cells(line)

    def _cells(self, line: bytes) -> list[str]:
        try:
            text = line.decode().rstrip("\r\n")
        except UnicodeDecodeError as error:
            message = f"the table is not UTF-8: here is a byte {line[error.start]:#04x}"
            raise CsvFault("AMX6910", self._line, message, "save the table as UTF-8") from error
        if not text.strip():
            return []
        try:
            if "\0" in text:
                raise csv.Error("a NUL character")
            return next(csv.reader((text,), strict=True, skipinitialspace=True))
        except csv.Error as error:
            hint = "a cell with quotes begins and ends with them on one line"
            raise CsvFault("AMX6910", self._line, f"not CSV: {printable(str(error))}", hint) from error


def cell_value(text: str, kind: DataType) -> Value | None:
    """Return what a cell that is not empty says for a variable of a type, None if it says nothing for it."""
    if kind is DataType.STRING:
        return text
    if kind is DataType.BOOLEAN:
        return _TRUTH.get(text.upper()) if len(text) <= 5 else None
    if kind is DataType.REAL:
        return float(text) if _DECIMAL.fullmatch(text) else None
    match = _WHOLE.fullmatch(text)
    return int(match[1]) if match else None


def _wanted(symbol: Symbol, *, tuned: bool) -> str:
    """Return in words what a variable takes; ``tuned`` where its tuning limits are what matters."""
    if tuned and symbol.tuning is not None:
        return f"inside its tuning limits, {_number(symbol.tuning.low)} to {_number(symbol.tuning.high)}"
    if symbol.type is DataType.STRING:
        return f"a text of at most {symbol.length} characters"
    if symbol.type is DataType.BOOLEAN:
        return "0 or 1"
    return f"a {'whole ' if symbol.type.is_integer else ''}number from {range_text(symbol.type)}"


def _number(value: Value) -> str:
    return real_text(value) if isinstance(value, float) else str(value)
