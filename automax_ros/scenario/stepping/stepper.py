"""A rack under a person's hand: it goes on by ticks, scans and BASIC lines, and halts where it was told to.

stepper = Stepper(config)
stepper.start()
stepper.break_at("SPEED", 1130)
halt = stepper.go(NS_PER_S)      # at most a second further
halt.why, halt.task, halt.line, stepper.value("SPEED.COUNT%")
stepper.line()                   # one line further
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from automax_ros.core.faults import UserError
from automax_ros.core.text import quoted
from automax_ros.core.types import Value
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.runtime.tasks.task import Status
from automax_ros.scenario.stepping.held_scans import ByLines
from automax_ros.scenario.stepping.variables import Change, Variable, Variables

LONGEST_WAIT_NS = 60_000_000_000
"""How long a step to a task's next scan lasts at most: the task may wait for an event (decision)."""


class Why(enum.Enum):
    """Why a rack halts."""

    DONE = "done"
    TIME = "the time is over"
    LINE = "breakpoint"
    CHANGE = "changed"
    STOPPED = "STOP ALL"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Halt:
    """Where a rack halts: ``task`` and ``line`` where it is in the middle of a scan, before that line."""

    why: Why
    at_ns: int
    task: str = ""
    line: int = 0
    changes: tuple[Change, ...] = ()
    cause: StopCause | None = None


