"""Executes the scans of one task of a recording again, any of them, line by line."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import source_text
from automax_ros.messages.types.messages import Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagMessage
from automax_ros.recordings.tables.series import Progress
from automax_ros.replay.engine import Replay, Run
from automax_ros.replay.recorded.compared import FirstApart
from automax_ros.replay.recorded.lines import Kept, LineReplay, ScanLines, kept_of, own_values
from automax_ros.replay.recorded.run import RecordedRun
from automax_ros.replay.scans.report import FirstScan
from automax_ros.replay.scans.task import TaskReplay

_MOST_FOUND = 256
"""Executed scans that are kept for the next time (decision)."""
_BEFORE = 8
"""Scans before one that is asked for that are kept too: one steps back more often than one jumps (decision)."""


class ScanRefused(UserError):
    """A recorded scan cannot be executed again, or not line by line; the message says why."""


@dataclass(frozen=True)
class ExecutedScan:
    """A scan that was executed again; ``own`` are the task's own variables after it, by their names without the task.

    ``lines`` is None for a scan that is not shown line by line.
    """

    own: Mapping[str, Value]
    lines: ScanLines | None


class RecordedTask:
    """One task of a recording; ``replay`` has the source that is executed, the recorded or an edited one.

    ``is_basic``: it is a BASIC task, whose bursts are not shown line by line.

    An edited task goes on from what it had in the replay of the whole recording: ``kept``, by places of scans in the
    task's log. The recorded one, without ``kept``, begins with a recorded state.
    """

    def __init__(self, run: RecordedRun, name: str, replay: Replay, kept: Mapping[int, Kept] | None = None) -> None:
        self.name = name
        self._run, self._log, self._replay, self._kept = run, run.tasks[name], replay, kept
        self.is_basic = any(item.compiled.program.is_basic for item in replay.sources if item.name == name)
        self._found: OrderedDict[int, ExecutedScan] = OrderedDict()
        self._pass: Run | None = None
        self._messages: Iterator[BagMessage] = iter(())
        self._next = 0

    def scan(self, place: int) -> ExecutedScan:
        """Return a scan by its place in the task's log, executed again.

        Raises:
            ScanRefused: it cannot be executed again, with the reason.
        """
        if place not in self._found:
            try:
                self._go_to(place)
            except BagError as error:
                self._pass = None
                raise ScanRefused(error.message, error.hint) from error
        found = self._found.get(place)
        if found is None:
            raise ScanRefused(self._reason(place))
        self._found.move_to_end(place)
        return found

    def lines(self, place: int) -> ScanLines:
        """Return the values of a scan line by line.

        Raises:
            ScanRefused: it cannot be executed again, or is one of a BASIC task or before SCAN_LOOP.
        """
        lines = self.scan(place).lines
        if lines is None:
            number = self._log.numbers[place]
            why = "it is of a BASIC task" if self.is_basic else "it is what stands before SCAN_LOOP"
            raise ScanRefused(f"scan {number} of task {self.name} is not shown line by line: {why}")
        return lines

    def _go_to(self, place: int) -> None:
        """Execute the scans up to one, from the nearest place at which it is known how the task stands."""
        kept = max((item for item in self._kept or () if item < place), default=None)
        run = self._run
        start = run.start_of(self.name, place) if self._kept is None else run.start_following(self.name, kept)
        if self._pass is None or not start.scan <= self._next <= place:
            starts = {} if start.state is None else {self.name: start.state}
            self._pass = self._replay.begin(starts, self._replay.options, only=self.name, kind=LineReplay)
            self._messages, self._next = run.messages(start.chunk), start.scan
        else:
            kept = None
        task = self._pass.replayed(self.name)
        assert isinstance(task, LineReplay)
        while self._next <= place:
            entry = next(self._messages, None)
            if entry is None:
                break
            is_own = isinstance(entry.message, Scan) and entry.message.task == self.name
            now = self._next
            task.by_lines = is_own and now > place - _BEFORE
            before = task.totals() if task.by_lines else None
            self._pass.take(entry)
            self._next += is_own
            if is_own and now == kept and self._kept is not None:
                task.go_on(self._kept[now])
            elif before is not None and task.totals().compared > before.compared:
                self._keep(now, task, differs=task.totals().different > before.different)

    def _keep(self, place: int, task: LineReplay, *, differs: bool) -> None:
        if differs and self._kept is None:
            return
        own = dict(own_values(task.task.compiled, task.task.state))
        self._found[place] = ExecutedScan(own, task.lines)
        while len(self._found) > _MOST_FOUND:
            self._found.popitem(last=False)

    def _reason(self, place: int) -> str:
        totals = None if self._pass is None else self._pass.replayed(self.name).totals()
        what = f"scan {self._log.numbers[place]} of task {self.name} cannot be executed again"
        if totals is not None and totals.different and self._kept is None:
            version = self._replay.reader.custom_data.get("version", "an unknown version")
            return f"{what} here: it was recorded by {version}, and comes out otherwise now"
        return f"{what}: {totals.notes[-1] if totals and totals.notes else 'the state before it is not recorded'}"


def run_edited(
    run: RecordedRun, replay: Replay, progress: Progress | None = None
) -> tuple[FirstApart | None, dict[str, dict[int, Kept]]]:
    """Execute the whole recording with edited tasks; return the first difference, and what to go on from, by task.

    Raises:
        BagError: the recording cannot be read, or no scan of such a task can be executed.
    """
    kept: dict[str, dict[int, Kept]] = {source.name: {} for source in replay.sources}
    # After a reload the states that follow mean another source, so that a pass can only begin at the start.
    steady = {source.name for source in replay.sources if len(source.versions) <= 1}

    def watch(task: TaskReplay, scan: Scan) -> None:
        if scan.full and scan.scan and task.name in steady and not task.stopped:
            kept[task.name][run.place_of(scan)] = kept_of(task)

    first = replay.run(progress, watch).first
    return None if first is None else _apart(first), kept


def _apart(first: FirstScan) -> FirstApart:
    texts = []
    for item in first.differences:
        lines = f" (line {', '.join(map(str, item.lines))})" if item.lines else ""
        values = f"recorded {source_text(item.first.recorded)}, replayed {source_text(item.first.replayed)}"
        texts.append(f"{item.name}: {values}{lines}")
    return FirstApart(first.task, first.scan, round(first.time_s * NS_PER_S), "; ".join(texts))
