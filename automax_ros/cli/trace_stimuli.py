"""What ``automax trace --stimuli`` does before each scan: what the file says up to that time, then a row's cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import count

from automax_ros.cli.trace_input import InputTable
from automax_ros.rack.stimuli.player import Stimulation
from automax_ros.rack.stimuli.stage import Stimulus
from automax_ros.running.lone_task import LoneTask
from automax_ros.running.scheduler import Scheduler


class StimulatedScans:
    """Scans by the clock of a task alone, from 0 on: one for each row of a table, or as many as a duration has.

    Without both the last scan is the first one at or after the end of the last entry (decision).
    Entries of a scan's instant happen before its row is set, so a cell has the last word (decision).
    """

    def __init__(
        self, lone: LoneTask, stimuli: Sequence[Stimulus], table: InputTable | None, duration_ns: int | None
    ) -> None:
        """Take a table, a duration, or both: the shorter counts; without both the entries must come to an end."""
        self._period_ns = lone.task.period_ns
        self._scheduler = Scheduler()
        self._stimulation = Stimulation(stimuli, self._scheduler)
        self._table = table
        self._most = None if duration_ns is None else -(-duration_ns // self._period_ns)
        self._done = 0

    @property
    def size(self) -> int:
        """How much there is to do, in units of ``position``; 0 where nobody knows."""
        return self._table.size if self._table is not None else self._most or 0

    @property
    def position(self) -> int:
        """How much is done."""
        return self._table.position if self._table is not None else self._done

    def begin(self) -> None:
        """Let the entries of time 0 happen: before what stands before SCAN_LOOP."""
        self._stimulation.begin()

    def rows(self) -> Iterator[int]:
        """Yield a number before each scan, once everything is set for it."""
        rows = iter(self._table.rows() if self._table is not None else count())
        for number in self._numbers():
            self._scheduler.run_until(number * self._period_ns + 1)
            if next(rows, None) is None:
                return
            yield number
            self._done = number

    def _numbers(self) -> Iterable[int]:
        if self._most is not None:
            return range(self._most)
        return count() if self._table is not None else self._until_over()

    def _until_over(self) -> Iterator[int]:
        for number in count():
            yield number
            if self._stimulation.is_over:
                return
