"""Executes by columns what an edited task does where its values are no longer the recorded ones, and counts that.

The task gets the recorded inputs, and of its own outputs what it has left itself. It goes scan by scan where somebody
else writes these outputs, where a statement reads or writes what the recorded one did not, and where something differs
for the first time.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.types import DataType
from automax_ros.replay.columns.entries import Entries, Ints
from automax_ros.replay.columns.execution import Executed
from automax_ros.replay.columns.library import ColumnLibrary
from automax_ros.replay.columns.scans import ScanColumns, WriteColumns
from automax_ros.replay.columns.stretch import FEWEST_SCANS, TaskForm, TaskStretches
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.compare import Stretch
from automax_ros.replay.scans.task import TaskReplay

_FIRST_WINDOW = 256
"""Scans that are tried at first, and twice as many each time that all of them went by columns (decision)."""
_MOST_WAITED = 256
"""Most scans that go one by one before columns are tried again where they were of no use (decision)."""


@dataclass(frozen=True)
class _Prepared:
    """Scans to execute; a row of values for each view that the task latches, ``recorded_latch`` as it was recorded.

    ``views`` are those that the task of either source writes. A row for each of them has in ``recorded`` its value
    after each recorded scan, and in ``own`` what the task had left in it before the first one.
    """

    scans: ScanColumns
    recorded_latch: Ints
    latched: Ints
    views: Ints
    recorded: Ints
    own: Ints

    def part(self, count: int) -> _Prepared:
        """Return the first ``count`` scans."""
        return replace(self, scans=self.scans.part(0, count), recorded=self.recorded[:, :count])


@dataclass(frozen=True)
class _Found:
    """What scans wrote: a row for each of ``views`` with its values after each scan, recorded and the task's own.

    Numbers that differ by at most ``tolerance`` count as equal.
    """

    scans: ScanColumns
    views: Ints
    recorded: Ints
    own: Ints
    booleans: NDArray[np.bool_]
    tolerance: float

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Which values differ, by more than the tolerance."""
        far: NDArray[np.bool_] = np.abs(self.own - self.recorded) > self.tolerance
        far[self.booleans] = True
        far &= self.own != self.recorded
        return far

    def part(self, count: int) -> _Found:
        """Return the first ``count`` scans."""
        return replace(
            self, scans=self.scans.part(0, count), recorded=self.recorded[:, :count], own=self.own[:, :count]
        )

    def before(self, is_new: Callable[[int], bool]) -> int:
        """Return how many scans stand before one in which a view that ``is_new`` differs."""
        rows = [row for row, view in enumerate(self.views.tolist()) if is_new(view)]
        return _first(np.logical_or.reduce(self.counts[rows]))

    def stretches(self) -> dict[Hashable, Stretch]:
        """Return the values of each view."""
        rows = zip(self.recorded, self.own, self.counts, self.booleans.tolist(), strict=True)
        return {(view, 0): Stretch(*row) for view, row in zip(self.views.tolist(), rows, strict=True)}


