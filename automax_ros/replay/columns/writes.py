"""The writes to common memory in a block of a recording, as columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from automax_ros.bags.blocks import MessageBlock
from automax_ros.bags.errors import BagError
from automax_ros.core.kinds import WriteKind
from automax_ros.replay.columns.entries import Entries, EntriesBuilder, ValueRules
from automax_ros.wire.cdr_columns import Ints, decode_columns
from automax_ros.wire.messages import NAMES, CommonWrite

WRITE = NAMES[CommonWrite]
LIMIT = np.iinfo(np.int64).max
FORCING = (int(WriteKind.FORCE), int(WriteKind.RELEASE))


@dataclass(frozen=True)
class WriteColumns:
    """Writes in the order of the file; ``places`` are those of their messages in the block.

    ``good`` are those that may be taken together: the others have to be taken one by one, since they are malformed, of
    another run, do not fit the variables of the rack, hold strings or do not follow on the write before.
    """

    places: Ints
    sequences: Ints
    entries: Entries
    good: NDArray[np.bool_]

    def between(self, begin: int, end: int) -> WriteColumns:
        """Return the writes whose places are from ``begin`` up to ``end``."""
        first, last = np.searchsorted(self.places, (begin, end)).tolist()
        return self.part(first, last)

    def part(self, begin: int, end: int) -> WriteColumns:
        """Return the writes from ``begin`` up to ``end``."""
        entries = self.entries.part(begin, end)
        return WriteColumns(self.places[begin:end], self.sequences[begin:end], entries, self.good[begin:end])

    def runs(self) -> Iterator[WriteColumns]:
        """Return the writes in stretches that are all good or all not."""
        ends = np.flatnonzero(self.good[1:] != self.good[:-1]) + 1
        bounds = [0, *ends.tolist(), len(self.places)]
        yield from (self.part(begin, end) for begin, end in pairwise(bounds) if end > begin)


def write_columns(block: MessageBlock, places: Ints, run_id: int, rules: ValueRules) -> tuple[WriteColumns, Ints]:
    """Decode the writes at these places of a block; return too at which of them a force begins or ends."""
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
    """Return a write, decoded by itself; None if it is malformed."""
    try:
        message = block.message(place).message
    except BagError:
        return None
    assert isinstance(message, CommonWrite)
    return message
