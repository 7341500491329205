"""Executes the recorded scans of one task again, scan by scan."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import seconds_text
from automax_ros.messages.types.messages import CommonWrite, Operation, Scan, TaskState
from automax_ros.rack.tasks.installation import task_class
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Key
from automax_ros.replay.scans.carried_state import PartStart, Skipped
from automax_ros.replay.scans.commons import RecordedCommons, UnknownValue
from automax_ros.replay.scans.compare import DifferenceCounts, Found, Ints, Stretch
from automax_ros.replay.scans.comparison import ScanComparison
from automax_ros.replay.scans.inputs import ReplayMemory
from automax_ros.replay.scans.report import DifferenceKind
from automax_ros.replay.scans.state import fitting_state, held_in, log_is_empty, state_differences, whole_state
from automax_ros.replay.scans.stored_rack import ReplaySource, unknown_value
from automax_ros.replay.scans.totals import MOST_NOTES, TaskTotals
from automax_ros.replay.scans.tunables import Tunables
from automax_ros.runtime.scan.error_log import snapshot_layout
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, OVERLAP, ScanRecord, Status, Task

_MOST_NAMES = 8
_STOPPED_KEY = "status"
_QUIET_SCANS = 2
"""A task that has not scanned for more periods than this no longer runs."""


Scanned = Callable[[int, int], ScanRecord | None]
"""Executes a scan: rack time in ns, and how many were skipped before it."""


def execute(bag: Path, task: Task, scan: Scan, now_ns: int, scanned: Scanned) -> ScanRecord | None:
    """Execute a scan at an instant of rack time, by ``scanned``; None if the task no longer runs.

    Raises:
        BagError: it cannot be executed with the recorded state, which no task can have.
    """
    try:
        if scan.scan == 0:
            return task.run(now_ns)
        task.scan_number = scan.scan - 1
        return _overlap(task, scan, now_ns) or scanned(now_ns, scan.skipped)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        what = f"scan {scan.scan} of task {task.name} cannot be executed: {error}"
        hint = "its recorded state is none that the task can have"
        raise BagError("AMX6813", bag, what, hint) from error


def _overlap(task: Task, scan: Scan, now_ns: int) -> ScanRecord | None:
    """Fault the task where the recorded one was faulted for its time, which no execution of a source can show."""
    code = next((error.code for error in scan.errors if error.code in (OVERLAP, EVENT_TIMEOUT)), None)
    return None if code is None else task.fault(code, now_ns)


class TaskReplay:
    """Executes the scans of one task again and counts differences in ``tallies``.

    ``starts_at`` is the log time of the TaskState to begin with; None begins with the first one, or with the task's
    start.
    """

    def __init__(
        self,
        bag: Path,
        source: ReplaySource,
        commons: RecordedCommons,
        tallies: DifferenceCounts,
        *,
        tolerance: float = 0.0,
        starts_at: int | None = None,
    ) -> None:
        self.name = source.name
        self.memory = ReplayMemory(commons, edited=source.edited)
        self._bag, self._commons, self._tallies = bag, commons, tallies
        self._comparison = ScanComparison(source, commons, self.memory, tallies, tolerance)
        self._tolerance = tolerance
        self._starts_at = starts_at
        self._task = task_class(source.compiled.program)(
            source.compiled,
            self.memory,
            backplane=commons.backplane,
            channels=self.memory.channels,
            drives=self.memory.drive,
        )
        self._task.record_scans()
        self._last: int | None = None
        self._last_stamp = self._last_end = 0
        self._recorded_ended = False
        self._synchronous = False
        self._stored_ran: bool | None = None
        self._stopped_in: int | None = None
        self._installed_again = False
        self._compared = self._different = self._states = self._left_out = 0
        self._notes: dict[str, None] = {}
        self.beginning = PartStart()
        self._take_up(source)

    def totals(self) -> TaskTotals:
        """Return the totals of the task so far."""
        source = self._source.source.name if self._source.edited else "as recorded"
        counts = self._compared, self._different, self._states, self._left_out
        return TaskTotals(self.name, source, self._source.edited, *counts, tuple(self._notes))

    @property
    def carried(self) -> tuple[object, ...]:
        """The state that determines later scans, except what a run that begins with a file cannot know.

        ``carried_state`` lists that, and says why it does not matter.
        """
        task, edited = self._task, self._source.edited
        state = task.snapshot(), sorted(task.forces.items()), task.scan_number
        follows = self._last, self._synchronous, self._installed_again, self._stored_ran, self._starts_at
        ends = (self.stopped, self._stopped_in, self._recorded_ended) if edited else ()
        return (
            self._source.compiled.program.source_hash,
            *state,
            *follows,
            *ends,
            self._tunables.known,
            self.memory.carried,
        )

    @property
    def stopped(self) -> bool:
        """Whether the task no longer runs."""
        return self._task.status is not Status.RUNNING or self._stopped_in is not None

    @property
    def edited(self) -> bool:
        """Whether a different source runs than the recorded one."""
        return self._source.edited

    @property
    def stopped_in(self) -> int | None:
        """The last recorded scan, if the task stopped in it by itself."""
        return self._stopped_in

    @property
    def end_in_doubt(self) -> bool:
        """Whether only one of the recorded task and an edited one seems to have ended after the last scan.

        The recording does not show why a task no longer scans; executing its own source again does.
        """
        if not self._source.edited or self._source.recorded is None or not self._synchronous:
            return False
        return self._stopped_in is not None or (self._recorded_ended and self._task.status is Status.RUNNING)

    def compare_end(self, recorded_in: int | None) -> None:
        """Compare the end with that of the recorded source, which stops by itself in this scan, None if never."""
        own_in = self._stopped_in
        if own_in == recorded_in or self._last is None:
            return
        recorded = "runs" if recorded_in is None else "ended by itself"
        replayed = "runs" if own_in is None else self._end_text()
        found = [Found(DifferenceKind.STATUS, _STOPPED_KEY, recorded, replayed)]
        scan = (own_in if recorded_in is None else recorded_in) or self._last
        self._different += self._comparison.tally(scan, self._last_stamp, found)
        self._stopped_in = None

    def time_s(self, stamp: int) -> float:
        """Return the time of a stamp since the start of the run."""
        return self._tallies.time_s(stamp)

    def take_scan(self, scan: Scan, *, counted: bool) -> bool:
        """Execute a recorded scan again and compare, or only execute it if it is not ``counted``.

        Returns whether it could be executed.

        Raises:
            BagError: it does not fit the rack, or needs a value that is not in the recording.
        """
        self._follow(scan)
        if not self._synchronous:
            self._left_out += counted
            return False
        if counted and self.memory.apart and not self._compared:
            self._note(f"differed before {self._when(scan.stamp)} s already: it ran from the recorded state before it")
        try:
            self.memory.begin(scan)
            record = self._execute(scan)
            changes = self.memory.finish(record.commits) if record is not None else []
        except UnknownValue as error:
            self._lose(scan, error)
            self._left_out += counted
            return False
        if record is None:
            if counted:
                self._count_stopped(scan)
            return False
        if counted:
            self._compared += 1
            self._different += self._comparison.scan(scan, record, changes)
        return True

    @property
    def task(self) -> Task:
        """The replayed task."""
        return self._task

    @property
    def last_scan(self) -> int:
        """The number of the last scan."""
        return self._last or 0

    @property
    def is_uniform(self) -> bool:
        """Whether its next scans depend only on their latched and read values, and nothing has differed so far."""
        return self._follows and self.memory.is_uniform and self._tallies.is_clean(self.name)

    @property
    def goes_alone(self) -> bool:
        """Whether the next scans of an edited source depend only on recorded inputs and on what it has left itself."""
        return self.edited and self._follows and self.memory.is_alone

    @property
    def _follows(self) -> bool:
        program = self._task.compiled.program
        scans_here = not (program.is_basic or program.cml is not None or self._task.forces or self.stopped)
        return scans_here and self._synchronous and self._starts_at is None and self.beginning.is_settled

    @property
    def tolerance(self) -> float:
        """Numbers that differ by at most this count as equal."""
        return self._tolerance

    @property
    def has_compared(self) -> bool:
        """Whether a scan was compared before."""
        return self._compared > 0

    def has_differed(self, key: Key) -> bool:
        """Return whether a common of this task has differed before."""
        return self._tallies.has(self.name, key)

    def count_apart(self, found: Mapping[Hashable, Stretch], scans: Ints, stamps: Ints) -> None:
        """Count the differences of skipped scans (``DifferenceCounts.stretches``)."""
        self._different += self._tallies.stretches(self.name, found, scans, stamps)

    def skip(self, skipped: Skipped) -> None:
        """Account for scans that were executed by columns, from the task's state on, without a difference."""
        self.memory.follow_skipped(skipped.latched)
        for scan, line, code in skipped.errors:
            self._task.scan_number = scan
            self._task.log_error(line, code)
        self._task.scan_number = self._last = skipped.scan
        self._last_stamp, self._last_end = skipped.stamp, skipped.stamp + skipped.duration_ns
        self._recorded_ended = False
        self._compared += skipped.count if skipped.counted else 0

    def take_state(self, state: TaskState, log_time: int, *, counted: bool) -> None:
        """Begin with a recorded state, or compare it with ours; repeat what an operator has done since.

        Between two scans a state changes only by operations: a tunable was set, a local forced, the error log
        cleared, the task installed again.

        Raises:
            BagError: it does not fit the task.
        """
        stored_ran = self._follow_source(state)
        if self._starts_at is not None:
            if log_time != self._starts_at:
                return
            self._starts_at = None
            self._synchronous = False
        last, between = self._last, state.stamp > self._last_stamp
        if last is not None:
            clears = log_is_empty(state) and self._task.errors.count > 0
            self.beginning.asks_back(self._source.edited or state.scan != last or clears)
        if not stored_ran or (last is not None and state.scan < last and not between):
            return
        if last is not None and (state.scan < last or self._installed_again):
            self._note(f"installed again at {self._when(state.stamp)} s")
            self._synchronous = self._installed_again = False
        if state.scan == last and state.stamp - self._last_stamp > _QUIET_SCANS * self._period_ns:
            self._recorded_ended = True
        if self._synchronous and last is not None and state.scan > last:
            self._note(f"scans {last + 1} to {state.scan} are missing before {self._when(state.stamp)} s")
            self._synchronous = False
            self.memory.forget_latch()
        if not self._synchronous:
            self._adopt(state)
            return
        self._tunables.set_again(self._task, state)
        self._follow_forces(state)
        if between and log_is_empty(state):
            self._task.clear_errors()
        if counted and not self._source.edited and not self._tolerance and state.layout_hash == self._layout_hash:
            self._compare_state(state)

    def take_own(self, write: CommonWrite) -> None:
        """Record a write that a modeled scan made before it ended, and so before the scan is in the log."""
        self.beginning.asks_back(self._source.edited)
        if write.kind == WriteKind.BASIC and write.stamp > self._last_end:
            for key in zip(write.values.variable, write.values.element, strict=False):
                self.memory.written_early(key)

    def take_operation(self, operation: Operation) -> None:
        """Remember if the task was installed again: its next state does not result from its scans then.

        If the task's module loses locals, they are cleared here, too.
        """
        if operation.ok and operation.what in ("stop_all", "power_off") and not self._source.keeps_locals:
            self._task.lose_locals()
        installs = operation.what in ("reload", "delete") or (operation.what == "power_on" and not self._last)
        self._installed_again |= operation.ok and operation.task in ("", self.name) and installs

    def _follow(self, scan: Scan) -> None:
        """Follow the numbers of scans and the latched values."""
        self.beginning.scans(scan)
        if scan.scan == 0:
            first = self._last is None and self._starts_at is None
            if self._last:
                self._note(f"went into RUN again at {self._when(scan.stamp)} s")
            self._synchronous = self._synchronous or first
        elif self._last is not None and scan.scan != self._last + 1:
            self._note(
                f"scans {self._last + 1} to {scan.scan - 1} are missing before {self._when(scan.stamp)} s; "
                "it continues from the next recorded state"
                if scan.scan > self._last
                else f"scan {scan.scan} follows on {self._last} at {self._when(scan.stamp)} s"
            )
            self._synchronous = False
            self.memory.forget_latch()
            self.memory.apart.clear()
        self._last, self._last_stamp, self._last_end = scan.scan, scan.stamp, scan.stamp + scan.duration_ns
        self._recorded_ended = False
        self.memory.follow(scan)

    def _execute(self, scan: Scan) -> ScanRecord | None:
        """Execute a scan; None if the task no longer runs."""
        if scan.scan == 0:
            self._stopped_in = None
        # Rack time: on the wall clock stamps are the time of day.
        record = execute(self._bag, self._task, scan, max(0, scan.stamp - self._tallies.origin), self._scanned)
        if record is not None and self._task.status is not Status.RUNNING:
            self._stopped_in = scan.scan
        return record

    def _scanned(self, now_ns: int, skipped: int) -> ScanRecord | None:
        return self._task.scan(now_ns, skipped)

    def _compare_state(self, state: TaskState) -> None:
        self._states += 1
        found = [
            Found(DifferenceKind.STATE, name, one, other)
            for name, one, other in state_differences(self._bag, self._task, state)
        ]
        self._tallies.states(self.name, state.scan, state.stamp, found, self._comparison.label, self._comparison.seen)
        self._different += bool(found)

    def _count_stopped(self, scan: Scan) -> None:
        """Count a scan of the recorded task after the replayed one has stopped."""
        if self._stopped_in is None:
            return
        reason = self._end_text()
        self._note(f"stopped in scan {self._stopped_in}, {reason}; the scans after it are not compared")
        self._stopped_in = None
        found = [Found(DifferenceKind.STATUS, _STOPPED_KEY, "runs", reason)]
        self._different += self._comparison.tally(scan.scan, scan.stamp, found)

    def _end_text(self) -> str:
        log = self._task.errors
        fault = log.last.describe() if self._task.status is Status.FAULTED and log.last else None
        return f"faulted: {fault}" if fault else "ended by STOP"

    def _adopt(self, state: TaskState) -> None:
        """Continue from a recorded state."""
        same_layout = not self._source.edited and state.layout_hash == self._layout_hash
        if same_layout:
            taken = whole_state(self._bag, self._layout, state)
        else:
            fresh = self._tunables.fresh(state)
            before = self._recorded_layout
            known = before if before is not None and before.hash == state.layout_hash else None
            taken = fitting_state(self._bag, self._layout, state, known, fresh)
            if taken.initial:
                names = ", ".join(taken.initial[:_MOST_NAMES])
                rest = f" and {len(taken.initial) - _MOST_NAMES} more" if len(taken.initial) > _MOST_NAMES else ""
                self._note(f"at {self._when(state.stamp)} s these start at their initial values: {names}{rest}")
        try:
            self._task.restore(taken.values)
        except (ValueError, OverflowError) as error:
            raise BagError("AMX6813", self._bag, f"wrong state of task {self.name}: {error}") from error
        self._follow_forces(state)
        self._tunables.know(state)
        self._task.scan_number = self._last = state.scan
        self._task.status = Status.RUNNING
        self._stopped_in = None
        self.memory.apart.clear()
        self._synchronous = True

    def _follow_forces(self, state: TaskState) -> None:
        """Force the locals that are forced from this state on, and release the others."""
        held = held_in(self._bag, self._task, state)
        if held != self._task.forces:
            self._task.hold(held)

    def _take_up(self, source: ReplaySource) -> None:
        """Execute a source from now on; recorded states are those of ``source.recorded``."""
        self._source = source
        self._comparison.take_up(source)
        self._layout = self._task.layout
        self._layout_hash = self._layout.hash
        self._recorded_layout = snapshot_layout(source.recorded) if source.recorded else None
        program = (source.recorded or source.compiled).program
        self._period_ns: float = math.inf if program.event is not None or program.is_basic else program.period_ns
        for note in source.edit_notes():
            self._note(note)
        self._tunables = Tunables(self._bag, source, self._recorded_layout or self._layout, self._note, self._when)

    def _follow_source(self, state: TaskState) -> bool:
        """Switch to the source of a state; return whether it is stored inside. BagError: none of the task's was."""
        recorded = self._source.recorded
        ran = recorded is None or state.source_hash == recorded.program.source_hash
        reloaded = None if ran else self._source.reloaded(state.source_hash)
        if reloaded is not None:
            self._note(f"reloaded at {self._when(state.stamp)} s")
            self._task.install(reloaded.compiled)
            self._take_up(reloaded)
            self._synchronous, self._installed_again, ran = False, False, True
            self.memory.apart.clear()
        if not ran and self._stored_ran is None:
            raise BagError(
                "AMX6831", self._bag, f"task {self.name} ran with another source than the {self.name}.BLK stored inside"
            )
        if not ran and self._stored_ran:
            self._note(f"reloaded at {self._when(state.stamp)} s with a source that is not stored inside")
            self._synchronous = False
            self.memory.apart.clear()
        self._stored_ran = ran
        return ran

    def _lose(self, scan: Scan, error: UnknownValue) -> None:
        """Handle a missing value: after a gap in the write log wait for a state, otherwise raise an error."""
        variable = self._commons.rack[error.key[0]]
        if not self._commons.gaps:
            raise unknown_value(self._bag, self._source, variable, self._when(scan.stamp)) from error
        self._note(
            f"at {self._when(scan.stamp)} s {variable.name} is not known: writes are missing in the log; "
            "it continues from the next recorded state"
        )
        self._synchronous = False
        self.memory.apart.clear()

    def _when(self, stamp: int) -> str:
        return seconds_text(max(0, stamp - self._tallies.origin))

    def _note(self, text: str) -> None:
        if len(self._notes) < MOST_NOTES:
            self._notes[text] = None
