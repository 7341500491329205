"""The scans and writes of a block as columns, found by machine code; ``columns/scans`` does the same with NumPy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from automax_ros.messages.cdr.columns import Ints
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock
from automax_ros.replay.columns.entries import ValueRules
from automax_ros.replay.columns.library import SCANS, WRITES, ColumnLibrary, TakenMessages
from automax_ros.replay.columns.scans import (
    FORCING,
    LIMIT,
    ScanColumns,
    ScanErrors,
    WriteColumns,
    decoded_write,
    tell_of_time,
)

_UINT64 = (1 << 64) - 1


def native_scans(
    library: ColumnLibrary, block: MessageBlock, places: Ints, tasks: Sequence[str], rules: ValueRules
) -> tuple[dict[str, ScanColumns], Ints]:
    """Return the scans of each task, and the places of scans of no task, as ``scans_by_task`` does."""
    taken = library.taken(SCANS, block.data, block.starts[places], block.lengths[places], rules, tasks)
    named, odd = taken.named, taken.odd | taken.with_texts | (taken.numbers["scan"] < 0)
    for row in taken.malformed.tolist():
        name = _task_of(block, int(places[row]))
        if name is None:
            odd[row:] = True  # a replay ends at the first malformed message
            break
        named[row] = tasks.index(name) if name in tasks else -1
    chosen = {task: np.flatnonzero(named == number) for number, task in enumerate(tasks)}
    scans = {task: _scans(library, taken, rows, places, odd) for task, rows in chosen.items() if len(rows)}
    return scans, places[named < 0]


def _scans(
    library: ColumnLibrary, taken: TakenMessages, rows: Ints, places: Ints, odd: NDArray[np.bool_]
) -> ScanColumns:
    latched, read, written, committed, pairs = library.picked(taken, rows)
    errors = ScanErrors(pairs.offsets, pairs.views, pairs.elements)
    strange = odd[rows]
    strange[tell_of_time(errors)] = True
    stamps, scans, durations, full = (numbers[rows] for numbers in taken.numbers.values())
    return ScanColumns(
        places[rows], stamps, scans, durations, full != 0, latched, read, written, committed, errors, strange
    )


def native_writes(
    library: ColumnLibrary, block: MessageBlock, places: Ints, run_id: int, rules: ValueRules
) -> tuple[WriteColumns, Ints]:
    """Return the writes, and the places of those by which a force begins or ends, as ``write_columns`` does."""
    taken = library.taken(WRITES, block.data, block.starts[places], block.lengths[places], rules)
    entries = library.picked(taken, np.arange(len(places)))[0]
    sequences, kinds, runs = taken.numbers.values()
    for row in taken.malformed.tolist():
        write = decoded_write(block, int(places[row]))
        if write is None:
            break  # a replay ends at the first malformed message
        kinds[row] = write.kind
    forcing = np.isin(kinds, FORCING)
    own = runs.view(np.uint64) == np.uint64(run_id & _UINT64)
    good = own & (sequences >= 0) & (sequences < LIMIT) & ~(taken.odd | taken.with_texts | forcing)
    good[1:] &= np.diff(sequences) == 1
    return WriteColumns(places, sequences, entries, good), places[forcing]


def _task_of(block: MessageBlock, place: int) -> str | None:
    """Return the task of a scan that only the scalar decoder can check; None if it is malformed."""
    try:
        message = block.message(place).message
    except BagError:
        return None
    return str(getattr(message, "task", ""))
