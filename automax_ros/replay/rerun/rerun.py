"""Runs the rack of a recording again in closed loop, with an edit from a moment on: what if, from here.

The recording holds no whole state of a plant, nor of the scheduler, so the rack runs up from the start of the run with
its recorded sources, and what came from outside happens again at its time. In simulated time that gives the recorded
state, bit for bit, and every message on the way is compared with the recorded one. There the edit takes its place.

report = Rerun(Path("out"), {"SPEED": read_task_source(Path("new/SPEED.BLK"))}, RerunOptions(from_ns=10**10)).run(
    Path("after"), RecordingOptions()
)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeOutcome
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import element_name
from automax_ros.core.text import count_of, near_or_listed, printable, quoted
from automax_ros.core.ticks import NS_PER_MS, seconds_text
from automax_ros.core.types import bare_name
from automax_ros.core.user_error import UserError
from automax_ros.core.values import source_text
from automax_ros.language.program import tunable_value
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.modules.network import NetworkModule
from automax_ros.rack.rack import Rack, digest_of
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.value_names import TunableSetting, tunables_of, tuning
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.read.soundness import require_tasks
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.replay.rerun.acting import OutsidePlayer
from automax_ros.replay.rerun.checking import RecordedCheck
from automax_ros.replay.rerun.editing import TaskEdits
from automax_ros.replay.rerun.outside import read_outside
from automax_ros.replay.rerun.report import RerunReport
from automax_ros.replay.scans.state import held_in
from automax_ros.replay.scans.stored_rack import stored_rack
from automax_ros.runtime.time.scheduler import EventClass, EventKey

SLICE_NS = 100 * NS_PER_MS
"""Rack time between two reports of progress."""
_NEXT_FILE = EventKey(EventClass.OUTSIDE, -1, "")
"""Before all other events of an instant, as the recorder begins a file."""
_NEXT_FILE_LATER = EventKey(EventClass.OUTSIDE, 2, "")
"""After what came from outside at the instant."""
Progress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""


@dataclass(frozen=True)
class RerunOptions:
    """From when on the edit counts, and when the run ends (None: with the recording), ns of the run."""

    from_ns: int = 0
    to_ns: int | None = None


class Rerun:
    """One recording, ready to run again; ``new`` are sources that take their tasks' place from a moment on.

    ``native`` selects which tasks scan as machine code, ``outcomes`` says after a run which did. ``to_ns`` is its end.
    """

    def __init__(self, bag: Path, new: Mapping[str, SourceText], options: RerunOptions) -> None:
        """Read the rack and all that came from outside, and check the new sources.

        Raises:
            BagError: the recording cannot be read, or does not hold what a run again needs (AMX6835).
            SourceRefused: a stored or a new source has errors.
            RackError: the tasks do not fit each other.
        """
        self.options, self.new = options, new
        self._tunings: list[TunableSetting] = []
        self.native: NativeForms = IN_PYTHON
        self.outcomes: tuple[NativeOutcome, ...] = ()
        self.reader = BagReader(bag)
        self.stored = stored_rack(self.reader)
        self.facts = run_facts(self.reader)
        require_tasks(bag, self.facts.table)
        self.stored.check_table(self.facts.table)
        self.stored.require_tasks(new)
        self.outside = read_outside(self.reader, self.stored, self.facts, options.to_ns)
        self.origin = self.facts.table.stamp
        self.config: RackConfig = replace(self.stored.config, namespace=self.facts.space.strip("/"))
        self._require_start()
        sources = self.stored.replay_sources([*new], new)
        self._programs = {program.name: program for program in self.stored.programs()}
        self._programs |= {source.name: source.compiled.program for source in sources}
        self._edits = TaskEdits(bag, {source.name: source for source in sources})
        self.warnings = [(source.source, list(source.warnings)) for source in sources if source.warnings]
        if new:  # with the others: errors are told before the run up
            Installation(self.config, sources={**self.stored.sources, **new})
        self.to_ns = self.outside.ends_ns if options.to_ns is None else min(options.to_ns, self.outside.ends_ns)

    def tune(self, texts: Sequence[str]) -> None:
        """Add tunables, ``TASK.NAME=VALUE``, that are set when the edit takes its place.

        Raises:
            UserError: there is no such task or tunable, or the value is not one that it takes.
        """
        for text in texts:
            task = text.partition("=")[0].partition(".")[0].strip().upper()
            if task not in self._programs:
                raise UserError(f"the recorded rack has no task {quoted(task)}", self._with_task(text, task))
            found = tuning(self._programs, text)
            try:
                tunable_value(self._programs[task].symbols[found.name], found.name, found.value)
            except ValueError as error:
                raise UserError(f"task {task}: {error}") from error
            self._tunings.append(found)

    def _with_task(self, text: str, word: str) -> str | None:
        """Return a hint for a tunable without its task (``word``), or with one that the rack does not have."""
        name, equals, value = text.partition("=")
        if "." in name:
            return near_or_listed(word, self._programs)
        known = [(task, full) for task, program in self._programs.items() for full in tunables_of(program)]
        given = f"{equals}{printable(value)}" or "=VALUE"
        written = [f"{task}.{word}{given}" for task, full in known if word in (full, bare_name(full))]
        if written:
            return f"write {' or '.join(written)}"
        return near_or_listed(word, [f"{task}.{bare_name(full)}" for task, full in known])

    @property
    def is_live(self) -> bool:
        """Whether the recording was made on the wall clock."""
        return self.origin > 0

    def run(
        self,
        folder: Path | None,
        recording: RecordingOptions | None = None,
        on_progress: Progress | None = None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> RerunReport:
        """Run, and record into a folder, None for nowhere, from the moment of the edit on.

        Raises:
            BagError: the recording cannot be read, or the new one not be written.
            RackError: an edited task does not come to the end of a scan.
            UserError: a task has been reloaded in the recording, and what is to be tuned is not in its source any more.
        """
        edited = bool(self.new or self._tunings)
        from_ns = self.options.from_ns
        later = from_ns > 0
        sources = self.stored.sources if later else {**self.stored.sources, **self.new}
        installation = Installation(self.config, sources=sources, native=self.native)
        self.outcomes = tuple(installation.native.values())
        rack = Rack(self.config, installation=installation)
        self._restore(rack)
        run_id = self.facts.table.run_id if later or not self.new else self._run_id
        stream = RackStream(rack, run_id)
        check = self._check(rack, stream) if later or not edited else None
        player = OutsidePlayer(rack, self.outside.events, {} if later else self.new)
        recorder = None if later or folder is None else Recorder(rack, stream, folder, self._recorded(recording))
        at_ns = 0
        try:
            if not later:
                self._tune(rack, player)
            stream.begin(self.origin)
            rack.observe(player)
            rack.start(self.outside.settings, player.begin)
            self._advance(rack, min(from_ns, self.to_ns), on_progress, stopped)
            if later and not stopped():
                at_ns = self._edit(rack, stream, check, player, edited=edited)
                if folder is not None:
                    recorder = Recorder(rack, stream, folder, self._recorded(recording))
                    recorder.begin_here()
            self._advance(rack, self.to_ns, on_progress, stopped)
        finally:
            if check is not None and rack.now_ns < self.outside.ends_ns:
                check.stop()  # the last states are those of the end, which is not yet there
            stream.end()
            if recorder is not None:
                recorder.close()
        if recorder is not None and recorder.failure is not None:
            raise recorder.failure
        return self._report(rack, check, player, recorder, at_ns)

    def _report(
        self, rack: Rack, check: RecordedCheck | None, player: OutsidePlayer, recorder: Recorder | None, at_ns: int
    ) -> RerunReport:
        return RerunReport(
            str(self.reader.path),
            self.config.name,
            self._edited,
            tuple(self._plants),
            self.outside,
            at_ns,
            rack.now_ns,
            0 if check is None else check.compared,
            None if check is None else check.deviation,
            not self.is_live and self._is_ours,
            self.is_live,
            0 if recorder is None else recorder.scans,
            player.refused,
            (*self._edits.notes, *player.notes, *self._limits()),
        )

    def _limits(self) -> list[str]:
        """Return what cannot be run again as it was."""
        notes = []
        if self.is_live:
            notes.append("recorded on the wall clock: here each scan comes at its deadline, whatever the host did")
        if self.outside.skipped:
            when = seconds_text(self.outside.skipped_ns)
            missed = count_of(self.outside.skipped, "scan")
            notes.append(f"a late host left out {missed}, the first before {when} s: here none is left out")
        if self.outside.played:
            slots = " and ".join(map(str, sorted(self.outside.played)))
            notes.append(f"the network module in slot {slots} shows what it showed then: the other racks do not answer")
        loads = [plant.name for plant in self.config.plants if plant.load.from_ros]
        if loads and self.is_live:
            notes.append(f"the load of {', '.join(loads)} came from ROS, which no recording holds: it is as installed")
        return notes

    @property
    def _plants(self) -> list[str]:
        return [plant.name for plant in self.config.plants if plant.motor is not None]

    @property
    def _run_id(self) -> int:
        """The number of the edited run: that of the recorded one if nothing differs."""
        return digest_of(self.config.text, {**self.stored.sources, **self.new})

    @property
    def _is_ours(self) -> bool:
        return self.reader.is_ours

    def _require_start(self) -> None:
        """Check that the recording holds the start of its run.

        Raises:
            BagError: it does not.
        """
        if self.outside.begins_ns:
            when = seconds_text(self.outside.begins_ns)
            lacks = (
                f"the state of {', '.join(self._plants)}" if self._plants else "where each task is between two scans"
            )
            raise BagError(
                "AMX6835",
                self.reader.path,
                f"begins {when} s after the start of its run, and does not hold {lacks} there",
                "name the folder with all files of the run; a rack that ran already was recorded without its start",
            )
        if self.options.from_ns > self.outside.ends_ns:
            end = seconds_text(self.outside.ends_ns)
            raise BagError("AMX6825", self.reader.path, f"ends at {end} s, before --from", "begin earlier")

    def _restore(self, rack: Rack) -> None:
        """Give a rack that has not started what the recorded one had: forces, states of tasks, rolls, tasks at rest."""
        for module in rack.modules:
            if isinstance(module, NetworkModule) and module.config.slot in self.outside.played:
                module.play()
        self._edits.begin_with(rack, self.outside.states)
        for view, element, value in self.outside.forced:
            rack.force(element_name(self.config.variables[view], element), value)
        for name, state in self.outside.states.items():
            if name not in self.new:
                for local, value in held_in(self.reader.path, rack.task(name), state).items():
                    rack.force(f"{name}.{local}", value)
        try:
            rack.plants.restock(self.outside.stock)
        except (ValueError, TypeError, KeyError) as error:
            why = "is damaged: what was kept of its rolls and webs is impossible"
            raise BagError("AMX6835", self.reader.path, why) from error
        rack.operations.starting = self.outside.starting

    def _tune(self, rack: Rack, player: OutsidePlayer) -> None:
        for item in self._tunings:
            try:
                rack.tune(rack.task(item.task), item.name, item.value)
            except (KeyError, ValueError) as error:
                why = str(error) if isinstance(error, ValueError) else f"it has no tunable {item.name}"
                when = seconds_text(rack.now_ns)
                hint = f"the recording has reloaded {item.task} by then: begin before that with --from"
                raise UserError(f"task {item.task} at {when} s: {why}", hint) from error
        player.watch((item.task, item.name) for item in self._tunings)

    def _edit(
        self, rack: Rack, stream: RackStream, check: RecordedCheck | None, player: OutsidePlayer, *, edited: bool
    ) -> int:
        """Let the edit take its place; return when that was, ns."""
        if check is not None:
            check.loosen()
        if not edited:
            return rack.now_ns
        self._edits.wait(rack)
        if check is not None:
            check.stop()
        player.edits = self.new
        self._edits.carry_out(rack, self.new)
        self._tune(rack, player)
        if self.new:
            stream.in_run(self._run_id)
        for name in self.new:  # the stream makes the messages of another program from here on
            stream.operated(Operation(rack.now_ns, "reload", name))
        return rack.now_ns

    def _check(self, rack: Rack, stream: RackStream) -> RecordedCheck:
        """Compare the messages of a stream from its beginning on, where the recording has files as it had them."""
        exact = self._is_ours and not self.is_live
        check = RecordedCheck(self.reader.again(), self.origin, exact=exact)
        options = self._options(None)
        takes = stream.add_sink(check.sink, tasks=options.tasks, every_state=options.every_state)
        if exact:
            for start, after_others in self.outside.files:
                key = _NEXT_FILE_LATER if after_others else _NEXT_FILE
                rack.scheduler.at(start, key, lambda _: stream.repeat_facts(takes) if check.exact else None)
        return check

    def _options(self, options: RecordingOptions | None) -> RecordingOptions:
        """Return options with the tasks, and the states after each scan, that the recording has."""
        options = options or RecordingOptions()
        outside = self.outside
        all_tasks = outside.tasks >= set(self.stored.task_names)
        tasks = options.tasks or (None if all_tasks else outside.tasks)
        return replace(options, tasks=tasks, every_state=options.every_state or outside.every_state)

    @property
    def _edited(self) -> tuple[str, ...]:
        """What the edit is, in words."""
        edited = [f"{name} from {source.name}" for name, source in self.new.items()]
        return (*edited, *(f"{item.task}.{item.name} = {source_text(item.value)}" for item in self._tunings))

    def _recorded(self, options: RecordingOptions | None) -> RecordingOptions:
        """Return options for what is recorded: as ``_options``, and what differs from when on."""
        same = all(source.text == self.stored.sources[name].text for name, source in self.new.items())
        edited = "" if same and not self._tunings else ", ".join(self._edited)
        text = f"edited from {seconds_text(self.options.from_ns)} s on: {edited}" if edited else ""
        return replace(self._options(options), edited=text)

    def _advance(self, rack: Rack, end_ns: int, on_progress: Progress | None, stopped: Callable[[], bool]) -> None:
        while rack.now_ns < end_ns and not stopped():
            rack.scheduler.run_until(min(rack.now_ns + SLICE_NS, end_ns))
            if on_progress is not None:
                on_progress(rack.now_ns / max(1, self.to_ns))
