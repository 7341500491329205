"""The scans of one task in a block of a recording, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from automax_ros.bags.blocks import MessageBlock
from automax_ros.bags.errors import BagError
from automax_ros.replay.columns.entries import Entries, EntriesBuilder, ValueRules
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


@dataclass(frozen=True)
class ScanColumns:
    """Scans of one task in the order of the file; ``places`` are those of their messages in the block."""

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
        )


def scans_by_task(
    block: MessageBlock, places: Ints, tasks: Sequence[str], rules: ValueRules
) -> tuple[dict[str, ScanColumns], Ints]:
    """Decode the scans at these places of a block, by the names of their tasks.

    Returns too which of the places have to be taken one by one: what is malformed, does not fit the variables of the
    rack, holds strings or what came from elsewhere than common memory, is no scan of these tasks, or tells of a fault
    by time.
    """
    found: dict[str, ScanColumns] = {}
    bad: list[Ints] = []
    names = _Names(block, places)
    left = np.ones(len(places), bool)
    for task in tasks:
        chosen = names.of(task)
        left &= ~chosen
        if chosen.any():
            builder = _Builder(block, places[chosen])
            found[task] = builder.made()
            bad.append(builder.places[builder.bad(found[task], rules)])
    return found, np.sort(np.concatenate([places[left], *bad]))


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
    """Builds the columns of one task from messages of the same sizes, and of others one by one."""

    def __init__(self, block: MessageBlock, places: Ints) -> None:
        self.places = places
        self._numbers = {name: np.zeros(len(places), np.int64) for name in _NUMBERS}
        self._full = np.zeros(len(places), bool)
        self._entries = {name: EntriesBuilder(len(places)) for name in _FIELDS}
        self._errors: list[tuple[Ints, Array, Array]] = []
        self._error_counts = np.zeros(len(places), np.int64)
        self._bad = np.zeros(len(places), bool)
        groups, odd = decode_columns(SCAN, block.data, block.starts[places], block.lengths[places])
        for group in groups:
            self._add(group)
        for row in odd.tolist():
            self._add_one(block, row)

    def bad(self, scans: ScanColumns, rules: ValueRules) -> NDArray[np.bool_]:
        """Return which scans have to be taken by themselves."""
        bad = self._bad.copy()
        for builder in self._entries.values():
            bad |= builder.bad
        for entries in (scans.latched, scans.read, scans.written, scans.committed):
            bad[rules.wrong(entries)] = True
        timed = np.flatnonzero(np.isin(scans.errors.codes, (OVERLAP, EVENT_TIMEOUT)))
        bad[np.searchsorted(scans.errors.offsets, timed, side="right") - 1] = True
        return np.asarray(bad, bool)

    def made(self) -> ScanColumns:
        """Return the columns."""
        stamps, scans, durations = self._numbers.values()
        latched, read, written, committed = (builder.made() for builder in self._entries.values())
        return ScanColumns(
            self.places, stamps, scans, durations, self._full, latched, read, written, committed, self._made_errors()
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

    def _add_one(self, block: MessageBlock, row: int) -> None:
        try:
            scan = block.message(int(self.places[row])).message
        except BagError:
            self._bad[row] = True
            return
        assert isinstance(scan, Scan)
        if scan.scan > np.iinfo(np.int64).max:
            self._bad[row] = True
            return
        for name, numbers in self._numbers.items():
            numbers[row] = getattr(scan, name)
        self._full[row] = scan.full
        for name, builder in self._entries.items():
            builder.add_one(row, getattr(scan, name))
        lines, codes = ([getattr(error, name) for error in scan.errors] for name in ("line", "code"))
        self._add_errors(np.array([row]), np.array([lines], np.int64), np.array([codes], np.int64))

    def _add_errors(self, rows: Ints, lines: Array, codes: Array) -> None:
        if lines.shape[1]:
            self._error_counts[rows] = lines.shape[1]
            self._errors.append((rows, lines, codes))

    def _made_errors(self) -> ScanErrors:
        offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(self._error_counts)))
        total = int(offsets[-1])
        found = ScanErrors(offsets, np.empty(total, np.int64), np.empty(total, np.int64))
        for rows, lines, codes in self._errors:
            for place in range(lines.shape[1]):
                found.lines[offsets[rows] + place] = lines[:, place]
                found.codes[offsets[rows] + place] = codes[:, place]
        return found
