"""The write log of common memory in a recording: one run of one rack, its values in their variables' types.

Also the recording's table of common variables, the choice of variables by name, and the check for missing writes by
their numbers, which recorders use, too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.names import element
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.messages.types.messages import CommonImage, CommonWrite, Values, Variable, VariableTable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import ORDER_HINT
from automax_ros.recordings.read.run_facts import RunFacts
from automax_ros.runtime.scan.channels import CHANNEL_VIEWS
from automax_ros.runtime.scan.drive_record import COMMAND_NUMBERS, COMMAND_VIEW, MEASURED_NUMBERS, MEASURED_VIEW

_NAME = re.compile(r"[A-Z_][A-Z0-9_]{0,63}[%!@$]?|SLOT:[0-9]{1,2}%")


@dataclass(frozen=True)
class Watched:
    """One column of an export: a simple variable, or the element of an array at a flat index; its engineering unit."""

    label: str
    variable: int
    element: int
    kind: DataType
    unit: str = ""


def checked_table(table: VariableTable) -> dict[str, Variable]:
    """Return the variables of a table by name.

    Raises:
        ValueError: an entry is not one that a rack writes.
    """
    by_name: dict[str, Variable] = {}
    for entry in table.variables:
        if not _NAME.fullmatch(entry.name):
            raise ValueError(f"variable {entry.id} is named {entry.name[:80]!r}")
        if entry.name in by_name:
            raise ValueError(f"variable {entry.name} is listed twice")
        DataType.numbered(entry.type)
        by_name[entry.name] = entry
    if len({entry.id for entry in by_name.values()}) < len(by_name):
        raise ValueError("two variables have the same number")
    return by_name


def watched_by_default(variables: dict[str, Variable]) -> list[Watched]:
    """Return all simple numeric and boolean variables, in the order of the table."""
    return [
        Watched(name, entry.id, 0, DataType.numbered(entry.type), entry.unit)
        for name, entry in variables.items()
        if not entry.dimensions and entry.type != DataType.STRING.number
    ]


def watched_by_name(variables: dict[str, Variable], names: Sequence[str]) -> list[Watched]:
    """Return the requested variables and array elements, such as ``REF%`` and ``TABLE%(3)``, each once.

    Raises:
        NameFault: there is no such variable or element.
    """
    found = (element(name, variables, "the recording has no common variable") for name in names)
    columns = {
        item.label: Watched(
            item.label, item.variable.id, item.index, DataType.numbered(item.variable.type), item.variable.unit
        )
        for item in found
    }
    return list(columns.values())


class WriteLog:
    """Follows the write log of a run. ``sequence`` is the number of the last known write, None before the first."""

    def __init__(self, run_id: int) -> None:
        self.run_id = run_id
        self.sequence: int | None = None

    def missing(self, sequence: int, *, image: bool) -> int:
        """Return how many writes are missing before a message, negative if its contents are known already.

        An image includes the write whose number it has; a write has the number after the previous one.
        """
        if self.sequence is None:
            return 0
        return sequence - self.sequence - (0 if image else 1)


Key = tuple[int, int]
"""A value of common memory: number of the variable, flat index of the element."""
Entry = tuple[int, int, Value]
"""Variable, element, value."""
Cell = Value
"""A value in a table."""


_Kind = tuple[Callable[[float], Value] | None, float, float, int, str]
"""A variable's conversion of values, its least and greatest value, its number of elements, its name."""
_CHANNEL_NUMBERS = 256
MOST_GAPS = 100