class ApartStretches:
    """Replays scans of one edited task by columns, whether or not they differ.

    ``writer`` is the task's number in the log of writes.
    """

    def __init__(
        self,
        replay: TaskReplay,
        stretches: TaskStretches,
        commons: RecordedCommons,
        library: ColumnLibrary,
        writer: int,
    ) -> None:
        self._replay, self._stretches, self._commons = replay, stretches, commons
        self._library, self._writer = library, writer
        self._window = _FIRST_WINDOW
        self._waits = self._to_wait = 0

    @property
    def is_due(self) -> bool:
        """Whether columns are to be tried for the next scan; counts those for which they are not."""
        if self._waits:
            self._waits -= 1
            return False
        return self._replay.goes_alone

    def take(self, scans: ScanColumns, writes: WriteColumns, *, counted: bool) -> int:
        """Execute scans and count what differs; return how many were executed. ``writes`` follow the present memory."""
        wanted = min(len(scans), self._window)
        prepared = self._prepare(scans.part(0, wanted), writes, counted=counted)
        taken = 0 if prepared is None else self._execute(prepared, counted=counted)
        if taken:
            self._to_wait = 0
            self._window = 2 * self._window if taken == wanted else max(2 * taken, _FIRST_WINDOW // 4)
        else:
            self._waits = self._to_wait = min(2 * self._to_wait + 1, _MOST_WAITED)
        return taken

    def concern(self, writes: WriteColumns) -> bool:
        """Return whether somebody else writes what the task has left different from the recorded values."""
        memory = self._replay.memory
        others = np.repeat(writes.writers != self._writer, writes.entries.counts)
        return not memory.is_alone or bool(
            np.isin(writes.entries.views[others], [view for view, _ in memory.apart]).any()
        )

    def _prepare(self, scans: ScanColumns, writes: WriteColumns, *, counted: bool) -> _Prepared | None:
        """Return the scans up to the first that must be executed by itself; None where they are few."""
        memory, form = self._replay.memory, self._stretches.present_form()
        scans = scans.part(0, self._plain(scans))
        views = self._written_views(scans, form)
        if views is None or (counted and memory.apart and not self._replay.has_compared):
            return None
        scans = scans.part(0, self._before_others(scans, writes, views))
        unlatched = [place for place in sorted(memory.unrecorded) if form.views[place] not in views]
        known = self._memory(scans, writes, [*views.tolist(), *form.views[unlatched].tolist()])
        if known is None:
            return None
        recorded_latch = form.latched.columns(scans.latched, [int(value) for value in memory.latched_last])
        latched = recorded_latch.copy()
        latched[unlatched] = known[len(views) :]
        own = known[: len(views), 0].copy()
        for (view, _), value in memory.apart.items():
            own[np.searchsorted(views, view)] = int(value)
        count = len(scans)
        for place in np.flatnonzero(np.isin(form.views, views)).tolist():
            row = int(np.searchsorted(views, form.views[place]))
            if place not in memory.unrecorded:
                count = min(count, _first(latched[place] != known[row]))
            latched[place] = own[row]
        recorded = known[: len(views)].copy()
        scan_of = np.repeat(np.arange(len(scans)), scans.committed.counts)
        recorded[np.searchsorted(views, scans.committed.views), scan_of] = scans.committed.values
        prepared = _Prepared(scans, recorded_latch, latched, views, recorded, own)
        return prepared.part(count) if count >= FEWEST_SCANS else None

    def _plain(self, scans: ScanColumns) -> int:
        """Return how many scans follow each other and write nothing outside of their latch."""
        if not len(scans) or not self._commons.unforced_since(int(scans.stamps.min())):
            return 0
        following = scans.scans - np.arange(len(scans)) == self._replay.last_scan + 1
        return _first(~following | (scans.written.counts != 0) | scans.full)

    def _written_views(self, scans: ScanColumns, form: TaskForm) -> Ints | None:
        """Return the views that scans of either source write, ascending; None where one is not a simple number."""
        apart = list(self._replay.memory.apart)
        views = np.unique(np.concatenate((form.written, scans.committed.views, [view for view, _ in apart])))
        views = views.astype(np.int64)
        is_simple = all(map(self._is_whole, views.tolist())) and not any(element for _, element in apart)
        return views if is_simple else None

    def _is_whole(self, view: int) -> bool:
        """Return whether a view is one whole number, or BOOLEAN, that no other view shows."""
        variable = self._commons.rack[view]
        is_alone = variable.elements == 1 and view not in self._commons.registers.views
        return is_alone and variable.type not in (DataType.REAL, DataType.STRING)

    def _before_others(self, scans: ScanColumns, writes: WriteColumns, views: Ints) -> int:
        """Return how many scans stand before a write of these views by somebody else, and read none of them."""
        counts = writes.entries.counts
        foreign = np.repeat(writes.writers != self._writer, counts) & np.isin(writes.entries.views, views)
        bad = np.concatenate((writes.places[~writes.good], np.repeat(writes.places, counts)[foreign]))
        before = scans.places < (bad.min() if len(bad) else np.iinfo(np.int64).max)
        before[np.repeat(np.arange(len(scans)), scans.read.counts)[np.isin(scans.read.views, views)]] = False
        return _first(~before)

    def _memory(self, scans: ScanColumns, writes: WriteColumns, views: list[int]) -> Ints | None:
        """Return a row for each view with its recorded value before each scan; None where one is not known."""
        keys = [(view, 0) for view in views]
        is_known = all(map(self._is_whole, views)) and all(map(self._commons.is_known, keys))
        if len(scans) < FEWEST_SCANS or not is_known:
            return None
        positions = np.full(len(self._commons.rack), -1, np.int64)
        positions[views] = np.arange(len(views))
        entries = writes.entries
        ends = entries.offsets[np.searchsorted(writes.places, scans.places)]
        by_scan = Entries(np.insert(ends, 0, 0), entries.views, entries.elements, entries.values)
        return self._library.latched(by_scan, positions, [int(self._commons.value(key)) for key in keys])

    def _execute(self, prepared: _Prepared, *, counted: bool) -> int:
        """Execute as many scans as can be executed and counted together; return how many."""
        form, replay = self._stretches.present_form(), self._replay
        before = [value[:] if isinstance(value, list) else value for value in form.task.state]
        executed = form.execute(prepared.latched, prepared.scans, latches_own=True)
        found = self._found(prepared.part(executed.done), form, executed)
        done = min(self._stretches.same_errors(found.scans, executed), _first(executed.written.counts != 0))
        if counted:
            done = min(done, found.before(lambda view: not replay.has_differed((view, 0))))
        if done < executed.done:
            form.task.state[:] = before
            prepared = prepared.part(done)
            executed = form.execute(prepared.latched, prepared.scans, latches_own=True)
        if not done:
            return 0
        found = found.part(done)
        replay.skip(form.skipped(found.scans, executed, prepared.recorded_latch[:, done - 1], counted=counted))
        if counted:
            replay.count_apart(found.stretches(), found.scans.scans, found.scans.stamps)
        self._leave(found)
        return done

    def _found(self, prepared: _Prepared, form: TaskForm, executed: Executed) -> _Found:
        outputs = dict(zip(form.written.tolist(), executed.outputs, strict=True))
        own = prepared.recorded.copy()
        for row, view in enumerate(prepared.views.tolist()):
            own[row] = outputs.get(view, prepared.own[row])
        booleans = np.array([self._commons.rack[view].type is DataType.BOOLEAN for view in prepared.views], bool)
        return _Found(prepared.scans, prepared.views, prepared.recorded, own, booleans, self._replay.tolerance)

    def _leave(self, found: _Found) -> None:
        """Leave the task's own values where they are not the recorded ones."""
        apart = self._replay.memory.apart
        apart.clear()
        for row in np.flatnonzero(found.own[:, -1] != found.recorded[:, -1]).tolist():
            value = int(found.own[row, -1])
            apart[int(found.views[row]), 0] = value != 0 if found.booleans[row] else value


def _first(marks: NDArray[np.bool_]) -> int:
    """Return the place of the first mark, the number of places without one."""
    return int(np.argmax(marks)) if marks.any() else len(marks)
