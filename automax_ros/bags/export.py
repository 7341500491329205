"""Common memory of a recording as a CSV table: one row for each instant at which a watched variable changed."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path

from automax_ros.bags.errors import BagError
from automax_ros.bags.messages import CommonImage, CommonWrite, Values, VariableTable, VariableType
from automax_ros.bags.reader import BagReader
from automax_ros.bags.variables import Watched, WatchError, checked_table, watched_by_default, watched_by_name
from automax_ros.core.decimal_text import real_text, seconds_text
from automax_ros.core.diagnostics import printable

_TYPES = frozenset(f"automax_msgs/msg/{name}" for name in ("CommonImage", "CommonWrite", "VariableTable"))
_SECOND = 1_000_000_000
_Cell = float | str | None


def export_csv(bag: Path, output: Path, watch: Sequence[str] | None = None) -> int:
    """Write the watched variables of a recording to a CSV file; return the number of rows below the header.

    Columns are ``time_s``, counted from the start of the run, and the variables with their type characters. A value
    holds until it changes; a cell is empty as long as the recording has not told the value. Booleans are 0 and 1.
    Without ``watch`` all simple numeric and boolean variables are taken; array elements are named like ``TABLE%(3)``.
    Memory does not grow with the recording.

    Raises:
        BagError: the recording cannot be read or has no common memory, a name in ``watch`` is unknown, or the output
            cannot be written.
    """
    _require_another_file(bag, output)
    rows = _rows(bag, BagReader(bag), watch)
    header = next(rows)
    count = 0
    try:
        with output.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(header)
            for row in rows:
                table.writerow(row)
                count += 1
    except OSError as error:
        raise BagError("AMX6824", output, f"cannot be written: {error.strerror or error}") from error
    return count


def _require_another_file(bag: Path, output: Path) -> None:
    """Refuse to write over the recording that is read."""
    own = [bag] if bag.is_file() else [*bag.glob("*.mcap*"), bag / "metadata.yaml"]
    for file in own:
        with contextlib.suppress(OSError):  # one of them does not exist
            if output.samefile(file):
                raise BagError("AMX6824", output, "belongs to the recording itself", "name another file")


def _rows(bag: Path, reader: BagReader, watch: Sequence[str] | None) -> Iterator[list[str]]:
    """The header, then the rows."""
    log = _CommonLog(bag)
    memory: _WatchedMemory | None = None
    for entry in reader.messages(types=_TYPES):
        message = entry.message
        if isinstance(message, VariableTable):
            if log.take_table(message):
                memory = _watched_memory(bag, message, watch)
                yield memory.header
            continue
        assert isinstance(message, (CommonImage, CommonWrite))
        if log.is_new(message) and memory is not None:
            row = memory.row_before(message.stamp)
            if row is not None:
                yield row
            _apply(bag, memory, message)
    if memory is None:
        raise BagError(
            "AMX6820",
            bag,
            "has no common memory: no table of variables (topic .../variables)",
            "record the topics /<rack>/variables, /<rack>/backplane and /<rack>/backplane/snapshot",
        )
    row = memory.last_row()
    if row is not None:
        yield row


def _apply(bag: Path, memory: _WatchedMemory, message: CommonImage | CommonWrite) -> None:
    try:
        memory.apply(message.values)
    except ValueError as error:
        raise BagError("AMX6813", bag, f"wrong values at {seconds_text(message.stamp)} s: {error}") from error


def _watched_memory(bag: Path, table: VariableTable, watch: Sequence[str] | None) -> _WatchedMemory:
    try:
        variables = checked_table(table)
    except ValueError as error:
        raise BagError("AMX6813", bag, f"the table of variables is wrong: {error}") from error
    try:
        watched = watched_by_default(variables) if watch is None else watched_by_name(variables, watch)
    except WatchError as error:
        raise BagError("AMX6821", bag, str(error), error.hint) from error
    strings = frozenset(entry.id for entry in variables.values() if entry.type == VariableType.STRING)
    return _WatchedMemory(watched, strings, table.stamp)


class _CommonLog:
    """Checks that the messages are the write log of one run of one rack, without gaps."""

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._table: VariableTable | None = None
        self._sequence: int | None = None

    def take_table(self, table: VariableTable) -> bool:
        """Return whether this is the first table of variables."""
        if self._table is None:
            self._table = table
            return True
        if (table.rack, table.run_id) != (self._table.rack, self._table.run_id):
            raise BagError(
                "AMX6822", self._bag, f"holds more than one run: of {self._table.rack[:40]} and {table.rack[:40]}"
            )
        return False

    def is_new(self, message: CommonImage | CommonWrite) -> bool:
        """Return whether a message tells something new: not one of another run, nor older than what was seen."""
        if self._table is None:
            hint = "record /<rack>/variables from the start"
            raise BagError("AMX6820", self._bag, "values stand before the table of variables", hint)
        if message.run_id != self._table.run_id:
            return False
        if self._sequence is not None:
            if message.sequence < self._sequence or (
                message.sequence == self._sequence and isinstance(message, CommonWrite)
            ):
                return False
            if message.sequence > self._sequence + 1 and isinstance(message, CommonWrite):
                raise self._gap(self._sequence + 1, message)
        self._sequence = message.sequence
        return True

    def _gap(self, first: int, message: CommonWrite) -> BagError:
        return BagError(
            "AMX6823",
            self._bag,
            f"writes {first} to {message.sequence - 1} are missing before {seconds_text(message.stamp)} s",
            "the recorder lost messages; `automax run --record` loses none",
        )


class _WatchedMemory:
    """The watched variables as the log has told them so far; ``origin`` is the instant at which the run began."""

    def __init__(self, watched: Sequence[Watched], strings: Collection[int], origin: int) -> None:
        self.header = ["time_s", *(item.label for item in watched)]
        self._origin = self._time = origin
        self._strings = strings
        self._columns = {(item.variable, item.element): index for index, item in enumerate(watched)}
        self._formats = [_FORMATS[item.kind] for item in watched]
        self._shown: list[_Cell] = [None] * len(watched)
        self._cells = [""] * len(watched)
        self._changes: dict[int, _Cell] = {}

    def row_before(self, time: int) -> list[str] | None:
        """Go on to an instant; return the row of the one that is over, None if it brought nothing new."""
        row = None if time == self._time else self.last_row()
        self._time = time
        return row

    def last_row(self) -> list[str] | None:
        """Return the row of the instant, None if nothing in it differs from the row before."""
        differs = False
        for index, value in self._changes.items():
            if value != self._shown[index]:
                self._shown[index] = value
                self._cells[index] = self._formats[index](value)
                differs = True
        self._changes.clear()
        return [seconds_text(max(0, self._time - self._origin)), *self._cells] if differs else None

    def apply(self, values: Values) -> None:
        """Take over the values of one message.

        Raises:
            ValueError: its lists do not fit together.
        """
        if not len(values.variable) == len(values.element) == len(values.value):
            raise ValueError("lists of different length")
        texts = iter(values.text)
        for variable, element, number in zip(values.variable, values.element, values.value, strict=True):
            value: _Cell = number
            if variable in self._strings:
                value = next(texts, None)
                if value is None:
                    raise ValueError("a string variable without its text")
            index = self._columns.get((variable, element))
            if index is not None:
                self._changes[index] = value


def _whole(value: _Cell) -> str:
    return f"{value:.0f}"


def _real(value: _Cell) -> str:
    assert isinstance(value, float)
    return real_text(value)


def _text(value: _Cell) -> str:
    return printable(str(value))


_FORMATS: dict[VariableType, Callable[[_Cell], str]] = {
    VariableType.INTEGER: _whole,
    VariableType.DOUBLE_INTEGER: _whole,
    VariableType.REAL: _real,
    VariableType.BOOLEAN: _whole,
    VariableType.STRING: _text,
}
