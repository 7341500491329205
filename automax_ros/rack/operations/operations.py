"""Operations of an operator on a rack: RUN, STOP, reload, delete, STOP ALL, clear, power. Each any number of times.

Stimuli, services, commands and lifecycle transitions all call these; observers receive each, refused ones too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NoReturn

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import AUTO_RUN
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.types import Value
from automax_ros.rack.base.observers import Observers, Operation
from automax_ros.rack.base.stop_cause import (
    KEEP_STATE,
    WITHOUT_BATTERY,
    OperationRefused,
    OperationsState,
    PowerReturn,
    StopCause,
)
from automax_ros.rack.modules.module import Module
from automax_ros.rack.operations.forces import ForceTable
from automax_ros.rack.tasks.installation import Installation, PreparedReload, RackError
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.writers import PRESET_WRITER
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.tasks.keep_values import carry_over
from automax_ros.runtime.tasks.task import Status
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler

__all__ = ["KEEP_STATE", "OperationRefused", "Operations"]
POWER_OFF = "the power is off: switch it on first"
_POWER = EventKey(EventClass.OUTSIDE, 0, "power")


def begin_memory(config: RackConfig, inputs: ProcessInputs, memory: CommonMemory) -> None:
    """Write the presets of the rack's file, with the rack as the writer."""
    for variable in config.variables:
        for element, value in enumerate(variable.presets):
            inputs.write_from_outside(memory.view(variable.name), value, PRESET_WRITER, element)


def write_status(config: RackConfig, modules: Sequence[Module], memory: CommonMemory, *, battery_good: bool) -> None:
    """Set AUTORUNSTATUS@, and BATTERYSTATUSn@ of the slots that hold a module with a battery (2.4.6)."""
    shown = {f"BATTERYSTATUS{item.config.slot}@": battery_good for item in modules if item.config.has_battery}
    shown[AUTO_RUN] = config.auto_run
    for view, spec in enumerate(memory.specs):
        if spec.name in shown:
            memory.write_from_outside(view, shown[spec.name], PRESET_WRITER)


class OperationReports:
    """Reports operations to a rack's observers, refused ones too."""

    def __init__(self, observers: Observers, scheduler: Scheduler) -> None:
        self._observers, self._scheduler = observers, scheduler

    def done(self, what: str, task: str = "", *, reason: str = "", detail: str = "") -> None:
        """Report an operation that was carried out."""
        self._observers.operated(Operation(self._scheduler.now_ns, what, task, True, reason, detail))

    def failed(self, what: str, reason: str, task: str = "", detail: str = "") -> None:
        """Report an operation that was not carried out."""
        self._observers.operated(Operation(self._scheduler.now_ns, what, task, False, reason, detail))

    def refuse(self, what: str, reason: str, task: str = "", detail: str = "") -> NoReturn:
        """Report a refusal.

        Raises:
            OperationRefused: always, with the reason.
        """
        self.failed(what, reason, task, detail)
        raise OperationRefused(reason)


