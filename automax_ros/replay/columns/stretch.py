"""Executes stretches of one task's scans by columns, and compares them with the recorded ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from automax_ros.core.types import DataType, type_of_name
from automax_ros.replay.columns.entries import Entries, Ints, ValueRules, first_other
from automax_ros.replay.columns.execution import ColumnForm, Executed
from automax_ros.replay.columns.forms import ColumnForms
from automax_ros.replay.columns.library import ColumnLibrary
from automax_ros.replay.columns.scans import ScanColumns
from automax_ros.replay.scans.carried_state import Skipped
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.task import TaskReplay
from automax_ros.runtime.tasks.task import Task


class LatchedColumns:
    """Builds columns of the values that a task latched, in its order of views, from the newly latched entries."""

    def __init__(self, views: Sequence[int], count: int, library: ColumnLibrary) -> None:
        """Create the columns of the task's views; ``count`` is the rack's number of views."""
        self._count, self._library = len(views), library
        self._positions = np.full(count, -1, np.int64)
        self._positions[list(views)] = np.arange(len(views))

    def whole(self, scans: ScanColumns) -> int:
        """Return the number of scans before the first full one that lacks latched values."""
        entries = scans.latched
        for row in np.flatnonzero(scans.full).tolist():
            found = self._positions[entries.views[entries.offsets[row] : entries.offsets[row + 1]]]
            if len(np.unique(found[found >= 0])) != self._count:
                return int(row)
        return len(scans)

    def columns(self, entries: Entries, before: Sequence[int]) -> Ints:
        """Return a row for each view with its value in each scan; ``before`` are the values before the first."""
        return self._library.latched(entries, self._positions, before)


FEWEST_SCANS = 16
"""Shorter stretches are executed scan by scan (decision: columns cost as much as that many scans)."""


@dataclass(frozen=True)
class TaskForm:
    """The form in which the present task is executed."""

    task: Task
    columns: ColumnForm
    latched: LatchedColumns
    views: Ints
    """The latched views."""
    written: Ints
    """The views of the outputs."""
    places: Ints
    """The places of the outputs among the latched views."""
    flags: tuple[bool, ...]
    """Which of the latched views are BOOLEANs."""

    def execute(self, latched: Ints, scans: ScanColumns, *, latches_own: bool = False) -> Executed:
        """Execute scans, with a row of values for each latched view; see ``ColumnForm``."""
        return self.columns.columns(self.task.state, list(latched), len(scans), scans.read, latches_own=latches_own)

    def skipped(self, scans: ScanColumns, executed: Executed, latched: Ints, *, counted: bool) -> Skipped:
        """Return what scan-by-scan replay needs of the executed scans; ``latched`` is the last one's latch."""
        last = executed.done - 1
        return Skipped(
            count=executed.done,
            scan=int(scans.scans[last]),
            stamp=int(scans.stamps[last]),
            duration_ns=int(scans.durations[last]),
            latched=[value != 0 if flag else value for value, flag in zip(latched.tolist(), self.flags, strict=True)],
            errors=[(int(scans.scans[row]), line, code) for row, line, code in executed.errors.tolist()],
            counted=counted,
        )


class TaskStretches:
    """Replays scans of one task by columns as far as nothing differs; the rest must be replayed one by one.

    A doubtful scan counts as different: scan-by-scan replay decides about it.
    """

    def __init__(
        self,
        replay: TaskReplay,
        commons: RecordedCommons,
        rules: ValueRules,
        forms: ColumnForms,
        library: ColumnLibrary,
    ) -> None:
        self._replay, self._commons, self._rules = replay, commons, rules
        self._forms, self._library = forms, library
        self._form: TaskForm | None = None

    def take(self, scans: ScanColumns, *, counted: bool) -> int:
        """Execute scans and compare them; return how many, from the first on, did not differ."""
        replay = self._replay
        if len(scans) < FEWEST_SCANS or not replay.is_uniform:
            return 0
        form = self.present_form()
        scans = scans.part(0, self._uniform(scans, form))
        if len(scans) < FEWEST_SCANS:
            return 0
        latched = form.latched.columns(scans.latched, [int(value) for value in replay.memory.latched_last])
        state = form.task.state
        before = [value[:] if isinstance(value, list) else value for value in state]
        executed = form.execute(latched, scans)
        same = self._count_equal(scans, executed, latched, form)
        if same < executed.done:
            state[:] = before
            executed = form.execute(latched, scans.part(0, same))
        if same:
            replay.skip(form.skipped(scans, executed, latched[:, same - 1], counted=counted))
        return same

    def present_form(self) -> TaskForm:
        """Return the form of the present task, which may have been reloaded."""
        task = self._replay.task
        if self._form is None or self._form.task.compiled is not task.compiled or self._form.task is not task:
            compiled = task.compiled
            views = [task.memory.view(name) for name in compiled.latched]
            places = {name: place for place, name in enumerate(compiled.latched)}
            self._form = TaskForm(
                task,
                self._forms.form(compiled, views),
                LatchedColumns(views, self._rules.count, self._library),
                np.array(views, np.int64),
                np.array([task.memory.view(name) for name in compiled.written], np.int64),
                np.array([places[name] for name in compiled.written], np.int64),
                tuple(type_of_name(name) is DataType.BOOLEAN for name in compiled.latched),
            )
        return self._form

    def _uniform(self, scans: ScanColumns, form: TaskForm) -> int:
        """Return how many scans can be executed by columns: they are consecutive, and nothing is forced."""
        replay = self._replay
        if not self._commons.unforced_since(int(scans.stamps.min())):
            return 0
        following = scans.scans - np.arange(len(scans)) == replay.last_scan + 1
        if replay.edited:
            # An edited scan that writes before it reads may find its own value or another's.
            following &= (scans.read.counts == 0) | (scans.written.counts == 0)
        count = len(scans) if following.all() else int(np.argmin(following))
        return min(count, form.latched.whole(scans))

    def _count_equal(self, scans: ScanColumns, executed: Executed, latched: Ints, form: TaskForm) -> int:
        """Return how many scans have the recorded results."""
        done = executed.done
        if not done:
            return 0
        scans = scans.part(0, done)
        return min(
            self._library.same_commits(
                scans.committed, executed.outputs, list(latched[form.places, :done]), form.written
            ),
            first_other(scans.written, executed.written),
            self.same_errors(scans, executed),
        )

    def same_errors(self, scans: ScanColumns, executed: Executed) -> int:
        """Return how many of the executed scans logged the same errors; in an edited task lines do not count."""
        rows, lines, codes = np.ascontiguousarray(executed.errors.T)
        offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(np.bincount(rows, minlength=len(scans)))))
        recorded, own = scans.errors, Entries(offsets, lines, codes, np.zeros(len(codes)))
        if self._replay.edited:
            recorded = replace(recorded, views=np.zeros_like(recorded.views))
            own = replace(own, views=np.zeros_like(lines))
        return first_other(recorded, own)
