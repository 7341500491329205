"""Values of common variables in many messages, concatenated in plain arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.types import DataType
from automax_ros.messages.cdr.columns import Array, Ints, MessageColumns
from automax_ros.messages.types.messages import Values
from automax_ros.rackfile.model.config import CommonVariable

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Entries:
    """Entries of messages: message k has those from ``offsets[k]`` to before ``offsets[k + 1]``."""

    offsets: Ints
    views: Ints
    elements: Ints
    values: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def counts(self) -> Ints:
        """The number of entries of each message."""
        return np.diff(self.offsets)

    @property
    def rows(self) -> Ints:
        """The message of each entry."""
        return np.repeat(np.arange(len(self)), self.counts)

    def part(self, begin: int, end: int) -> Entries:
        """Return the entries of the messages from ``begin`` to before ``end``."""
        offsets = self.offsets[begin : end + 1]
        first, last = int(offsets[0]), int(offsets[-1])
        return Entries(offsets - first, self.views[first:last], self.elements[first:last], self.values[first:last])

    def of(self, rows: Ints) -> Entries:
        """Return the entries of some messages."""
        offsets, places = chosen(self.offsets, rows)
        return Entries(offsets, self.views[places], self.elements[places], self.values[places])

    def row_of(self, entry: int) -> int:
        """Return the message of one entry."""
        return int(np.searchsorted(self.offsets, entry, side="right")) - 1


def chosen(offsets: Ints, rows: Ints) -> tuple[Ints, Ints]:
    """Return the offsets of some rows of a ragged list, and the places of their items."""
    counts = offsets[rows + 1] - offsets[rows]
    own = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts)))
    return own, np.repeat(offsets[rows] - own[:-1], counts) + np.arange(int(own[-1]))


class EntriesBuilder:
    """Collects the entries of ``count`` messages in any order; ``bad`` are those whose lists are inconsistent."""

    def __init__(self, count: int) -> None:
        self._counts = np.zeros(count, np.int64)
        self._parts: list[tuple[Ints, Array, Array, Array]] = []
        self.bad = np.zeros(count, bool)

    def add(self, columns: MessageColumns, prefix: str) -> None:
        """Add one field of messages of the same sizes."""
        views, elements, values = (columns.fields[f"{prefix}.{name}"] for name in ("variable", "element", "value"))
        if not views.shape[1] == elements.shape[1] == values.shape[1]:
            self.bad[columns.rows] = True
            return
        if views.shape[1]:
            self._counts[columns.rows] = views.shape[1]
            self._parts.append((columns.rows, views, elements, values))

    def add_one(self, row: int, values: Values) -> None:
        """Add one field of one message."""
        if values.text or not len(values.variable) == len(values.element) == len(values.value):
            self.bad[row] = True
        elif values.variable:
            self._counts[row] = len(values.variable)
            arrays = np.array([values.variable]), np.array([values.element]), np.array([values.value])
            self._parts.append((np.array([row]), *arrays))

    def made(self) -> Entries:
        """Return the entries in the order of the messages."""
        offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(self._counts)))
        total = int(offsets[-1])
        found = Entries(offsets, np.empty(total, np.int64), np.empty(total, np.int64), np.empty(total))
        for rows, *columns in self._parts:
            put(offsets[rows], columns, (found.views, found.elements, found.values))
        return found


def put(begins: Ints, columns: Sequence[Array], kept: Sequence[Array]) -> None:
    """Copy each row of some matrices to its begin, looping over their shorter side: messages may be few and long."""
    count, width = columns[0].shape
    if width <= count:
        for place in range(width):
            to = begins + place
            for numbers, all_numbers in zip(columns, kept, strict=True):
                all_numbers[to] = numbers[:, place]
        return
    for row, begin in enumerate(begins.tolist()):
        for numbers, all_numbers in zip(columns, kept, strict=True):
            all_numbers[begin : begin + width] = numbers[row]


class ValueRules:
    """The possible values of a rack's ``count`` variables, by number; strings have none here.

    Each has a number of ``elements``, a ``least`` and a ``greatest`` value, and may be a ``real``.
    """

    def __init__(self, variables: Sequence[CommonVariable]) -> None:
        count = len(variables)
        self.count = count
        # The last item of each is for variables that the rack does not have: no value fits it.
        self.real = np.array([*(item.type is DataType.REAL for item in variables), False], bool)
        self.elements = np.array([*(item.elements for item in variables), 0], np.int64)
        ranges = [*(item.type.range if item.type is not DataType.STRING else (1, 0) for item in variables), (1, 0)]
        self.least = np.array([low for low, _ in ranges], np.float64)
        self.greatest = np.array([high for _, high in ranges], np.float64)

    def wrong(self, entries: Entries) -> Ints:
        """Return the messages with a value that its variable cannot have, ascending."""
        if not len(entries.views):
            return np.zeros(0, np.int64)
        views = np.minimum(entries.views, self.count)
        values = entries.values
        fits = (
            (entries.elements < self.elements[views])
            & (self.least[views] <= values)
            & (values <= self.greatest[views])
            & (self.real[views] | (values == np.floor(values)))
        )
        if fits.all():
            return np.zeros(0, np.int64)
        return np.unique(entries.rows[~fits])

    def typed(self, entries: Entries) -> Entries:
        """Return entries in the types of their variables: whole numbers have no negative zero."""
        if not len(entries.views):
            return entries
        views = np.minimum(entries.views, self.count)
        values = np.where(self.real[views], entries.values, entries.values + 0.0)
        return Entries(entries.offsets, entries.views, entries.elements, values)


def first_other(recorded: Entries, own: Entries, *, bits: bool) -> int:
    """Return the first message whose entries differ, or the number of messages.

    With ``bits`` values are compared bit for bit, and elements count, too.
    """
    count = min(len(recorded), len(own))
    if not len(recorded.views) and not len(own.views):
        return count
    first = min((_first(part) for part in _differing(recorded, own, count, bits=bits)), default=count)
    return min(first, count)


def _differing(recorded: Entries, own: Entries, count: int, *, bits: bool) -> Iterator[Ints]:
    other_counts = np.flatnonzero(recorded.offsets[1 : count + 1] != own.offsets[1 : count + 1])
    if len(other_counts):
        yield other_counts[:1]
        count = int(other_counts[0])
    total = int(recorded.offsets[count])
    same = recorded.views[:total] == own.views[:total]
    if bits:
        same &= recorded.elements[:total] == own.elements[:total]
        same &= recorded.values[:total].view(np.int64) == own.values[:total].view(np.int64)
    else:
        same &= recorded.values[:total] == own.values[:total]
    if not same.all():
        yield np.array([recorded.row_of(int(np.argmin(same)))])


def _first(rows: Ints) -> int:
    return int(rows[0])
