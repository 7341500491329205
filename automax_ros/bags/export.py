"""Recordings as CSV tables: common memory over time, or the scans of a task."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from automax_ros.bags.columns import Column, Table, column, require_another_file, unwritable
from automax_ros.bags.common_log import Cell
from automax_ros.bags.series import WHOLE_RUN, Progress, Series, Window
from automax_ros.bags.whole_file import open_at_once, written_whole
from automax_ros.core.ticks import seconds_text

TIME = "time_s"
"""Heading of the times, which count from the start of the run."""


class CommonTable:
    """Common memory as a table: a row for each instant at which a watched variable changed, or of the window's grid.

    A value holds until it changes. Without ``watch`` all simple numeric and boolean variables are taken.

    Raises:
        BagError: the recording cannot be read or has no common memory, or a name in ``watch`` is unknown.
    """

    def __init__(
        self,
        bag: Path,
        watch: Sequence[str] | None = None,
        window: Window = WHOLE_RUN,
        progress: Progress | None = None,
    ) -> None:
        self._series = Series(bag, watch, window, progress)
        self.columns: Sequence[Column] = [column(item.label, item.kind, item.unit) for item in self._series.columns]

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """Return the rows: time, and the cells that differ from the row before.

        Raises:
            BagError: the recording is damaged, or the window holds nothing.
        """
        yield from self._series.changes()


def export_csv(
    bag: Path,
    output: Path,
    watch: Sequence[str] | None = None,
    window: Window = WHOLE_RUN,
    progress: Progress | None = None,
) -> int:
    """Write the watched variables of a recording to a CSV file; return the number of rows below the header.

    Columns are ``time_s``, counted from the start of the run, and the variables with their type characters. A value
    holds until it changes; a cell is empty as long as the recording has not told the value. Booleans are 0 and 1.
    Without ``watch`` all simple numeric and boolean variables are taken; array elements are named like ``TABLE%(3)``.
    Memory does not grow with the recording.

    Raises:
        BagError: the recording cannot be read or has no common memory, a name in ``watch`` is unknown, the window holds
            nothing, or the output cannot be written.
    """
    require_another_file(bag, output)
    return write_csv(CommonTable(bag, watch, window, progress), output)


def write_csv(table: Table, output: Path) -> int:
    """Write a table to a CSV file, which appears when it is whole; return the number of its rows.

    Raises:
        BagError: the recording is damaged, or the output cannot be written.
    """
    formats = [item.text for item in table.columns]
    cells = [""] * len(formats)
    count = 0
    try:
        with (
            written_whole(output) as place,
            open(place, "w", encoding="utf-8", newline="", opener=open_at_once) as file,
        ):
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([TIME, *(item.label for item in table.columns)])
            for time, changed in table.rows():
                for index, value in changed.items():
                    cells[index] = "" if value is None else formats[index](value)
                writer.writerow([seconds_text(time), *cells])
                count += 1
    except OSError as error:
        raise unwritable(output, error) from error
    return count
