"""The scans of one task as a table: what each latched, what its END wrote back, and its errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from automax_ros.bags.columns import Column, column, count_column
from automax_ros.bags.common_log import Cell, CommonLog
from automax_ros.bags.errors import BagError
from automax_ros.bags.reader import BagReader
from automax_ros.bags.run_facts import run_facts
from automax_ros.bags.series import WHOLE_RUN, Progress, Window
from automax_ros.core.text import did_you_mean
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType
from automax_ros.wire.messages import Scan, VariableTable

_TYPES = frozenset(f"automax_msgs/msg/{name}" for name in ("Scan", "VariableTable"))
_OWN = (
    count_column("scan"),
    count_column("duration_ns", "ns"),
    count_column("skipped"),
    count_column("errors"),
    count_column("error_line"),
    count_column("error_code"),
)
"""What every scan says of itself; line and code are those of its first error, 0 without one."""


class ScanTable:
    """The scans of one task: one row per scan from scan 1 on, in the window.

    Columns: ``scan``, ``duration_ns``, ``skipped``, ``errors`` (how many), ``error_line``, ``error_code`` (of the
    first), then ``in.NAME`` for each variable that the task latches and ``out.NAME`` for each that its END writes back.
    An ``out`` value holds until END writes it again. After missing scans the ``in`` values are unknown until the
    recording tells them all. The recording is read twice: first to find the columns.

    Raises:
        BagError: the recording cannot be read, has no table of variables, or has no scan of the task.
    """

    def __init__(self, bag: Path, task: str, window: Window = WHOLE_RUN, progress: Progress | None = None) -> None:
        self._bag = bag
        self._window = window
        self._task = task.upper()
        self._progress = progress
        self._reader = BagReader(bag)
        self._log = CommonLog(bag, run_facts(self._reader))
        self._variables = {item.id: item for item in self._log.variables.values()}
        self._columns: list[Column] = list(_OWN)
        self._latched: dict[tuple[int, int], int] = {}
        self._committed: dict[tuple[int, int], int] = {}
        self._find_columns()

    @property
    def columns(self) -> Sequence[Column]:
        """The columns after the time."""
        return self._columns

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """Return the rows: time of the latch, and the cells that differ from the row before.

        Raises:
            BagError: the recording is damaged, or the window holds no scan.
        """
        held: dict[int, Cell | None] = {}
        before: int | None = None
        found = False
        last = 0
        for last, scan in self._scans(first_half=False):
            if before is not None and scan.scan > before + 1 and not scan.full:
                held.update((index, None) for index in self._latched.values())
            for columns, values in ((self._latched, scan.latched), (self._committed, scan.committed)):
                held.update((columns[entry[:2]], entry[2]) for entry in self._log.entries(values, scan.stamp))
            before = scan.scan
            if scan.scan and last >= self._window.start_ns:
                found = True
                held.update(_own_cells(scan))
                yield last, held
                held = {}
        if not found:
            hint = f"the last one in reach is at {seconds_text(last)} s"
            raise BagError("AMX6825", self._bag, f"holds no scan of {self._task} in the range asked for", hint)

    def _scans(self, *, first_half: bool) -> Iterator[tuple[int, Scan]]:
        """The task's scans up to the end of the window."""
        reader = self._reader
        if self._progress is not None:
            progress = self._progress
            reader.on_progress = lambda share: progress(share / 2 if first_half else (1 + share) / 2)
        tasks: set[str] = set()
        for entry in reader.messages(types=_TYPES):
            message = entry.message
            if isinstance(message, VariableTable):
                self._log.check_table(message)
            elif isinstance(message, Scan):
                if len(tasks) < _MOST_NAMES:
                    tasks.add(message.task)
                if message.task != self._task:
                    continue
                time = max(0, message.stamp - self._log.facts.table.stamp)
                if self._window.end_ns is not None and time > self._window.end_ns:
                    break
                yield time, message
        if first_half and self._task not in tasks:
            raise self._unknown_task(tasks)

    def _find_columns(self) -> None:
        latched: dict[tuple[int, int], None] = {}
        committed: dict[tuple[int, int], None] = {}
        for _, scan in self._scans(first_half=True):
            latched.update(dict.fromkeys(zip(scan.latched.variable, scan.latched.element, strict=False)))
            committed.update(dict.fromkeys(zip(scan.committed.variable, scan.committed.element, strict=False)))
        self._latched = self._add("in", latched)
        self._committed = self._add("out", committed)

    def _add(self, direction: str, keys: Mapping[tuple[int, int], None]) -> dict[tuple[int, int], int]:
        """Add a column for each variable in the order of the rack's table; return their indices."""
        indices: dict[tuple[int, int], int] = {}
        for number, element in sorted(keys):
            variable = self._variables.get(number)
            if variable is None or element:
                text = f"a scan of {self._task} names variable {number}, element {element}, which a scan cannot latch"
                raise BagError("AMX6813", self._bag, text)
            indices[number, element] = len(self._columns)
            label = f"{direction}.{variable.name}"
            self._columns.append(column(label, DataType.numbered(variable.type), variable.unit))
        return indices

    def _unknown_task(self, tasks: set[str]) -> BagError:
        names = sorted(tasks)
        there = f"there are {', '.join(names[:8])}" if names else "it holds no scans at all"
        hint = did_you_mean(self._task, names) or there
        return BagError("AMX6827", self._bag, f"holds no scan of a task {self._task[:40]!r}", hint)


_MOST_NAMES = 1000
"""Names of tasks that are kept for the hint; a rack has fewer."""


def _own_cells(scan: Scan) -> dict[int, Cell | None]:
    line, code = (scan.errors[0].line, scan.errors[0].code) if scan.errors else (0, 0)
    return dict(enumerate((scan.scan, scan.duration_ns, scan.skipped, len(scan.errors), line, code)))
