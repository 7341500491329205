"""The write log of common memory as a recording tells it: one run of one rack, without gaps; the watched values."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from automax_ros.bags.errors import BagError
from automax_ros.bags.variables import Watched, checked_table
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType
from automax_ros.wire.messages import CommonImage, CommonWrite, Values, Variable, VariableTable

Cell = float | str
"""A value: booleans are 0 and 1."""
NO_COMMON_MEMORY_HINT = "record the topics /<rack>/variables, /<rack>/backplane and /<rack>/backplane/snapshot"


class CommonLog:
    """Checks that the messages are the write log of one run of one rack, without gaps."""

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._table: VariableTable | None = None
        self._sequence: int | None = None

    def take_table(self, table: VariableTable) -> bool:
        """Return whether this is the first table of variables.

        Raises:
            BagError: it is that of another run.
        """
        if self._table is None:
            self._table = table
            return True
        if (table.rack, table.run_id) != (self._table.rack, self._table.run_id):
            raise BagError(
                "AMX6822", self._bag, f"holds more than one run: of {self._table.rack[:40]} and {table.rack[:40]}"
            )
        return False

    def is_new(self, message: CommonImage | CommonWrite) -> bool:
        """Return whether a message tells something new: not one of another run, nor older than what was seen.

        Raises:
            BagError: writes before it are missing, or it stands before the table.
        """
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


class WatchedValues:
    """The watched variables as messages tell them, by the index of their column."""

    def __init__(self, watched: Sequence[Watched], strings: Collection[int]) -> None:
        self._strings = strings
        self._columns = {(item.variable, item.element): index for index, item in enumerate(watched)}
        self._shown: dict[int, Cell] = {}
        self._told: dict[int, Cell] = {}

    def take(self, values: Values) -> None:
        """Take over the values of one message.

        Raises:
            ValueError: its lists do not fit together.
        """
        for variable, element, value in entries(values, self._strings):
            index = self._columns.get((variable, element))
            if index is not None:
                self._told[index] = value

    def tell(self, index: int, value: Cell) -> None:
        """Take over the value of one column."""
        self._told[index] = value

    def changes(self) -> dict[int, Cell]:
        """Return what differs from the call before."""
        if not self._told:
            return {}
        shown = self._shown
        changed = {index: value for index, value in self._told.items() if value != shown.get(index)}
        shown.update(changed)
        self._told.clear()
        return changed


def entries(values: Values, strings: Collection[int]) -> Iterator[tuple[int, int, Cell]]:
    """Return the (variable, element, value) of a Values message; ``strings`` are the numbers of the string variables.

    Raises:
        ValueError: its lists do not fit together.
    """
    if not len(values.variable) == len(values.element) == len(values.value):
        raise ValueError("lists of different length")
    texts = iter(values.text)
    for variable, element, number in zip(values.variable, values.element, values.value, strict=True):
        if variable not in strings:
            yield variable, element, number
            continue
        text = next(texts, None)
        if text is None:
            raise ValueError("a string variable without its text")
        yield variable, element, text


def variables_of(bag: Path, table: VariableTable) -> dict[str, Variable]:
    """Return the variables of a recording's table by name.

    Raises:
        BagError: the table is not one that a rack writes.
    """
    try:
        return checked_table(table)
    except ValueError as error:
        raise BagError("AMX6813", bag, f"the table of variables is wrong: {error}", _WRONG_TABLE_HINT) from error


_WRONG_TABLE_HINT = "no rack has sent it so; what it numbers cannot be told apart"


def strings_of(variables: dict[str, Variable]) -> frozenset[int]:
    """Return the numbers of the string variables."""
    return frozenset(entry.id for entry in variables.values() if entry.type == DataType.STRING.number)
