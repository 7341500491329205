"""What an operator does to a rack: RUN, STOP, reload, STOP ALL, clear, power. Each any number of times.

Stimuli, services, commands and lifecycle transitions all call these; observers see each, refused ones too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NoReturn

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.rack.config import RackConfig
from automax_ros.rack.installation import Installation, RackError
from automax_ros.rack.modules.kind import Module
from automax_ros.rack.names import AUTO_RUN
from automax_ros.rack.observers import Observers, Operation
from automax_ros.rack.scheduled_task import ScheduledTask
from automax_ros.rack.writers import PRESET_WRITER
from automax_ros.running.events import Events
from automax_ros.running.memory import CommonMemory
from automax_ros.running.scheduler import Scheduler
from automax_ros.running.task import Status


class OperationRefused(Exception):
    """An operation cannot be carried out now; the text says why and what to do."""


@dataclass(frozen=True)
class StopCause:
    """What stopped all tasks: ``code`` is the hardware's, None where none is known, ``task`` who caused it, or ""."""

    time_ns: int
    reason: str
    code: str | None = None
    task: str = ""


class Operations:
    """Operates one rack. ``stopped`` is what stopped all tasks, None while the rack runs.

    ``ran_at_power_off`` are the tasks that AUTO RUN starts again; ``battery_good`` is what BATTERYSTATUSn@ show.
    """

    def __init__(
        self,
        config: RackConfig,
        modules: Sequence[Module],
        installation: Installation,
        memory: CommonMemory,
        scheduler: Scheduler,
        events: Events,
        observers: Observers,
    ) -> None:
        """Take the parts of a rack that is built and not yet started."""
        self._events = events
        self._config, self._modules, self._installation = config, modules, installation
        self._memory, self._scheduler, self._observers = memory, scheduler, observers
        self._tasks = {item.task.name: item for module in modules for item in module.tasks}
        self._ticks = {item.task.name: module.config.tick_ns for module in modules for item in module.tasks}
        self._critical = {task.name for _, task in config.placed_tasks if task.critical}
        self.ran_at_power_off: frozenset[str] = frozenset()
        self.powered = self.battery_good = True
        self.stopped: StopCause | None = None

    @property
    def stop_reason(self) -> str | None:
        """Why all tasks were stopped, None while the rack runs."""
        return None if self.stopped is None else self.stopped.reason

    def start(self) -> None:
        """Begin what modules do by themselves, and put all tasks into RUN with their first scan at this instant."""
        for module in self._modules:
            module.power_on()
        now = self._scheduler.now_ns
        self._run_together(self._in_starting_order(), lambda _: now)

    def run(self, name: str) -> None:
        """Put a task into RUN: its start-up part now, its first scan at the next tick of its Processor (decision).

        Raises:
            OperationRefused: there is no such task, it runs already, or the power is off.
        """
        task = self._task("run", name)
        if not self.powered:
            self._refuse("run", name, "the power is off: switch it on first")
        if task.task.status is Status.RUNNING:
            self._refuse("run", name, f"task {name} runs already")
        self._run_together([task], self._next_tick)
        self._tell("run", name)

    def run_all(self) -> None:
        """Put all tasks that do not run into RUN, in the order of priority and name.

        Raises:
            OperationRefused: the power is off.
        """
        if not self.powered:
            self._refuse("run_all", "", "the power is off: switch it on first")
        resting = [item for item in self._in_starting_order() if item.task.status is not Status.RUNNING]
        self._run_together(resting, self._next_tick)
        self._tell("run_all")

    def stop(self, name: str) -> None:
        """Stop a task between two scans; its locals keep their values. One that does not run stays as it is.

        Raises:
            OperationRefused: there is no such task, or it is critical (J2-3106-1 p. 8-2).
        """
        item = self._task("stop", name)
        if name in self._critical:
            self._refuse(
                "stop", name, f"task {name} is critical, it does not stop alone: STOP ALL stops it with all others"
            )
        item.stop()
        self._tell("stop", name)

    def stop_tasks(self) -> None:
        """Stop all tasks; memory keeps what it holds."""
        for item in self._tasks.values():
            item.stop()

    def stop_all(self, reason: str, code: str | None = None, task: str = "") -> None:
        """Stop all tasks of the rack, by command or because of a fault (2.4.5).

        Volatile commons and outputs become 0; inputs, forced and non-volatile variables, locals and error logs stay.
        ``code`` is the hardware's for the fault, ``task`` the one that caused it.
        """
        self.stopped = StopCause(self._scheduler.now_ns, reason, code, task)
        self.stop_tasks()
        self._events.clear()
        self._clear_memory(keep_non_volatile=True)
        for module in self._modules:
            module.stopped_all()
        self._tell("stop_all", task, reason=reason)

    def clear_errors(self, name: str | None = None) -> None:
        """Clear the error log of a task or of all; a faulted task is a stopped one then, and can be put into RUN.

        Raises:
            OperationRefused: there is no such task.
        """
        cleared = list(self._tasks.values()) if name is None else [self._task("clear_errors", name)]
        for item in cleared:
            item.task.errors.clear()
            if item.task.status is Status.FAULTED:
                item.task.status = Status.STOPPED
        self._tell("clear_errors", name or "")

    def reload(self, name: str, source: SourceText) -> None:
        """Replace a task's source while the others run: an installation, so locals are 0, tunables as the source says.

        A task that ran is put into RUN again. With errors in the source the old task goes on.

        Raises:
            OperationRefused: there is no such task.
            RackError: the source has errors.
        """
        item = self._task("reload", name)
        try:
            compiled = self._installation.compile(name, source)
        except RackError as error:
            self._tell("reload", name, ok=False, reason=str(error))
            raise
        ran = item.task.status is Status.RUNNING
        item.install(compiled, source)
        self._tell("reload", name)
        if ran:
            self._run_together([item], self._next_tick)

    def power_off(self) -> None:
        """Switch the power off: everything stops, and volatile memory and outputs are lost (2.4.5).

        Raises:
            OperationRefused: it is off already.
        """
        if not self.powered:
            self._refuse("power_off", "", "the power is off already")
        running = [name for name, item in self._tasks.items() if item.task.status is Status.RUNNING]
        self.ran_at_power_off = frozenset(running)
        self.powered = False
        for module in self._modules:
            module.power_off()
        self._events.clear()
        self._clear_memory(keep_non_volatile=True)
        self._tell("power_off")

    def power_on(self, *, battery: bool = True, auto_run: bool = False) -> None:
        """Switch the power on again.

        Without a good ``battery`` non-volatile commons, locals, tunables and error logs are as at installation. With
        ``auto_run`` the tasks that ran when the power went are put into RUN (J2-3106-1 p. 12-4).

        Raises:
            OperationRefused: it is on.
        """
        if self.powered:
            self._refuse("power_on", "", "the power is on")
        self.powered, self.battery_good = True, battery
        self._clear_memory(keep_non_volatile=battery)
        for item in self._tasks.values():
            if not battery:
                item.task.install(item.task.compiled)
            elif item.task.status is Status.FAULTED:
                item.task.status = Status.STOPPED
        for module in self._modules:
            module.power_on()
        self._tell("power_on")
        if auto_run:
            again = [item for item in self._in_starting_order() if item.task.name in self.ran_at_power_off]
            self._run_together(again, self._next_tick)

    def write_status(self) -> None:
        """Set AUTORUNSTATUS@, and BATTERYSTATUSn@ of the slots that hold a module with a battery (2.4.6)."""
        shown = {
            f"BATTERYSTATUS{item.config.slot}@": self.battery_good for item in self._modules if item.config.has_battery
        }
        shown[AUTO_RUN] = self._config.auto_run
        for view, spec in enumerate(self._memory.specs):
            if spec.name in shown:
                self._memory.write_from_outside(view, shown[spec.name], PRESET_WRITER)

    def _run_together(self, tasks: Sequence[ScheduledTask], first_ns: Callable[[ScheduledTask], int]) -> None:
        """Put tasks into RUN: first all start-up parts, then scans; a fault among them stops all."""
        if tasks:
            self.stopped = None
        for item in tasks:
            if self.stopped is None:
                item.start_up()
        for item in tasks:
            item.scan_from(first_ns(item))

    def _next_tick(self, item: ScheduledTask) -> int:
        tick = self._ticks[item.task.name]
        return (self._scheduler.now_ns // tick + 1) * tick

    def _in_starting_order(self) -> list[ScheduledTask]:
        return sorted(self._tasks.values(), key=lambda item: (item.task.priority, item.task.name))

    def _clear_memory(self, *, keep_non_volatile: bool) -> None:
        kept = frozenset[tuple[int, int]]().union(*(module.kept for module in self._modules))
        self._memory.now_ns = self._scheduler.now_ns
        self._memory.clear(PRESET_WRITER, keep_non_volatile=keep_non_volatile, kept=kept)
        self.write_status()

    def _task(self, what: str, name: str) -> ScheduledTask:
        item = self._tasks.get(name)
        if item is None:
            hint = did_you_mean(name, self._tasks) or f"it has {', '.join(self._tasks)}"
            self._refuse(what, name, f"the rack has no task {quoted(name)}: {hint}")
        return item

    def _tell(self, what: str, task: str = "", *, ok: bool = True, reason: str = "") -> None:
        self._observers.operated(Operation(self._scheduler.now_ns, what, task, ok, reason))

    def _refuse(self, what: str, task: str, reason: str) -> NoReturn:
        self._tell(what, task, ok=False, reason=reason)
        raise OperationRefused(reason)
