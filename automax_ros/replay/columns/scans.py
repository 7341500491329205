"""The scans of the tasks, and the writes to common memory, in a block of a recording, as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.kinds import WriteKind
from automax_ros.messages.types.messages import NAMES, CommonWrite, Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock
from automax_ros.replay.columns.entries import Entries, Ints, ValueRules
from automax_ros.replay.columns.library import SCANS, WRITES, ColumnLibrary, TakenMessages
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, OVERLAP

SCAN = NAMES[Scan]


@dataclass(frozen=True)
class ScanColumns:
    """Scans in the order of the file; ``places`` are those of their messages in the block.

    ``odd`` are those that must be replayed one by one: malformed, not fitting the variables of the rack, with strings
    or with inputs from outside of common memory, or with a fault for their time. Of ``errors`` the views are lines, the
    elements codes.
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
    errors: Entries
    odd: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.places)

    def part(self, begin: int, end: int) -> ScanColumns:
        """Return the scans from ``begin`` to before ``end``."""
        columns: list[Any] = list(vars(self).values())
        parts: list[Any] = [item.part(begin, end) if isinstance(item, Entries) else item[begin:end] for item in columns]
        return ScanColumns(*parts)


WRITE = NAMES[CommonWrite]
LIMIT = np.iinfo(np.int64).max
FORCING = (int(WriteKind.FORCE), int(WriteKind.RELEASE))


@dataclass(frozen=True)
class WriteColumns:
    """Writes in the order of the file; ``places`` are those of their messages in the block.

    ``writers`` are the numbers of their writers. ``good`` are those that may be applied together; the others must be
    applied one by one, since they are malformed or of another run, do not fit the variables of the rack, contain
    strings or do not follow the previous write.
    """

    places: Ints
    sequences: Ints
    writers: Ints
    entries: Entries
    good: NDArray[np.bool_]

    def between(self, begin: int, end: int) -> WriteColumns:
        """Return the writes whose places are from ``begin`` to before ``end``."""
        first, last = np.searchsorted(self.places, (begin, end)).tolist()
        return self.part(first, last)

    def part(self, begin: int, end: int) -> WriteColumns:
        """Return the writes from ``begin`` to before ``end``."""
        entries = self.entries.part(begin, end)
        places, sequences, writers = (item[begin:end] for item in (self.places, self.sequences, self.writers))
        return WriteColumns(places, sequences, writers, entries, self.good[begin:end])

    def runs(self) -> Iterator[WriteColumns]:
        """Yield the writes in stretches that are all good or all not good."""
        ends = np.flatnonzero(self.good[1:] != self.good[:-1]) + 1
        bounds = [0, *ends.tolist(), len(self.places)]
        yield from (self.part(begin, end) for begin, end in pairwise(bounds) if end > begin)


def scans_by_task(
    library: ColumnLibrary, block: MessageBlock, places: Ints, tasks: Sequence[str], rules: ValueRules
) -> tuple[dict[str, ScanColumns], Ints]:
    """Return the scans of each task at these places of a block, and the places of scans of no task.

    The first malformed scan, and all after it, are odd.
    """
    taken = library.taken(SCANS, block.data, block.starts[places], block.lengths[places], rules, tasks)
    named, odd = taken.named, taken.odd | taken.with_texts | (taken.numbers["scan"] < 0)
    for row in taken.malformed.tolist():
        scan = _decode(block, int(places[row]))
        if scan is None:
            odd[row:] = True  # a replay ends at the first malformed message
            break
        named[row] = tasks.index(scan.task) if scan.task in tasks else -1
    chosen = {task: np.flatnonzero(named == number) for number, task in enumerate(tasks)}
    scans = {task: _scans(library, taken, rows, places, odd) for task, rows in chosen.items() if len(rows)}
    return scans, places[named < 0]


def _scans(
    library: ColumnLibrary, taken: TakenMessages, rows: Ints, places: Ints, odd: NDArray[np.bool_]
) -> ScanColumns:
    latched, read, written, committed, errors = library.picked(taken, rows)
    strange = odd[rows]
    timed = np.flatnonzero(np.isin(errors.elements, (OVERLAP, EVENT_TIMEOUT)))  # no execution of a source shows those
    strange[np.searchsorted(errors.offsets, timed, side="right") - 1] = True
    stamps, scans, durations, full = (numbers[rows] for numbers in taken.numbers.values())
    return ScanColumns(
        places[rows], stamps, scans, durations, full != 0, latched, read, written, committed, errors, strange
    )


def write_columns(
    library: ColumnLibrary, block: MessageBlock, places: Ints, run_id: int, rules: ValueRules
) -> tuple[WriteColumns, Ints]:
    """Return the writes, and the places of those by which a force begins or ends."""
    taken = library.taken(WRITES, block.data, block.starts[places], block.lengths[places], rules)
    entries = library.picked(taken, np.arange(len(places)))[0]
    sequences, kinds, runs, writers = taken.numbers.values()
    for row in taken.malformed.tolist():
        write = _decode(block, int(places[row]))
        if write is None:
            break  # a replay ends at the first malformed message
        kinds[row] = write.kind
    forcing = np.isin(kinds, FORCING)
    own = runs.view(np.uint64) == np.uint64(run_id & ((1 << 64) - 1))
    good = own & (sequences >= 0) & (sequences < LIMIT) & ~(taken.odd | taken.with_texts | forcing)
    good[1:] &= np.diff(sequences) == 1
    return WriteColumns(places, sequences, writers, entries, good), places[forcing]


def _decode(block: MessageBlock, place: int) -> Any:
    """Return a message that only the scalar decoder can check; None if it is malformed."""
    try:
        return block.message(place).message
    except BagError:
        return None
