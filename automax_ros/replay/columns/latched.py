"""What each of many scans latched, from what they newly latched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from automax_ros.replay.columns.entries import Entries
from automax_ros.replay.columns.library import ColumnLibrary
from automax_ros.replay.columns.scans import ScanColumns
from automax_ros.wire.cdr_columns import Ints


class LatchedColumns:
    """Columns of the views that a task latches, in its order."""

    def __init__(self, views: Sequence[int], count: int, library: ColumnLibrary | None = None) -> None:
        """Take the task's views, how many the rack has, and what does the same more quickly."""
        self._count, self._library = len(views), library
        self._positions = np.full(count, -1, np.int64)
        self._positions[list(views)] = np.arange(len(views))

    def whole(self, scans: ScanColumns) -> int:
        """Return up to which scan those that should tell all that is latched do so."""
        entries = scans.latched
        for row in np.flatnonzero(scans.full).tolist():
            found = self._positions[entries.views[entries.offsets[row] : entries.offsets[row + 1]]]
            if len(np.unique(found[found >= 0])) != self._count:
                return int(row)
        return len(scans)

    def columns(self, entries: Entries, before: Sequence[int]) -> Ints:
        """Return a row for each view with its value in each scan; ``before`` are the values before the first."""
        if self._library is not None:
            return self._library.latched(entries, self._positions, before)
        count = len(entries)
        told = self._positions[entries.views]
        own = told >= 0
        positions = np.concatenate((np.arange(self._count), told[own]))
        rows = np.concatenate((np.zeros(self._count, np.int64), entries.rows[own]))
        values = np.concatenate((np.array(before, np.int64), entries.values[own].astype(np.int64)))
        order = np.argsort(positions, kind="stable")
        positions, rows, values = positions[order], rows[order], values[order]
        ends = np.append(rows[1:], count)
        ends[np.flatnonzero(positions[1:] != positions[:-1])] = count
        return np.repeat(values, ends - rows).reshape(self._count, count)