class Operations:
    """Operates one rack. ``stopped`` is the cause of a STOP ALL, None while the rack runs.

    ``ran_at_power_off`` are the tasks that AUTO RUN starts again, ``deleted`` those that cannot run until they are
    reloaded; ``battery_good`` is the value of BATTERYSTATUSn@. ``installation`` prepares sources for ``install``,
    ``reports`` notifies observers.
    """

    def __init__(
        self,
        config: RackConfig,
        modules: Sequence[Module],
        installation: Installation,
        memory: CommonMemory,
        scheduler: Scheduler,
        events: Events,
        channels: Channels,
        observers: Observers,
        forcing: ForceTable,
        elsewhere: frozenset[tuple[int, int]] = frozenset(),
    ) -> None:
        """Create from the parts of a rack; ``elsewhere`` (views and elements in other processes) is not cleared."""
        self._elsewhere = elsewhere
        self._forcing = forcing
        self._events, self._channels = events, channels
        self._config, self._modules, self.installation = config, modules, installation
        self._memory, self._scheduler, self._observers = memory, scheduler, observers
        self.reports = OperationReports(observers, scheduler)
        self._tasks = {item.task.name: item for module in modules for item in module.tasks}
        self._ticks = {item.task.name: module.config.tick_ns for module in modules for item in module.tasks}
        self._critical = {task.name for _, task in config.placed_tasks if task.critical}
        self.ran_at_power_off: frozenset[str] = frozenset()
        self.deleted: frozenset[str] = frozenset()
        self.starting: frozenset[str] | None = None
        self._beginning, self._begins = set[str](), False
        self._power_return: PowerReturn | None = None
        self._power_event: ScheduledEvent | None = None
        self.powered = self.battery_good = True
        self.stopped: StopCause | None = None

    @property
    def now_ns(self) -> int:
        """Rack time."""
        return self._scheduler.now_ns

    @property
    def stop_reason(self) -> str | None:
        """Why all tasks were stopped; None while the rack runs."""
        return None if self.stopped is None else self.stopped.reason

    def start(self, first: Callable[[], None] | None = None, *, joining: bool = False) -> None:
        """Power the modules on, and put tasks into RUN with their first scan at this instant.

        These are all tasks, or those of ``starting`` if it is set: the tasks that ran before a power-up. With
        ``joining`` other processes run this rack already: first scans come at the next ticks, and none if it is
        stopped. ``first`` is called before any start-up part: for its operations the tasks count as running, and they
        decide which of them start.
        """
        for module in self._modules:
            module.power_on()
        now, self._begins = self._scheduler.now_ns, True
        self._beginning = set(self._tasks if self.starting is None else self.starting)
        if first is not None:
            first()
        begins = [item for item in self._in_starting_order() if item.name in self._beginning]
        self._beginning, self._begins = set(), False
        if not (joining and self.stopped):
            self._run_together(begins, self._next_tick if joining else lambda _: now)

    def run(self, name: str) -> None:
        """Put a task into RUN: its start-up part now, its first scan at the next tick of its Processor (decision).

        Raises:
            OperationRefused: there is no such task, it runs already, it has faulted and its error log was not cleared
                since (J2-3106-1 p. 12-4), it was deleted, or the power is off.
        """
        task = self.find("run", name)
        if self._runs(task):
            self.reports.refuse("run", f"task {name} runs already", name)
        if name in self.deleted:
            self.reports.refuse("run", f"task {name} was deleted: reload it first", name)
        self._refuse_faulted("run", [task])
        self._run_together([task], self._next_tick)
        self.reports.done("run", name)

    def run_all(self) -> None:
        """Put all tasks that do not run into RUN, in the order of priority and name, except deleted ones.

        Raises:
            OperationRefused: a task has faulted and its error log was not cleared since, or the power is off.
        """
        self.need_power("run_all")
        resting = [item for item in self._in_starting_order() if item.name not in self.deleted and not self._runs(item)]
        self._refuse_faulted("run_all", resting)
        self._run_together(resting, self._next_tick)
        self.reports.done("run_all")

    def stop(self, name: str) -> None:
        """Stop a task; its locals keep the values of its last whole scan. Do nothing to one that does not run.

        Raises:
            OperationRefused: there is no such task, it is critical (J2-3106-1 p. 8-2), or the power is off.
        """
        item = self.find("stop", name)
        self._refuse_critical("stop", item)
        item.stop()
        self._beginning.discard(name)
        self.reports.done("stop", name)

    def stop_tasks(self) -> None:
        """Stop all tasks; memory is unchanged."""
        for item in self._tasks.values():
            item.stop()
        self._beginning.clear()

    def stop_all(self, reason: str, code: str | None = None, task: str = "") -> None:
        """Stop all tasks of the rack, by command or because of a fault (2.4.5).

        Volatile commons and outputs become 0; inputs, forced and non-volatile variables, locals and error logs stay.
        ``code`` is the hardware's for the fault, ``task`` the one that caused it.

        Raises:
            OperationRefused: the power is off.
        """
        self.need_power("stop_all")
        self.stopped = StopCause(self._scheduler.now_ns, reason, code, task)
        self.stop_tasks()
        self._events.clear()
        self._channels.clear()
        self._clear_memory(keep_non_volatile=True)
        for module in self._modules:
            module.stopped_all()
        self.reports.done("stop_all", task, reason=reason, detail=code or "")

    def clear_errors(self, name: str | None = None) -> None:
        """Clear the error log of a task or of all; a faulted task becomes a stopped one, which can be put into RUN.

        Raises:
            OperationRefused: there is no such task, or the power is off.
        """
        self.need_power("clear_errors")
        cleared = list(self._tasks.values()) if name is None else [self.find("clear_errors", name)]
        for item in cleared:
            item.task.clear_errors()
            if item.task.status is Status.FAULTED:
                item.task.status = Status.STOPPED
        self.reports.done("clear_errors", name or "")

    def reload(self, name: str, source: SourceText, *, keep_state: bool = False) -> None:
        """Replace a task's source while the others run: an installation, so locals are 0, tunables as the source says.

        Forces stay if the new source has a simple local of that name, else they are released, and observers are
        notified (decision). With ``keep_state`` locals and tunables keep their values by name, if they fit
        (``carry_over``). A task that ran is put into RUN again. If the source has errors the old task continues. A
        deleted task is restored.

        Raises:
            OperationRefused: there is no such task, it runs and is critical (decision: it would stop alone), or the
                power is off.
            RackError: the source has errors.
        """
        self.admit_reload(name)
        self.install(self.installation.prepare(name, source), keep_state=keep_state)

    def admit_reload(self, name: str) -> None:
        """Check that a task may be reloaded now, whatever its new source is.

        Raises:
            OperationRefused: as ``reload``.
        """
        self._refuse_critical("reload", self.find("reload", name))

    def install(self, prepared: PreparedReload, *, keep_state: bool = False) -> None:
        """Finish a ``reload`` whose source was prepared, if no other task was reloaded since.

        Raises:
            OperationRefused, RackError: as ``reload``.
        """
        name, source = prepared.task, prepared.source
        self.admit_reload(name)
        item = self._tasks[name]
        try:
            compiled = self.installation.take(prepared)
        except RackError as error:
            self.reports.failed("reload", str(error), name)
            raise
        ran = item.task.status is Status.RUNNING
        item.stop()  # A scan in progress is abandoned first: only then the task's values are consistent.
        before, values, forces = item.task.layout, item.task.snapshot(), item.task.forces
        item.install(compiled, source)
        if keep_state:
            carry_over(before, values, item.task)
        released = self._hold_again(item, forces)
        self.deleted -= {name}
        self.reports.done("reload", name, detail=KEEP_STATE if keep_state else "")
        self._report_released(item, released)
        if ran:
            self._run_together([item], self._next_tick)

    def delete(self, name: str) -> None:
        """Delete a resting task: it loses all its values and cannot run until it is reloaded (decision).

        Raises:
            OperationRefused: there is no such task, it runs, it was deleted already, or the power is off.
        """
        item = self.find("delete", name)
        if self._runs(item):
            self.reports.refuse("delete", f"task {name} runs: stop it first", name)
        if name in self.deleted:
            self.reports.refuse("delete", f"task {name} was deleted already", name)
        released = [f"{name}.{local}" for local in item.task.forces]
        item.install(item.task.compiled, item.source)
        self._hold_again(item, {})
        self.deleted |= {name}
        self.reports.done("delete", name)
        self._report_released(item, released)

    def power(self, off_for_ns: int, *, battery: bool = True) -> None:
        """Switch the power off, and on again after a time, unless ``power_on`` does so before.

        Raises:
            OperationRefused: it is off already.
            ValueError: the time is negative.
        """
        if off_for_ns < 0:
            raise ValueError(f"the power cannot be off for {off_for_ns} ns")
        self.power_off()
        self._expect_power(PowerReturn(self._scheduler.now_ns + off_for_ns, battery))

    def power_off(self) -> None:
        """Switch the power off: everything stops, and volatile memory and outputs are lost (2.4.5).

        Raises:
            OperationRefused: it is off already.
        """
        if not self.powered:
            self.reports.refuse("power_off", "the power is off already")
        self.ran_at_power_off = frozenset(name for name, item in self._tasks.items() if self._runs(item))
        self._beginning.clear()
        self.powered = False
        for module in self._modules:
            module.power_off()
        self._events.clear()
        self._channels.clear()
        self._clear_memory(keep_non_volatile=True)
        self.reports.done("power_off")

    def power_on(self, *, battery: bool = True, auto_run: bool | None = None) -> None:
        """Switch the power on again.

        Without a good ``battery`` non-volatile commons, locals, tunables, error logs and forces are as at installation;
        the tasks themselves are there again, as if they had been loaded (decision). With ``auto_run`` (else as the rack
        file says) the tasks that ran when the power went are put into RUN (J2-3106-1 p. 12-4); a task that was stopped,
        or that a fault has stopped, was not running then.

        Raises:
            OperationRefused: it is on.
        """
        if self.powered:
            self.reports.refuse("power_on", "the power is on")
        self._expect_power(None)
        self.powered, self.battery_good = True, battery
        if not battery:
            self._memory.now_ns = self._scheduler.now_ns
            self._forcing.release_all(PRESET_WRITER)
        self._clear_memory(keep_non_volatile=battery)
        if not battery:
            for item in self._tasks.values():
                item.install(item.task.compiled, item.source)
        for module in self._modules:
            module.power_on()
        self.reports.done("power_on", detail="" if battery else WITHOUT_BATTERY)
        if self._config.auto_run if auto_run is None else auto_run:
            again = [item for item in self._in_starting_order() if item.task.name in self.ran_at_power_off]
            self._run_together(again, self._next_tick)

    def state(self) -> OperationsState:
        """Return the operating state."""
        return OperationsState(
            self.powered, self.battery_good, self.stopped, self.ran_at_power_off, self.deleted, self._power_return
        )

    def load(self, state: OperationsState) -> None:
        """Restore an operating state."""
        self.powered, self.battery_good, self.stopped = state.powered, state.battery_good, state.stopped
        self.ran_at_power_off, self.deleted = state.ran_at_power_off, state.deleted
        self._expect_power(state.power_return)

    def write_status(self) -> None:
        """Set AUTORUNSTATUS@, and BATTERYSTATUSn@ of the slots that hold a module with a battery (2.4.6)."""
        write_status(self._config, self._modules, self._memory, battery_good=self.battery_good)

    def _run_together(self, tasks: Sequence[ScheduledTask], first_ns: Callable[[ScheduledTask], int]) -> None:
        """Put tasks into RUN: first all start-up parts, then scans; a fault among them stops all."""
        if tasks:
            self.stopped = None
        if self._begins:
            self._beginning.update(item.name for item in tasks)
            return
        for item in tasks:
            if self.stopped is None:
                item.start_up()
        for item in tasks:
            item.scan_from(first_ns(item))

    def _runs(self, item: ScheduledTask) -> bool:
        """Return whether a task runs, or is among those that ``start`` puts into RUN at this instant."""
        return item.task.status is Status.RUNNING or item.name in self._beginning

    def _next_tick(self, item: ScheduledTask) -> int:
        tick = self._ticks[item.task.name]
        return (self._scheduler.now_ns // tick + 1) * tick

    def _in_starting_order(self) -> list[ScheduledTask]:
        return sorted(self._tasks.values(), key=lambda item: (item.task.priority, item.task.name))

    def _clear_memory(self, *, keep_non_volatile: bool) -> None:
        kept = self._elsewhere.union(*(module.kept for module in self._modules))
        self._memory.now_ns = self._scheduler.now_ns
        self._memory.clear(PRESET_WRITER, keep_non_volatile=keep_non_volatile, kept=kept)
        self.write_status()

    def _expect_power(self, expected: PowerReturn | None) -> None:
        if self._power_event is not None:
            self._power_event.cancel()
        self._power_return, self._power_event = expected, None
        if expected is not None:
            self._power_event = self._scheduler.at(
                expected.at_ns, _POWER, lambda _: self.power_on(battery=expected.battery)
            )

    def _hold_again(self, item: ScheduledTask, forces: Mapping[str, Value]) -> list[str]:
        """Restore the forces of an installed task; return the names that it lacks, which are released."""
        self._memory.now_ns = self._scheduler.now_ns
        released = self._forcing.hold_again(item.task, forces, PRESET_WRITER)
        self._observers.report_writes()
        return released

    def _report_released(self, item: ScheduledTask, names: Sequence[str]) -> None:
        if names:
            self.reports.done("unforce", item.name, detail=" ".join(names))

    def need_power(self, what: str, task: str = "") -> None:
        """Refuse an operation while the power is off.

        Raises:
            OperationRefused: it is off.
        """
        if not self.powered:
            self.reports.refuse(what, POWER_OFF, task)

    def _refuse_critical(self, what: str, item: ScheduledTask) -> None:
        if item.name in self._critical and self._runs(item):
            why = "is critical: it cannot be stopped on its own; use STOP ALL"
            self.reports.refuse(what, f"task {item.name} {why}", item.name)

    def _refuse_faulted(self, what: str, tasks: Sequence[ScheduledTask]) -> None:
        faulted = [item.name for item in tasks if item.task.status is Status.FAULTED]
        if faulted:
            self.reports.refuse(what, f"a fault has stopped {' '.join(faulted)}: clear the error log first", faulted[0])

    def find(self, what: str, name: str) -> ScheduledTask:
        """Return the task of an operation.

        Raises:
            OperationRefused: there is no such task, or the power is off.
        """
        self.need_power(what, name)
        item = self._tasks.get(name)
        if item is None:
            hint = did_you_mean(name, self._tasks) or f"it has {', '.join(self._tasks)}"
            self.reports.refuse(what, f"the rack has no task {quoted(name)}: {hint}", name)
        return item