class CommonLog:
    """Reads the messages of the write log of one run; those of another run, or known already, are ignored.

    Missing writes are an error here unless an image makes up for them, numbers that a variable cannot have are not;
    see ``_bridge`` and ``_odd``. ``missing_writes`` lists the first ``MOST_GAPS`` gaps.

    Raises:
        BagError: the table of variables is not one that a rack sends.
    """

    def __init__(self, bag: Path, facts: RunFacts) -> None:
        self.facts = facts
        self.variables = variables_of(bag, facts.table)
        self._bag = bag
        self._log = WriteLog(facts.table.run_id)
        self._first_write = facts.first_write
        self._last_write = -1
        self.missing_writes: list[str] = []
        self._kinds: dict[int, _Kind] = {
            item.id: (_TYPED.get(kind), *kind.range, math.prod(item.dimensions), name)
            for name, item in self.variables.items()
            for kind in (DataType.numbered(item.type),)
        }
        self._read_kinds = {**_CHANNELS, **_DRIVES, **self._kinds}

    def check_table(self, table: VariableTable) -> None:
        """Check that a further table is of the same run.

        Raises:
            BagError: it is that of another run.
        """
        own = self.facts.table
        if (table.rack, table.run_id) != (own.rack, own.run_id):
            text = f"holds more than one run: of {_run_text(own)} and of {_run_text(table)}"
            raise BagError("AMX6822", self._bag, text)

    def take(self, message: CommonImage | CommonWrite) -> list[Entry] | None:
        """Return the entries of a message, None if it has nothing new.

        Raises:
            BagError: writes before it are missing, or it does not fit the table of variables.
        """
        image = isinstance(message, CommonImage)
        log = self._log
        if message.run_id != log.run_id or (image and message.sequence + 1 < self._first_write):
            return None
        missing = log.missing(message.sequence, image=image)
        if not image:
            if message.sequence <= self._last_write:
                raise self._goes_backwards(message)
            self._last_write = message.sequence
        if missing < 0:
            return None
        if missing:
            if len(self.missing_writes) < MOST_GAPS:
                self.missing_writes.append(_missing_text(missing, message))
            if not image:
                self._bridge(missing, message)
        log.sequence = message.sequence
        return self.entries(message.values, message.stamp)

    def reads(self, values: Values, stamp: int) -> list[Entry]:
        """Return the values that a scan read, as ``entries`` does; those of channels and drives have separate views.

        Raises:
            BagError: they do not fit the table of variables.
        """
        return self._typed_entries(values, stamp, self._read_kinds)

    def entries(self, values: Values, stamp: int) -> list[Entry]:
        """Return the entries of a message, each in its variable's own type.

        Raises:
            BagError: they do not fit the table of variables.
        """
        return self._typed_entries(values, stamp, self._kinds)

    def _typed_entries(self, values: Values, stamp: int, kinds: Mapping[int, _Kind]) -> list[Entry]:
        if not values.variable:
            return []
        texts = iter(values.text)
        found: list[Entry] = []
        try:
            for number, element, value in zip(values.variable, values.element, values.value, strict=True):
                typed, least, greatest, elements, name = kinds[number]
                if element >= elements:
                    raise ValueError(f"{name} has no element {element}")
                if typed is None:
                    found.append((number, element, next(texts)))
                elif least <= value <= greatest and (own := typed(value)) == value:
                    found.append((number, element, own))
                else:
                    found.append((number, element, self._odd(name, value)))
        except KeyError as error:
            raise self._wrong(stamp, f"there is no variable {error}") from error
        except StopIteration as error:
            raise self._wrong(stamp, "a string variable without its text") from error
        except ValueError as error:
            raise self._wrong(stamp, str(error)) from error
        return found

    def _odd(self, name: str, value: float) -> Value:  # noqa: ARG002
        """Return a number that the variable cannot have unchanged; subclasses may raise ValueError."""
        return value

    def _bridge(self, missing: int, message: CommonImage | CommonWrite) -> None:
        text = _missing_text(missing, message)
        raise BagError("AMX6823", self._bag, text, "the recorder lost messages; `automax run --record` loses none")

    def _goes_backwards(self, write: CommonImage | CommonWrite) -> BagError:
        place, before = seconds_text(max(0, write.stamp)), self._last_write
        text = f"the write log goes backwards at {place} s: write {write.sequence} after write {before}"
        twice = ", which stands there twice" if write.sequence == before else ""
        return BagError("AMX6813", self._bag, f"{text}{twice}", ORDER_HINT)

    def _wrong(self, stamp: int, reason: str) -> BagError:
        return BagError("AMX6813", self._bag, f"wrong values at {seconds_text(max(0, stamp))} s: {reason}")


_TYPED: dict[DataType, Callable[[float], Value]] = {
    DataType.INTEGER: int,
    DataType.DOUBLE: int,
    DataType.REAL: float,
    DataType.BOOLEAN: bool,
}
"""Conversions of a number in a message to the variable's type; strings have none."""
_CHANNELS: dict[int, _Kind] = {
    view: (_TYPED.get(kind), *kind.range, _CHANNEL_NUMBERS, "a channel") for kind, view in CHANNEL_VIEWS.items()
}


_DRIVES: dict[int, _Kind] = {
    view: (int, *DataType.DOUBLE.range, numbers, what)
    for view, numbers, what in (
        (MEASURED_VIEW, MEASURED_NUMBERS, "a measurement"),
        (COMMAND_VIEW, COMMAND_NUMBERS, "a command"),
    )
}


class WatchedValues:
    """The values of watched variables from messages, by the index of their column."""

    def __init__(self, watched: Sequence[Watched]) -> None:
        self._columns = {(item.variable, item.element): index for index, item in enumerate(watched)}
        self._shown: dict[int, Cell] = {}
        self._received: dict[int, Cell] = {}

    def take(self, entries: Iterable[Entry]) -> None:
        """Set the values of one message."""
        for variable, place, value in entries:
            index = self._columns.get((variable, place))
            if index is not None:
                self._received[index] = value

    def set_value(self, index: int, value: Cell) -> None:
        """Set the value of one column."""
        self._received[index] = value

    def changes(self) -> dict[int, Cell]:
        """Return the values that differ from those at the previous call."""
        if not self._received:
            return {}
        shown = self._shown
        changed = {index: value for index, value in self._received.items() if value != shown.get(index)}
        shown.update(changed)
        self._received.clear()
        return changed


def _missing_text(missing: int, message: CommonImage | CommonWrite) -> str:
    """Return in words which writes are missing before a message; an image includes the last of them."""
    last = message.sequence - (0 if isinstance(message, CommonImage) else 1)
    first = last - missing + 1
    writes = f"writes {first} to {last} are" if missing > 1 else f"write {last} is"
    return f"{writes} missing before {seconds_text(max(0, message.stamp))} s"


def _run_text(table: VariableTable) -> str:
    """Return the run of a table of variables in words: two racks, or two runs of one, may have the same name."""
    return f"{table.rack[:40]} (run {table.run_id}, its table at {seconds_text(table.stamp)} s)"


def variables_of(bag: Path, table: VariableTable) -> dict[str, Variable]:
    """Return the variables of a recording's table by name.

    Raises:
        BagError: the table is not one that a rack writes.
    """
    try:
        return checked_table(table)
    except ValueError as error:
        raise BagError("AMX6813", bag, f"the table of variables is wrong: {error}", _WRONG_TABLE_HINT) from error


_WRONG_TABLE_HINT = "no rack has sent it so; its ids are ambiguous"
