"""The CSV table that ``automax trace`` reads: its header names variables of the task, each row sets them for a scan."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from automax_ros.cli.csv_table import CsvTable
from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.core.values import is_number, value_of, value_text, wanted
from automax_ros.language.program import Symbol
from automax_ros.running.lone_task import LoneTask, LoneVariable

_NOT_SET = ("scan", "time_s")
"""Columns that tables of ``trace`` and ``export`` have: a row is a scan whatever they say."""


class InputTable(CsvTable):
    """An open table. ``columns`` are the variables that the header names, in its order; None is not looked at."""

    def __init__(self, path: Path, task: LoneTask) -> None:
        """Open a table and read its header.

        Raises:
            UsageError: the file cannot be read.
            CsvFault: the header is at fault.
        """
        super().__init__(path)
        try:
            self.columns = self._columns(task)
        except BaseException:
            self.close()
            raise

    def rows(self) -> Iterator[int]:
        """Set the variables to each row's cells in turn, and yield the row's line.

        An empty cell leaves its variable as it is.

        Raises:
            UsageError: the file cannot be read any more.
            CsvFault: a row is at fault.
        """
        for line, cells in self.numbered_rows():
            for variable, cell in zip(self.columns, cells, strict=True):
                if cell and variable is not None:
                    self._set(variable, self._decimal(cell, variable), line)
            yield line

    def _decimal(self, cell: str, variable: LoneVariable) -> str:
        """Return a cell with a decimal point, where the table may have a comma."""
        return cell.replace(",", ".") if self.separator == ";" and variable.symbol.type is DataType.REAL else cell

    def _columns(self, task: LoneTask) -> list[LoneVariable | None]:
        columns: dict[str, LoneVariable | None] = {}
        for name in self.header:
            try:
                variable = task.variable(name)
            except NameFault as fault:
                if name.strip() in _NOT_SET and name not in columns:
                    columns[name] = None
                    continue
                code = "AMX6911" if isinstance(fault, UnknownName) else "AMX6913"
                out = "take the column out where the task has no such variable"
                hint = f"{fault.hint}; {out}" if fault.hint else out
                raise self.fault(code, fault.message, _header_hint(name) or hint) from fault
            if variable.label in columns:
                raise self.fault("AMX6912", f"there are two columns for {variable.label}")
            columns[variable.label] = variable
        return list(columns.values())

    def _set(self, variable: LoneVariable, cell: str, line: int) -> None:
        """Set a variable to what a cell says, on a line of the table."""
        symbol = variable.symbol
        text = cell if symbol.type is DataType.STRING else cell.strip()
        if not text:
            return
        value = value_of(text, symbol.type, symbol.length)
        try:
            if value is None:
                raise ValueError
            variable.write(value)
        except ValueError:
            tuned = symbol.tuning is not None and is_number(text)
            message = f"{variable.label} = {quoted(text, marks='')}, it must be {_wanted(symbol, tuned=tuned)}"
            raise self.fault("AMX6916" if tuned else "AMX6915", message, line=line) from None


def _wanted(symbol: Symbol, *, tuned: bool) -> str:
    """Return in words what a variable takes; ``tuned`` where its tuning limits are what matters."""
    if tuned and symbol.tuning is not None:
        return f"inside its tuning limits, {value_text(symbol.tuning.low)} to {value_text(symbol.tuning.high)}"
    return wanted(symbol.type, symbol.length)


def _header_hint(name: str) -> str | None:
    if "(" in name and ")" not in name:
        return 'a name with several subscripts needs quotes in a CSV table: "TABLE%(1,2)"'
    return "columns are separated by commas or semicolons" if "\t" in name else None
