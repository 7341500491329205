"""Edits a rack that runs: a task gets another program and goes on in its state, at the phase that it has.

A local, a block's state and a tunable goes on by name, type and size, as in a replay; a tunable whose CURRENT the edit
has changed begins there. A BASIC task cannot go on in the middle of another text: it is put into RUN again, with its
variables (decision).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from automax_ros.compile.base.layout import Role
from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.types import Value
from automax_ros.messages.stream.task_messages import TaskMessages
from automax_ros.messages.types.messages import TaskState
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.writers import PRESET_WRITER
from automax_ros.replay.scans.state import fitting_state, whole_state
from automax_ros.replay.scans.stored_rack import ReplaySource
from automax_ros.replay.scans.tunables import Tunables
from automax_ros.runtime.scan.error_log import snapshot_layout
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.keep_values import carry_over
from automax_ros.runtime.tasks.task import Status

LONGEST_WAIT_NS = NS_PER_S
"""Longest wait for the end of the scan that an edited task has begun (decision)."""
MOST_NAMES = 8


class TaskEdits:
    """The edited tasks of a rack; ``notes`` are for the user: what of their states begins as installed."""

    def __init__(self, bag: Path, sources: Mapping[str, ReplaySource]) -> None:
        self._bag, self._sources = bag, sources
        self.notes: list[str] = []

    def wait(self, rack: Rack) -> None:
        """Advance a rack until no edited task is in the middle of a modeled scan.

        Raises:
            RackError: one is for longer than ``LONGEST_WAIT_NS``.
        """
        end_ns = rack.now_ns + LONGEST_WAIT_NS
        items = [item for item in rack.scheduled if item.name in self._sources]
        while any(item.task.progress is not None for item in items):
            if not rack.scheduler.step(end_ns):
                raise RackError(f"no instant within {seconds_text(LONGEST_WAIT_NS)} s at which no edited task scans")

    def begin_with(self, rack: Rack, states: Mapping[str, TaskState]) -> None:
        """Restore the states with which the tasks of a recording began, before the rack starts."""
        for item in rack.scheduled:
            state = states.get(item.name)
            if state is None:
                continue
            layout = snapshot_layout(item.task.compiled)
            source = self._sources.get(item.name)
            if source is None:
                item.task.restore(whole_state(self._bag, layout, state).values)
            else:
                item.task.restore(self._fitting(item, source, state))

    def carry_out(self, rack: Rack, new: Mapping[str, SourceText]) -> None:
        """Replace the programs, between two scans.

        Raises:
            RackError: a source has errors, or does not fit the other tasks.
        """
        for name, source in new.items():
            item = next(item for item in rack.scheduled if item.name == name)
            installation = rack.operations.installation
            prepared = installation.prepare(name, source)
            compiled = installation.take(prepared)
            if isinstance(item.task, BasicTask):
                ran, before, values = item.task.status is Status.RUNNING, item.task.layout, item.task.snapshot()
                item.install(compiled, source)
                kept = carry_over(before, values, item.task)
                self.notes.append(f"{name}: a BASIC task, put into RUN again with {len(kept)} of its variables")
                if ran:
                    rack.operations.run(name)
                continue
            self._replace(item, compiled, source)
        rack.memory.note_locals(PRESET_WRITER, forced=any(task.forces for task in rack.tasks))

    def _replace(self, item: ScheduledTask, compiled: CompiledTask, source: SourceText) -> None:
        """Replace the program of a task that scans; its trigger, and the drive that it has armed, do not notice."""
        task, edited = item.task, self._sources[item.name]
        state, recorded = item.state(), TaskMessages(task).state(0)
        forced = _kept_forces(task.forces, edited)
        if _trigger_of(compiled) == _trigger_of(task.compiled):
            task.install(compiled)
            item.source = source
            task.restore(self._fitting(item, edited, recorded))
            task.hold(forced)
            task.status, task.scan_number = Status[state["status"]], state["scan"]
            return
        item.install(compiled, source)
        values = self._fitting(item, edited, recorded)
        held = [local for local in state["held"] if local in forced]
        place = {"source": compiled.program.source_hash, "values": values, "held": held, "forced": forced}
        item.load({**state, **place})

    def _fitting(self, item: ScheduledTask, source: ReplaySource, state: TaskState) -> list[Value]:
        """Return the values of a state that an edited task, installed already, goes on with."""
        name, layout = item.name, snapshot_layout(item.task.compiled)
        before = None if source.recorded is None else snapshot_layout(source.recorded)

        def note(text: str) -> None:
            self.notes.append(f"{name}: {text}")

        if before is None:
            taken = fitting_state(self._bag, layout, state, None, {})
        else:
            tunables = Tunables(self._bag, source, before, note, lambda stamp: seconds_text(max(0, stamp)))
            taken = fitting_state(self._bag, layout, state, before, tunables.fresh(state))
        if taken.initial:
            names = ", ".join(taken.initial[:MOST_NAMES]) + (", ..." if len(taken.initial) > MOST_NAMES else "")
            note(f"{len(taken.initial)} of {len(layout.fields)} values begin as installed: {names}")
        return taken.values


def _kept_forces(forces: Mapping[str, Value], source: ReplaySource) -> dict[str, Value]:
    """Return the forces on locals that the edited task still has as simple ones."""
    known = {field.name: field for field in source.compiled.layout.fields if field.role is Role.LOCAL}
    return {name: value for name, value in forces.items() if name in known and not known[name].is_array}


def _trigger_of(compiled: CompiledTask) -> tuple[object, ...]:
    """Return on what the trigger of a task depends: its period, its events, the slots of its drive."""
    program = compiled.program
    facts = None if program.cml is None else sorted(program.cml.facts.items())
    return program.period_ns, program.event, program.events, facts
