"""The scans of the tasks, and the writes to common memory, in a block of a recording, as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.kinds import WriteKind
from automax_ros.messages.cdr.columns import Array, Bytes, Ints, MessageColumns, decode_columns
from automax_ros.messages.types.messages import NAMES, CommonWrite, Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock
from automax_ros.replay.columns.entries import Entries, EntriesBuilder, ValueRules, chosen, put
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, OVERLAP

SCAN = NAMES[Scan]
_FIELDS = ("latched", "read", "written", "committed")
_NUMBERS = ("stamp", "scan", "duration_ns")
_HEAD = np.dtype([("skipped", "V16"), ("size", "<u4"), ("name", "V12")])
"""Beginning of a Scan: header, stamp and slot, then the length and the name of its task."""


@dataclass(frozen=True)
class ScanErrors:
    """The run-time errors of scans: scan k has those from ``offsets[k]`` to before ``offsets[k + 1]``."""

    offsets: Ints
    lines: Ints
    codes: Ints

    def part(self, begin: int, end: int) -> ScanErrors:
        """Return the errors of the scans from ``begin`` to before ``end``."""
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

    ``odd`` are those that must be replayed one by one: malformed, not fitting the variables of the rack, with strings
    or with inputs from outside of common memory, or with a fault for their time.
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
        """Return the scans from ``begin`` to before ``end``."""
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

    Also returns the places without a scan of these tasks, as far as is known; the first malformed one is among them,
    whichever task it names.
    """
    names = _Names(block, places)
    chosen_rows = {task: np.flatnonzero(names.of(task)) for task in tasks}
    left = np.ones(len(places), bool)
    for rows in chosen_rows.values():
        left[rows] = False
    # Scans of all tasks are decoded together: so there are more of the same sizes.
    builder = _Builder(block, places)
    together = builder.made(rules)
    if builder.malformed is not None:
        left[builder.malformed] = True
    return {task: together.of(rows) for task, rows in chosen_rows.items() if len(rows)}, places[left]


def tell_of_time(errors: ScanErrors) -> Ints:
    """Return the scans with a fault for their time, which no execution of a source can show."""
    timed = np.flatnonzero(np.isin(errors.codes, (OVERLAP, EVENT_TIMEOUT)))
    return np.searchsorted(errors.offsets, timed, side="right") - 1


class _Names:
    """The names of the tasks of scans, read from the beginnings of the messages."""

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
    """Builds columns from groups of messages of the same sizes, and from all others one by one."""

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
        """Add one message; return FALSE if it is malformed."""
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


WRITE = NAMES[CommonWrite]
LIMIT = np.iinfo(np.int64).max
FORCING = (int(WriteKind.FORCE), int(WriteKind.RELEASE))


@dataclass(frozen=True)
class WriteColumns:
    """Writes in the order of the file; ``places`` are those of their messages in the block.

    ``good`` are those that may be applied together; the others must be applied one by one, since they are malformed or
    of another run, do not fit the variables of the rack, contain strings or do not follow the previous write.
    """

    places: Ints
    sequences: Ints
    entries: Entries
    good: NDArray[np.bool_]

    def between(self, begin: int, end: int) -> WriteColumns:
        """Return the writes whose places are from ``begin`` to before ``end``."""
        first, last = np.searchsorted(self.places, (begin, end)).tolist()
        return self.part(first, last)

    def part(self, begin: int, end: int) -> WriteColumns:
        """Return the writes from ``begin`` to before ``end``."""
        entries = self.entries.part(begin, end)
        return WriteColumns(self.places[begin:end], self.sequences[begin:end], entries, self.good[begin:end])

    def runs(self) -> Iterator[WriteColumns]:
        """Yield the writes in stretches that are all good or all not good."""
        ends = np.flatnonzero(self.good[1:] != self.good[:-1]) + 1
        bounds = [0, *ends.tolist(), len(self.places)]
        yield from (self.part(begin, end) for begin, end in pairwise(bounds) if end > begin)


def write_columns(block: MessageBlock, places: Ints, run_id: int, rules: ValueRules) -> tuple[WriteColumns, Ints]:
    """Decode the writes at these places of a block; also return the places at which a force begins or ends."""
    count = len(places)
    sequences, kinds = np.zeros(count, np.int64), np.zeros(count, np.int64)
    builder = EntriesBuilder(count)
    good = np.zeros(count, bool)
    groups, odd = decode_columns(WRITE, block.data, block.starts[places], block.lengths[places])
    for group in groups:
        fields, rows = group.fields, group.rows
        sequences[rows], kinds[rows] = fields["sequence"], fields["kind"]
        good[rows] = (fields["run_id"] == np.uint64(run_id)) & (fields["sequence"] < LIMIT)
        builder.add(group, "values")
    for row in odd.tolist():
        write = decoded_write(block, int(places[row]))
        if write is None:
            break  # a replay ends at the first malformed message
        kinds[row] = write.kind
        if write.sequence < LIMIT:
            sequences[row], good[row] = write.sequence, write.run_id == run_id
            builder.add_one(row, write.values)
    entries = builder.made()
    forcing = np.isin(kinds, FORCING)
    good &= ~(builder.bad | forcing)
    good[rules.wrong(entries)] = False
    good[1:] &= np.diff(sequences) == 1
    return WriteColumns(places, sequences, rules.typed(entries), good), places[forcing]


def decoded_write(block: MessageBlock, place: int) -> CommonWrite | None:
    """Return a write, decoded alone; None if it is malformed."""
    try:
        message = block.message(place).message
    except BagError:
        return None
    assert isinstance(message, CommonWrite)
    return message
