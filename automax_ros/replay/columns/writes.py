"""The writes to common memory in a block of a recording, as columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from automax_ros.bags.blocks import MessageBlock
from automax_ros.bags.errors import BagError
from automax_ros.core.kinds import WriteKind
from automax_ros.replay.columns.entries import Entries, EntriesBuilder, ValueRules
from automax_ros.wire.cdr_columns import Ints, decode_columns
from automax_ros.wire.messages import NAMES, CommonWrite

WRITE = NAMES[CommonWrite]
_FORCING = (int(WriteKind.FORCE), int(WriteKind.RELEASE))


@dataclass(frozen=True)
class WriteColumns:
    """Writes in the order of the file; ``places`` are those of their messages in the block."""

    places: Ints
    sequences: Ints
    entries: Entries

    def between(self, begin: int, end: int) -> WriteColumns:
        """Return the writes whose places are from ``begin`` up to ``end``."""
        first, last = np.searchsorted(self.places, (begin, end)).tolist()
        return WriteColumns(self.places[first:last], self.sequences[first:last], self.entries.part(first, last))


def write_columns(block: MessageBlock, places: Ints, run_id: int, rules: ValueRules) -> tuple[WriteColumns, Ints]:
    """Decode the writes at these places of a block.

    Returns too which of the places have to be taken one by one: what is malformed, of another run, does not fit the
    variables of the rack, holds strings, tells of a force, or does not follow on the write before it.
    """
    count = len(places)
    sequences = np.zeros(count, np.int64)
    builder = EntriesBuilder(count)
    good = np.zeros(count, bool)
    groups, odd = decode_columns(WRITE, block.data, block.starts[places], block.lengths[places])
    limit = np.iinfo(np.int64).max
    for group in groups:
        fields = group.fields
        sequences[group.rows] = fields["sequence"]
        builder.add(group, "values")
        forcing = np.isin(fields["kind"], _FORCING)
        good[group.rows] = (fields["run_id"] == np.uint64(run_id)) & ~forcing & (fields["sequence"] < limit)
    for row in odd.tolist():
        write = _decoded(block, int(places[row]))
        if write is not None and write.run_id == run_id and write.kind not in _FORCING and write.sequence < limit:
            sequences[row], good[row] = write.sequence, True
            builder.add_one(row, write.values)
    entries = builder.made()
    good &= ~builder.bad
    good[rules.wrong(entries)] = False
    good[1:] &= np.diff(sequences) == 1
    return WriteColumns(places, sequences, rules.typed(entries)), places[~good]


def _decoded(block: MessageBlock, place: int) -> CommonWrite | None:
    try:
        message = block.message(place).message
    except BagError:
        return None
    assert isinstance(message, CommonWrite)
    return message