class Stepper:
    """Steps one rack in simulated time. ``interrupted`` is asked between events whether to halt."""

    def __init__(self, config: RackConfig, *, interrupted: Callable[[], bool] = lambda: False) -> None:
        """Build the rack; nothing runs yet.

        Raises:
            RackError: a task has errors.
        """
        self._execution = ByLines()
        self.by_lines = config.execution is Timing.IDEAL
        self.rack = Rack(config, execution=self._execution if self.by_lines else None)
        self.variables = Variables(self.rack, self._execution)
        self.lines: list[tuple[str, int]] = []
        self.watched: dict[str, Variable] = {}
        self._interrupted = interrupted
        self._at_once = ""

    def start(self, settings: Sequence[tuple[str, Value]] = (), first: Callable[[], None] | None = None) -> None:
        """Put the rack into RUN, as ``Rack.start``."""
        self.rack.start(settings, first)

    @property
    def place(self) -> tuple[str, int]:
        """The task and the line before which its scan is held; ("", 0) between scans."""
        held = self._execution.held
        return (held.item.name, held.line) if held is not None else ("", 0)

    def break_at(self, task: str, line: int) -> None:
        """Halt before a BASIC line of a task whenever a scan comes to it.

        Raises:
            Fault: there is no such task or line, or scans of the task cannot be held.
        """
        item = self._steppable(task)
        found = item.task.compiled.scan_lines.lines
        if line not in found:
            after = min((other for other in found if other > line), default=None)
            hint = f"the next line with a statement is {after}" if after is not None else None
            raise UserError(f"line {line} of task {item.name} holds no statement of its scan", hint)
        if (item.name, line) not in self.lines:
            self.lines.append((item.name, line))
        self._hold()

    def break_on(self, name: str) -> Variable:
        """Halt whenever a variable has changed; return it.

        Raises:
            NameFault: there is no such variable.
        """
        variable = self.variables.find(name)
        self.watched[variable.label] = variable
        return variable

    def clear(self, what: str) -> None:
        """Take a breakpoint away: ``SPEED:1130``, a variable's name, or ``all``.

        Raises:
            Fault: there is no such breakpoint.
        """
        plain = "".join(what.split()).upper()
        lines = [item for item in self.lines if plain in ("ALL", f"{item[0]}:{item[1]}")]
        names = [label for label in self.watched if plain in ("ALL", label)]
        if not lines and not names and plain != "ALL":
            raise UserError(f"there is no breakpoint {quoted(what)}")
        self.lines = [item for item in self.lines if item not in lines]
        for label in names:
            del self.watched[label]
        self._hold()

    def value(self, name: str) -> Value:
        """Return what a variable holds.

        Raises:
            NameFault: there is no such variable.
        """
        return self.variables.find(name).read()

    def go(self, for_ns: int) -> Halt:
        """Go on for a time at most."""
        return self._go(self.rack.now_ns + for_ns, lambda: False)

    def until(self, time_ns: int) -> Halt:
        """Go on to a rack time at most; nothing of that instant has happened then."""
        return self._go(time_ns, lambda: False)

    def ticks(self, number: int, task: str = "") -> Halt:
        """Go on for ticks of a task's Processor, or of the rack's first module with tasks.

        Raises:
            Fault: there is no such task.
        """
        modules = self.rack.task_modules
        if task:
            item = self._task(task)
            modules = [module for module in modules if item in module.tasks]
        return self.go(number * modules[0].config.tick_ns)

    def scan(self, task: str = "") -> Halt:
        """Go on until a task has ended a scan, or any task where none is named.

        Raises:
            Fault: there is no such task, or it does not run.
        """
        tasks = [self._running(task)] if task else self.rack.scheduled
        before = {item.name: item.statistics.scans for item in tasks}
        return self._go(
            self.rack.now_ns + LONGEST_WAIT_NS,
            lambda: any(item.statistics.scans != before[item.name] for item in tasks),
        )

    def line(self, task: str = "") -> Halt:
        """Go on to the next line of the scan that is held; between scans to the first line of the next scan of a task.

        Raises:
            Fault: there is no such task, it does not run, or its scans cannot be held.
        """
        if self._execution.held is not None:
            before = self._read()
            if self._execution.advance() or self._follows():
                return self._halt(Why.CHANGE if self._read() != before else Why.DONE, before)
            return self._halt(Why.STOPPED if self.rack.operations.stopped else Why.DONE, before)
        items = [self._steppable(self._running(task).name)] if task else list(self._all_steppable())
        try:
            self._hold({item.name: item for item in items})
            self._at_once = "every line"
            return self._go(self.rack.now_ns + LONGEST_WAIT_NS, lambda: False)
        finally:
            self._at_once = ""
            self._hold()

    def _go(self, end_ns: int, is_done: Callable[[], bool]) -> Halt:
        """Go on by single events until something says halt."""
        stopped = self.rack.operations.stopped
        while True:
            before = self._read()
            if self._execution.held is not None:
                if self._through_scan():
                    return self._halt(Why.CHANGE if self._read() != before else Why.LINE, before)
            elif not self.rack.scheduler.step(end_ns):
                return self._halt(Why.TIME, before)
            if self._execution.held is not None and not self._execution.held.line:
                continue
            if self._read() != before:
                return self._halt(Why.CHANGE, before)
            if self.rack.operations.stopped is not None and stopped is None:
                return self._halt(Why.STOPPED, before)
            if is_done():
                return self._halt(Why.DONE, before)
            if self._interrupted():
                return self._halt(Why.INTERRUPTED, before)

    def _through_scan(self) -> bool:
        """Execute the held scan to its next breakpoint, TRUE, or to its end, FALSE."""
        before = self._read()
        while self._execution.advance():
            if self.place in self.lines or self._at_once or self._read() != before:
                return True
        return False

    def _follows(self) -> bool:
        """Go to the first line of a scan that the end of another has begun; FALSE where there is none."""
        return self._execution.held is not None and self._execution.advance()

    def _halt(self, why: Why, before: dict[str, Value]) -> Halt:
        now = self._read()
        changes = tuple(Change(label, before[label], now[label]) for label in now if before.get(label) != now[label])
        task, line = self.place
        return Halt(why, self.rack.now_ns, task, line, changes, self.rack.operations.stopped)

    def _read(self) -> dict[str, Value]:
        return {label: variable.read() for label, variable in self.watched.items()}

    def _hold(self, others: dict[str, ScheduledTask] | None = None) -> None:
        items = {item.name: item for item in self.rack.scheduled}
        self._execution.held_tasks = {**{task: items[task] for task, _ in self.lines}, **(others or {})}

    def _task(self, name: str) -> ScheduledTask:
        items = {item.name: item for item in self.rack.scheduled}
        item = items.get(name.strip().upper())
        if item is None:
            raise UserError(f"the rack has no task {quoted(name)}", f"it has {', '.join(items)}")
        return item

    def _running(self, name: str) -> ScheduledTask:
        item = self._task(name)
        if item.task.status is not Status.RUNNING:
            raise UserError(
                f"task {item.name} does not run: {item.task.status.value}", f"put it into RUN: run {item.name}"
            )
        return item

    def _steppable(self, name: str) -> ScheduledTask:
        item = self._task(name)
        if not self.by_lines:
            hint = "step it in ideal execution (`automax step --ideal`); breakpoints on variables work in both"
            raise UserError(
                "scans of modeled execution cannot be held at a line: higher priorities go on meanwhile", hint
            )
        return item

    def _all_steppable(self) -> list[ScheduledTask]:
        return [self._steppable(item.name) for item in self.rack.scheduled]
