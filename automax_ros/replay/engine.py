"""Replay: executes every recorded scan again and compares, with the recorded sources or with edited ones.

It is an open loop. Each task gets the recorded inputs, whatever the other tasks do in the replay; only its own writes
it reads back as written in the replay. Only the recording is needed, and nothing of ROS.

report = replay(Path("out"), {"SPEED": read_task_source(Path("new/SPEED.BLK"))})
report.identical
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.kinds import WriterKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.messages import (
    NAMES,
    CommonImage,
    CommonWrite,
    Operation,
    Scan,
    TaskState,
    VariableTable,
)
from automax_ros.rack.base.views import backplane_of
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock, message_blocks
from automax_ros.recordings.read.reader import BagMessage, BagReader
from automax_ros.recordings.read.run_facts import RunFacts, run_facts
from automax_ros.recordings.read.soundness import require_tasks
from automax_ros.recordings.read.span import require_scans
from automax_ros.replay.columns.forms import ColumnForms
from automax_ros.replay.columns.segments import BlockReplay
from automax_ros.replay.scans.carried_state import CarriedState, PartStart, digest
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.compare import DifferenceCounts
from automax_ros.replay.scans.report import ReplayReport
from automax_ros.replay.scans.stored_rack import ReplaySource, StoredRack, stored_rack
from automax_ros.replay.scans.task import TaskReplay
from automax_ros.replay.scans.totals import Totals

DEFAULT_MAX_DIFFERENCES = 50
"""Default for the most differences that a replay's report lists in full (decision)."""
LONGEST_WAIT_NS = NS_PER_S
"""Longest wait after the end of the range for a scan that began in it: modeled ones last (decision)."""
_KINDS = (CommonImage, CommonWrite, Operation, Scan, TaskState, VariableTable)
_TYPES = frozenset(NAMES[kind] for kind in _KINDS)
_STATES = frozenset({"automax_msgs/msg/TaskState"})

Stored = tuple[StoredRack, RunFacts]
"""The rack stored in a recording, and the facts of its run."""
Watcher = Callable[[TaskReplay, Scan], None]
"""Called after each replayed scan."""


@dataclass(frozen=True)
class ReplayOptions:
    """Options of a replay: tasks (``only``, None: all), the range in ns since the start of the run, both ends included.

    Numbers that differ by at most ``tolerance`` count as equal; at most ``max_differences`` are listed in full.

    ``by_columns``: where scans are uniform and ``native`` permits it, thousands are executed at once and compared. The
    report is the same either way, so only the library has this option (decision): the tests prove it.
    """

    only: tuple[str, ...] | None = None
    tolerance: float = 0.0
    from_ns: int = 0
    to_ns: int | None = None
    max_differences: int = DEFAULT_MAX_DIFFERENCES
    by_columns: bool = True
    native: NativeForms = IN_PYTHON


