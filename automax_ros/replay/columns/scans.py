"""The scans of the tasks in a block of a recording, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from automax_ros.bags.blocks import MessageBlock
from automax_ros.bags.errors import BagError
from automax_ros.replay.columns.entries import Entries, EntriesBuilder, ValueRules, chosen, put
from automax_ros.running.task import EVENT_TIMEOUT, OVERLAP
from automax_ros.wire.cdr_columns import Array, Bytes, Ints, MessageColumns, decode_columns
from automax_ros.wire.messages import NAMES, Scan

SCAN = NAMES[Scan]
_FIELDS = ("latched", "read", "written", "committed")
_NUMBERS = ("stamp", "scan", "duration_ns")
_HEAD = np.dtype([("skipped", "V16"), ("size", "<u4"), ("name", "V12")])
"""The beginning of a Scan: header, stamp and slot, then the name of its task with the length of that."""


@dataclass(frozen=True)
class ScanErrors:
    """The run-time errors of scans: scan k has those from ``offsets[k]`` up to ``offsets[k + 1]``."""

    offsets: Ints
    lines: Ints
    codes: Ints

    def part(self, begin: int, end: int) -> ScanErrors:
        """Return the errors of the scans from ``begin`` up to ``end``."""
        offsets = self.offsets[begin : end + 1]
        first, last = int(offsets[0]), int(offsets[-1])
        return ScanErrors(offsets - first, self.lines[first:last], self.codes[first:last])

    def of(self, rows: Ints) -> ScanErrors:
        """Return the errors of some scans."""
        offsets, places = chosen(self.offsets, rows)
        return ScanErrors(offsets, self.lines[places], self.codes[places])


@dataclass(frozen=True)
class ScanColumns:
    """Scans in the order of the file; ``places`` are those of their messages in the block.

    ``odd`` are those that have to be taken one by one: malformed, not fitting the variables of the rack, with strings
    or with what came from elsewhere than common memory, or telling of a fault by time.
    """

    places: Ints
    stamps: Ints
    scans: Ints
    durations: Ints
    full: NDArray[np.bool_]
    latched: Entries
    read: Entries
    written: Entries
    committed: Entries
    errors: ScanErrors
    odd: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.places)

    def part(self, begin: int, end: int) -> ScanColumns:
        """Return the scans from ``begin`` up to ``end``."""
        return ScanColumns(
            self.places[begin:end],
            self.stamps[begin:end],
            self.scans[begin:end],
            self.durations[begin:end],
            self.full[begin:end],
            self.latched.part(begin, end),
            self.read.part(begin, end),
            self.written.part(begin, end),
            self.committed.part(begin, end),
            self.errors.part(begin, end),
            self.odd[begin:end],
        )

    def of(self, rows: Ints) -> ScanColumns:
        """Return some of the scans."""
        return ScanColumns(
            self.places[rows],
            self.stamps[rows],
            self.scans[rows],
            self.durations[rows],
            self.full[rows],
            self.latched.of(rows),
            self.read.of(rows),
            self.written.of(rows),
            self.committed.of(rows),
            self.errors.of(rows),
            self.odd[rows],
        )


def scans_by_task(
    block: MessageBlock, places: Ints, tasks: Sequence[str], rules: ValueRules
) -> tuple[dict[str, ScanColumns], Ints]:
    """Decode the scans at these places of a block, by the names of their tasks.

    Returns too which of the places hold no scan of these tasks, as far as can be told; the first malformed one is
    among them, whoever it names.
    """
    names = _Names(block, places)
    chosen_rows = {task: np.flatnonzero(names.of(task)) for task in tasks}
    left = np.ones(len(places), bool)
    for rows in chosen_rows.values():
        left[rows] = False
    # Scans of all tasks are decoded together: those of the same sizes are more so.
    builder = _Builder(block, places)
    together = builder.made(rules)
    if builder.malformed is not None:
        left[builder.malformed] = True
    return {task: together.of(rows) for task, rows in chosen_rows.items() if len(rows)}, places[left]


def tell_of_time(errors: ScanErrors) -> Ints:
    """Return the scans that tell of a fault by time, which no execution of a source does."""
    timed = np.flatnonzero(np.isin(errors.codes, (OVERLAP, EVENT_TIMEOUT)))
    return np.searchsorted(errors.offsets, timed, side="right") - 1


class _Names:
    """The names of the tasks in scans, read from their beginnings."""

    def __init__(self, block: MessageBlock, places: Ints) -> None:
        self._long = block.lengths[places] >= _HEAD.itemsize
        starts = np.where(self._long, block.starts[places], 0)
        if len(block.data) >= _HEAD.itemsize:
            views = np.ndarray((len(block.data) - _HEAD.itemsize + 1,), f"V{_HEAD.itemsize}", block.data, strides=(1,))
            self._heads = views[np.minimum(starts, len(views) - 1)].view(_HEAD)
        else:
            self._heads = np.zeros(len(places), _HEAD)
        self._texts: Bytes = np.ascontiguousarray(self._heads["name"]).view(np.uint8).reshape(len(places), 12)

    def of(self, task: str) -> NDArray[np.bool_]:
        """Return which scans are those of a task."""
        expected = np.frombuffer(task.encode() + b"\0", np.uint8)
        if len(expected) > self._texts.shape[1]:
            return np.zeros(len(self._texts), bool)
        same = (self._texts[:, : len(expected)] == expected).all(axis=1)
        return np.asarray(self._long & same & (self._heads["size"] == len(expected)), bool)


class _Builder:
    """Builds columns from messages of the same sizes, and of others one by one."""

    def __init__(self, block: MessageBlock, places: Ints) -> None:
        self.places = places
        self._numbers = {name: np.zeros(len(places), np.int64) for name in _NUMBERS}
        self._full = np.zeros(len(places), bool)
        self._entries = {name: EntriesBuilder(len(places)) for name in _FIELDS}
        self._errors: list[tuple[Ints, Array, Array]] = []
        self._error_counts = np.zeros(len(places), np.int64)
        self._bad = np.zeros(len(places), bool)
        self.malformed: int | None = None
        groups, odd = decode_columns(SCAN, block.data, block.starts[places], block.lengths[places])
        for group in groups:
            self._add(group)
        for row in odd.tolist():
            if not self._add_one(block, row):
                self._bad[row:] = True  # a replay ends at the first malformed message
                self.malformed = row
                break

    def made(self, rules: ValueRules) -> ScanColumns:
        """Return the columns."""
        stamps, scans, durations = self._numbers.values()
        entries = [rules.typed(builder.made()) for builder in self._entries.values()]
        errors = self._made_errors()
        odd = self._bad.copy()
        for builder, made in zip(self._entries.values(), entries, strict=True):
            odd |= builder.bad
            odd[rules.wrong(made)] = True
        odd[tell_of_time(errors)] = True
        latched, read, written, committed = entries
        return ScanColumns(
            self.places, stamps, scans, durations, self._full, latched, read, written, committed, errors, odd
        )

    def _add(self, group: MessageColumns) -> None:
        rows, fields = group.rows, group.fields
        for name, numbers in self._numbers.items():
            numbers[rows] = fields[name]
        self._bad[rows] |= fields["scan"] > np.iinfo(np.int64).max
        self._full[rows] = fields["full"] != 0
        for name, builder in self._entries.items():
            builder.add(group, name)
        self._add_errors(rows, fields["errors.line"], fields["errors.code"])

    def _add_one(self, block: MessageBlock, row: int) -> bool:
        """Take one message; return FALSE if it is malformed."""
        try:
            scan = block.message(int(self.places[row])).message
        except BagError:
            return False
        assert isinstance(scan, Scan)
        if scan.scan > np.iinfo(np.int64).max:
            self._bad[row] = True
            return True
        for name, numbers in self._numbers.items():
            numbers[row] = getattr(scan, name)
        self._full[row] = scan.full
        for name, builder in self._entries.items():
            builder.add_one(row, getattr(scan, name))
        lines, codes = ([getattr(error, name) for error in scan.errors] for name in ("line", "code"))
        self._add_errors(np.array([row]), np.array([lines], np.int64), np.array([codes], np.int64))
        return True

    def _add_errors(self, rows: Ints, lines: Array, codes: Array) -> None:
        if lines.shape[1]:
            self._error_counts[rows] = lines.shape[1]
            self._errors.append((rows, lines, codes))

    def _made_errors(self) -> ScanErrors:
        offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(self._error_counts)))
        total = int(offsets[-1])
        found = ScanErrors(offsets, np.empty(total, np.int64), np.empty(total, np.int64))
        for rows, lines, codes in self._errors:
            put(offsets[rows], (lines, codes), (found.lines, found.codes))
        return found
