"""Steps a rack by hand: by ticks, scans and BASIC lines, up to breakpoints.

stepper = Stepper(config)
stepper.start()
stepper.break_at("SPEED", 1130)
halt = stepper.go(NS_PER_S)      # at most a second further
halt.why, halt.task, halt.line, stepper.value("SPEED.COUNT%")
stepper.line()                   # one line further
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import cast

from automax_ros.compile.base.scan_io import LineValues
from automax_ros.compile.compiler import ScanSteps
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UserError
from automax_ros.language.tree.tree import Scope
from automax_ros.rack.base.local_names import local_named
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.runtime.scan.execution import IDEAL, Place, ScanJob, Steps
from automax_ros.runtime.tasks.task import ScanRecord, Status, Task


class HeldScan:
    """A scan that has started and is held before a line. ``line`` is that line, 0 before ``advance`` was called."""

    def __init__(self, item: ScheduledTask, now_ns: int, skipped: int) -> None:
        """Create the scan without executing it: ``advance`` goes to the first line."""
        task = item.task
        self.item = item
        self.line = 0
        self.values: Mapping[str, Value | list[Value]] = {}
        form = cast(ScanSteps, task.compiled.scan_lines.scan)
        self._names = [*(field.name for field in task.compiled.layout.fields), *task.compiled.latched]
        self._skipped = skipped
        self._record: ScanRecord | None = None
        self._steps = cast(
            Generator[LineValues, None, ScanRecord | None], task.scan_modeled(now_ns, skipped, form=form)
        )

    def advance(self) -> bool:
        """Go to the next line; return FALSE if the scan has ended, which ``finish`` reports.

        ``values`` are then the scan's values by names of its layout: locals, block states, and its latched commons.
        """
        try:
            self.line, values = next(self._steps)
        except StopIteration as end:
            self._record = end.value
            return False
        self.values = dict(zip(self._names, values, strict=True))
        return True

    def finish(self) -> None:
        """Report the ended scan, which may start other scans."""
        self.item.statistics.skipped += self._skipped
        self.item.done(self._record)

    def close(self) -> None:
        """Abandon the scan: the task is as before it; its writes to memory stay."""
        self._steps.close()


class ByLines:
    """An execution that holds the scans of the tasks in ``held_tasks``. ``held`` is the scan that waits."""

    def __init__(self) -> None:
        self.held_tasks: dict[str, ScheduledTask] = {}
        self.held: HeldScan | None = None

    def begin(self, job: ScanJob, now_ns: int, skipped: int) -> None:
        """Execute a job, or hold it."""
        item = self.held_tasks.get(job.name)
        if item is None:
            job.whole(now_ns, skipped)
        else:
            self.held = HeldScan(item, now_ns, skipped)

    def advance(self) -> bool:
        """Go to the next line of the held scan; return FALSE at its end: then none is held, or one that follows it."""
        held = self.held
        assert held is not None
        if held.advance():
            return True
        self.held = None
        held.finish()
        return False

    def busy(self, job: ScanJob) -> bool:
        """Return whether a job's scan is held."""
        return self.held is not None and self.held.item is job

    def drop(self, job: ScanJob) -> None:
        """Abandon a held scan."""
        if self.held is not None and self.held.item is job:
            self.held.close()
            self.held = None

    def place(self, job: ScanJob) -> Place | None:
        """Return None: another rack could not continue a held scan."""
        return IDEAL.place(job)

    def resume(self, job: ScanJob, place: Place, steps: Steps | None) -> None:
        """Refuse, as ideal execution does.

        Raises:
            ValueError: always.
        """
        IDEAL.resume(job, place, steps)


@dataclass(frozen=True)
class SteppedVariable:
    """A simple variable or an array's element. ``task`` is its task, "" for a common."""

    label: str
    type: DataType
    length: int
    task: str
    read: Callable[[], Value]


@dataclass(frozen=True)
class Change:
    """Values of a variable before and after a step."""

    label: str
    before: Value
    after: Value


@dataclass(frozen=True)
class Variables:
    """Finds variables of a rack; a task's own have, in a held scan, their values at its line."""

    rack: Rack
    execution: ByLines

    def find(self, name: str) -> SteppedVariable:
        """Return the variable with a name.

        Raises:
            NameFault: there is no such variable or element.
        """
        return self._of_task(name) if "." in name else self._common(name)

    def of_task(self, name: str) -> Iterator[SteppedVariable]:
        """Yield the simple variables of a task, its commons too, in the order of declaration."""
        for symbol in self.rack.task(name).compiled.program.symbols.values():
            if not symbol.dimensions:
                common = symbol.scope is Scope.COMMON
                yield self._common(symbol.name) if common else self._of_task(f"{name}.{symbol.name}")

    def _common(self, name: str) -> SteppedVariable:
        meant = self.rack.config.common(name)
        view = self.rack.memory.view(meant.name)
        read = partial(self.rack.memory.read_now, view, meant.index)
        return SteppedVariable(meant.label, meant.variable.type, meant.variable.length, "", read)

    def _of_task(self, name: str) -> SteppedVariable:
        meant = local_named(self.rack.tasks, name)
        kind = meant.variable
        read = partial(self._local, meant.task, kind.name, meant.element.index)
        return SteppedVariable(meant.label, kind.type, kind.length, meant.task.name, read)

    def _local(self, task: Task, name: str, index: int) -> Value:
        held = self.execution.held
        value = held.values[name] if held is not None and held.item.task is task and held.line else task.value(name)
        return value[index] if isinstance(value, list) else value