def replay(
    bag: Path,
    new: Mapping[str, SourceText] | None = None,
    options: ReplayOptions | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> ReplayReport:
    """Replay a recording; ``new`` are sources that run in place of the recorded ones, by task name.

    ``on_progress`` is called from time to time with the share that is done, 0 to 1. Memory use does not grow with the
    recording.

    Raises:
        BagError: the recording cannot be read, or lacks something that the replay needs.
        SourceRefused: a source has errors.
    """
    return Replay(bag, new or {}, options or ReplayOptions()).run(on_progress)


class Replay:
    """One recording, prepared for any number of replays."""

    def __init__(
        self, bag: Path, new: Mapping[str, SourceText], options: ReplayOptions, stored: Stored | None = None
    ) -> None:
        """Check and compile the tasks; ``stored`` is the rack and run if they were read before.

        Raises:
            BagError: the recording cannot be read, or lacks a task or its source.
            SourceRefused: a source has errors.
        """
        self.options = options
        self.bag, self.new = bag, new
        self.native_elsewhere: tuple[str, ...] = ()
        self.reader = BagReader(bag)
        self.rack, self.facts = stored or _read_stored(self.reader)
        self.rack.require_tasks(options.only or ())
        chosen = [name for name in self.rack.task_names if options.only is None or name in options.only]
        self.sources: list[ReplaySource] = self.rack.replay_sources(chosen, new)
        config = self.rack.config
        self._forms = ColumnForms(config.variables, backplane_of(config), options.native)

    @property
    def native(self) -> list[str]:
        """Whether the tasks executed by columns were native, or why not, in words; here and in other processes."""
        own = (outcome.text for outcome in self._forms.outcomes)
        return list(dict.fromkeys((*self.native_elsewhere, *own)))

    @property
    def warnings(self) -> list[tuple[SourceText, list[Diagnostic]]]:
        """The warnings of the new sources."""
        return [(item.source, list(item.warnings)) for item in self.sources if item.edited and item.warnings]

    def run(
        self,
        on_progress: Callable[[float], None] | None = None,
        watcher: Watcher | None = None,
        to_ns: int | None = None,
    ) -> ReplayReport:
        """Execute and compare; ``to_ns`` ends it earlier than the options say.

        Raises:
            BagError: the recording cannot be read to its end, or lacks something that the replay needs.
        """
        reader = self.reader.again()
        options = self.options if to_ns is None else replace(self.options, to_ns=to_ns)
        reader.on_progress = on_progress
        run = self.begin(self.starts(reader, options), options, watcher)
        run.take_all(reader)
        doubtful = run.ends_in_doubt()
        if doubtful:
            sources = self.rack.replay_sources([task.name for task in doubtful], {})
            recorded = Run(self.bag, self.rack, self.facts, sources, options, run.starts, None, self._forms)
            reader.on_progress = None
            recorded.take_all(reader)
            for task in doubtful:
                task.compare_end(recorded.stopped_in(task.name))
        return self.report(run.totals(), options)

    def starts(self, reader: BagReader, options: ReplayOptions) -> Mapping[str, int]:
        """Return the log time of the state with which each task begins, empty if the range begins with the run."""
        return _last_states(reader, self.facts.table.stamp + options.from_ns) if options.from_ns else {}

    def begin(
        self,
        starts: Mapping[str, int],
        options: ReplayOptions,
        watcher: Watcher | None = None,
        *,
        only: str | None = None,
        kind: type[TaskReplay] = TaskReplay,
    ) -> Run:
        """Return a new pass over the recording, or over files of it; of task ``only`` alone, if it is given.

        ``kind`` is the class that executes the scans of a task.
        """
        sources = [source for source in self.sources if only in (None, source.name)]
        return Run(self.bag, self.rack, self.facts, sources, options, starts, watcher, self._forms, kind)

    def report(self, totals: Totals, options: ReplayOptions) -> ReplayReport:
        """Return the report of totals.

        Raises:
            BagError: there was nothing to compare.
        """
        start = self.facts.table.stamp
        begin = start + options.from_ns
        from_stamp, to_stamp = max(begin, totals.first_stamp or 0), max(totals.last_stamp or start, begin)
        tasks = tuple(task.report() for task in totals.tasks.values())
        report = ReplayReport(
            bag=str(self.bag),
            rack=self.rack.config.name,
            version=self.reader.custom_data.get("version", ""),
            from_s=(from_stamp - start) / NS_PER_S,
            to_s=(to_stamp - start) / NS_PER_S,
            tolerance=options.tolerance,
            tasks=tasks,
            first=totals.first,
            differences=totals.differences,
            more=totals.more,
        )
        self._require_compared(report, options)
        return report

    def _require_compared(self, report: ReplayReport, options: ReplayOptions) -> None:
        """Refuse to report a recording or a requested task as identical if none of its scans was executed."""
        nothing = not report.scans and report.identical
        names = tuple(task.name for task in report.tasks)
        if nothing and (options.from_ns or options.to_ns is not None):
            require_scans(self.bag, self.facts.table.stamp, names, options.from_ns, options.to_ns)
        asked = {*(options.only or ()), *(source.name for source in self.sources if source.edited)}
        for task in report.tasks:
            if task.name in asked and not task.scans and not task.different:
                notes = f" ({'; '.join(task.notes)})" if task.notes else ""
                what = f"no scan of task {task.name} was executed again{notes}"
                raise BagError("AMX6832", self.bag, what, "see `automax bag info`, or choose another range")
        if nothing:
            notes = "; ".join(f"{task.name}: {note}" for task in report.tasks for note in task.notes)
            what = f"no scan of {', '.join(names)[:80]} can be executed again"
            raise BagError("AMX6832", self.bag, f"{what}{f' ({notes})' if notes else ''}", "see `automax bag info`")


class Run:
    """One pass of a replay over a recording, or over files of it."""

    def __init__(
        self,
        bag: Path,
        rack: StoredRack,
        facts: RunFacts,
        sources: list[ReplaySource],
        options: ReplayOptions,
        starts: Mapping[str, int],
        watcher: Watcher | None,
        forms: ColumnForms,
        kind: type[TaskReplay] = TaskReplay,
    ) -> None:
        self._bag, self._rack, self._sources, self._options = bag, rack, sources, options
        self._watcher, self._forms = watcher, forms
        self._start = facts.table.stamp
        self._commons = RecordedCommons(bag, facts, rack.config)
        self._all_tasks = frozenset(rack.task_names)
        self._tallies = DifferenceCounts(self._start, options.max_differences)
        self._begin = self._start + options.from_ns
        self._end = None if options.to_ns is None else self._start + options.to_ns
        self.starts = starts
        self._first_stamp: int | None = None
        self._last_stamp: int | None = None
        self._tasks: dict[str, TaskReplay] = {}
        self._writers: dict[int, TaskReplay] = {}
        writers = {writer.name: writer.id for writer in facts.table.writers if writer.kind == WriterKind.TASK}
        for source in sources:
            starts_at = starts.get(source.name)
            task = kind(bag, source, self._commons, self._tallies, tolerance=options.tolerance, starts_at=starts_at)
            self._tasks[source.name] = task
            if source.name in writers:
                self._writers[writers[source.name]] = task

    def take_all(self, reader: BagReader) -> bool:
        """Process the messages of a recording up to the end of the range; return FALSE if that was reached."""
        if self._watcher is not None or not self._options.by_columns:
            return all(map(self.take, reader.messages(types=_TYPES)))
        library = self._forms.library
        if library is None:
            for task in self._tasks.values():
                self._forms.leave_in_python(task.task.compiled)
            return all(map(self.take, reader.messages(types=_TYPES)))
        span = self._begin, self._end
        blocks = BlockReplay(self._tasks, self._all_tasks, self._commons, self.take, _TYPES, span, self._forms, library)
        return all(self._take_item(blocks, item) for item in message_blocks(reader, blocks.types, library.table))

    def _take_item(self, blocks: BlockReplay, item: MessageBlock | BagMessage) -> bool:
        if isinstance(item, BagMessage):
            return self.take(item)
        if self._first_stamp is None:
            self._first_stamp = int(item.stamps[0])
        return blocks.take(item)

    def take_up_to_scan(self, reader: BagReader) -> bool:
        """Process the messages before the first scan of any task; return FALSE if the range ends among them."""
        for entry in reader.messages(types=_TYPES):
            if isinstance(entry.message, Scan):
                return True
            if not self.take(entry):
                return False
        return True

    def replayed(self, name: str) -> TaskReplay:
        """Return the replay of a task that is executed."""
        return self._tasks[name]

    def ends_in_doubt(self) -> list[TaskReplay]:
        """Return the edited tasks that may have ended where the recorded ones did not, or the other way round."""
        return [task for task in self._tasks.values() if task.end_in_doubt]

    def stopped_in(self, name: str) -> int | None:
        """Return the last scan of a task if it stopped in it by itself, else None."""
        return self._tasks[name].stopped_in

    def take(self, entry: BagMessage) -> bool:
        """Process one message; return whether later ones may still be in the range."""
        message = entry.message
        if self._first_stamp is None:
            self._first_stamp = entry.stamp
        if isinstance(message, Scan):
            return self._take_scan(message)
        if isinstance(message, CommonWrite):
            self._take_write(message)
        elif isinstance(message, Operation):
            for replayed in self._tasks.values():
                replayed.take_operation(message)
        elif isinstance(message, VariableTable):
            self._commons.check_table(message)
        elif isinstance(message, CommonImage):
            self._commons.take(message)
        elif isinstance(message, TaskState):
            if self._end is not None and message.stamp > self._end:
                return message.stamp <= self._end + LONGEST_WAIT_NS
            task = self._task(message.task)
            if task is not None:
                task.take_state(message, entry.log_time, counted=message.stamp >= self._begin)
        return True

    def totals(self) -> Totals:
        """Return the totals so far."""
        tasks = {name: task.totals() for name, task in self._tasks.items()}
        found = self._tallies
        return Totals(self._first_stamp, self._last_stamp, tasks, found.first(), found.differences(), found.more)

    def carried(self) -> CarriedState:
        """Return the state after the messages so far that determines the further replay."""
        tasks = {name: task.carried for name, task in self._tasks.items()}
        stopped = frozenset(name for name, task in self._tasks.items() if task.stopped)
        return CarriedState(digest((self._commons.carried, tasks)), stopped, self._commons.knows_no_force)

    @property
    def beginnings(self) -> dict[str, PartStart]:
        """The information that each task needed from before the first message, by task name."""
        return {name: task.beginning for name, task in self._tasks.items()}

    @property
    def asked_back(self) -> bool:
        """Whether forces before the first message were needed."""
        return self._commons.asked_back

    def _take_scan(self, scan: Scan) -> bool:
        if self._end is not None and scan.stamp > self._end:
            return scan.stamp <= self._end + LONGEST_WAIT_NS
        task = self._task(scan.task)
        if task is not None:
            self._last_stamp = scan.stamp
            executed = task.take_scan(scan, counted=scan.stamp >= self._begin)
            if executed and self._watcher is not None:
                self._watcher(task, scan)
        return True

    def _take_write(self, write: CommonWrite) -> None:
        writer = self._writers.get(write.writer)
        if writer is not None:
            writer.take_own(write)
        entries = self._commons.take(write) or ()
        for task in self._tasks.values():
            if writer is not task and task.memory.is_apart:
                task.memory.overwritten(entries)

    def _task(self, name: str) -> TaskReplay | None:
        task = self._tasks.get(name)
        if task is None and name not in self._all_tasks:
            raise BagError(
                "AMX6831", self._bag, f"has scans of a task {name[:40]!r}, which its rack.yaml does not have"
            )
        return task


def _read_stored(reader: BagReader) -> Stored:
    """Read the rack and the run of a recording. BagError, SourceRefused: as ``Replay``."""
    rack, facts = stored_rack(reader), run_facts(reader)
    require_tasks(reader.path, facts.table)
    rack.check_table(facts.table)
    return rack, facts


def _last_states(reader: BagReader, latest: int) -> dict[str, int]:
    """Return the log time of each task's last state that is earlier than a stamp."""
    found: dict[str, int] = {}
    for entry in reader.messages(types=_STATES):
        message = entry.message
        if isinstance(message, TaskState):
            if message.stamp >= latest:  # a state of that instant may include the scan of the instant
                break
            found[message.task] = entry.log_time
    return found