LONGEST_WAIT_NS = 60_000_000_000
"""Longest step to a task's next scan: the task may wait for an event (decision)."""


class Why(enum.Enum):
    """The reasons for which a rack halts."""

    DONE = "done"
    TIME = "the time is over"
    LINE = "breakpoint"
    CHANGE = "changed"
    STOPPED = "STOP ALL"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Halt:
    """Where a rack halts: in the middle of a scan of ``task``, before ``line``, if these are set."""

    why: Why
    at_ns: int
    task: str = ""
    line: int = 0
    changes: tuple[Change, ...] = ()
    cause: StopCause | None = None


class Stepper:
    """Steps one rack in simulated time. ``interrupted`` is called between events and returns whether to halt."""

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
        self.watched: dict[str, SteppedVariable] = {}
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
        """Halt before a BASIC line of a task whenever a scan reaches it.

        Raises:
            UserError: there is no such task or line, or scans of the task cannot be held.
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

    def break_on(self, name: str) -> SteppedVariable:
        """Halt whenever a variable has changed; return it.

        Raises:
            NameFault: there is no such variable.
        """
        variable = self.variables.find(name)
        self.watched[variable.label] = variable
        return variable

    def clear(self, what: str) -> None:
        """Remove a breakpoint: ``SPEED:1130``, a variable's name, or ``all``.

        Raises:
            UserError: there is no such breakpoint.
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
        """Return the value of a variable.

        Raises:
            NameFault: there is no such variable.
        """
        return self.variables.find(name).read()

    def go(self, for_ns: int) -> Halt:
        """Run for a time at most."""
        return self._go(self.rack.now_ns + for_ns, lambda: False)

    def until(self, time_ns: int) -> Halt:
        """Run to a rack time at most; nothing of that instant has happened then."""
        return self._go(time_ns, lambda: False)

    def ticks(self, number: int, task: str = "") -> Halt:
        """Run for ticks of a task's Processor, or of the rack's first module with tasks.

        Raises:
            UserError: there is no such task.
        """
        modules = self.rack.task_modules
        if task:
            item = self._task(task)
            modules = [module for module in modules if item in module.tasks]
        return self.go(number * modules[0].config.tick_ns)

    def scan(self, task: str = "") -> Halt:
        """Run until a task has ended a scan, or any task if none is named.

        Raises:
            UserError: there is no such task, or it does not run.
        """
        tasks = [self._running(task)] if task else self.rack.scheduled
        before = {item.name: item.statistics.scans for item in tasks}
        return self._go(
            self.rack.now_ns + LONGEST_WAIT_NS,
            lambda: any(item.statistics.scans != before[item.name] for item in tasks),
        )

    def line(self, task: str = "") -> Halt:
        """Go to the next line of the held scan, or between scans to the first line of a task's next scan.

        Raises:
            UserError: there is no such task, it does not run, or its scans cannot be held.
        """
        if self._execution.held is not None:
            before = self._read()
            if self._execution.advance() or self._follows():
                return self._halt(Why.CHANGE if self._read() != before else Why.DONE, before)
            return self._halt(Why.STOPPED if self.rack.operations.stopped else Why.DONE, before)
        names = [self._running(task).name] if task else [item.name for item in self.rack.scheduled]
        items = [self._steppable(name) for name in names]
        try:
            self._hold({item.name: item for item in items})
            self._at_once = "every line"
            return self._go(self.rack.now_ns + LONGEST_WAIT_NS, lambda: False)
        finally:
            self._at_once = ""
            self._hold()

    def _go(self, end_ns: int, is_done: Callable[[], bool]) -> Halt:
        """Execute single events until there is a reason to halt."""
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
        """Execute the held scan to its next breakpoint and return TRUE, or to its end and return FALSE."""
        before = self._read()
        while self._execution.advance():
            if self.place in self.lines or self._at_once or self._read() != before:
                return True
        return False

    def _follows(self) -> bool:
        """Go to the first line of a scan that the end of another has started; return FALSE if there is none."""
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
