"""Halts a rack that keeps pace with the wall clock, steps it by scans and ticks, and resumes it.

While it is halted rack time is frozen: scans, plants and timeouts wait, and nothing is late afterwards. Operations and
writes are executed at the frozen instant. A step executes single events at their instants, as simulated time does, and
halts again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NoReturn, Protocol, runtime_checkable

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.base.observers import HALT, RESUME, STEP
from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status

LONGEST_STEP_NS = NS_PER_S
"""Most rack time of one step (decision: what waits for the rack meanwhile does not wait long)."""
DONE, TIME_OVER, STOPPED = "done", "the time is over", "STOP ALL"
"""The reasons for which a step ends."""


@runtime_checkable
class Haltable(Protocol):
    """A pacer that can freeze rack time; meanwhile it calls ``while_halted`` repeatedly."""

    halted: bool
    while_halted: Callable[[], object]

    def halt(self) -> None:
        """Freeze rack time."""
        ...

    def resume(self) -> None:
        """Continue rack time from where it is frozen."""
        ...


def is_halted(pace: object) -> bool:
    """Return whether a rack's pacer has frozen its time."""
    return isinstance(pace, Haltable) and pace.halted


@dataclass(frozen=True)
class Stepped:
    """Result of a step: why and at which rack time it ended, and how many scans of all tasks ended in it."""

    why: str
    at_ns: int
    scans: int


class Halting:
    """Halts, steps and resumes one rack.

    Raises:
        OperationRefused: all methods, if the operation is not possible now; observers receive the refusal.
    """

    def __init__(self, rack: Rack, pace: object) -> None:
        self._rack, self._pace, self._reports = rack, pace, rack.operations.reports

    @property
    def halted(self) -> bool:
        """Whether rack time is frozen."""
        return is_halted(self._pace)

    def halt(self) -> None:
        """Freeze rack time.

        A rack of which this process holds a part is not halted: the others would continue (decision). A rack that
        follows another's clock can be halted only by that clock.
        """
        if not self._rack.part.is_whole:
            self._reports.refuse(HALT, "the rack runs in several processes, which do not halt together")
        pace = self._haltable(HALT)
        if pace.halted:
            self._reports.refuse(HALT, "the rack is halted already")
        pace.halt()
        self._reports.done(HALT)

    def resume(self) -> None:
        """Continue rack time from where it is frozen."""
        pace = self._haltable(RESUME)
        if not pace.halted:
            self._reports.refuse(RESUME, "the rack is not halted")
        pace.resume()
        self._reports.done(RESUME)

    def step(self, what: str, task: str = "", count: int = 1, until_ns: int = 0) -> Stepped:
        """Execute scans or ticks, or run until a rack time: ``scan``, ``tick``, ``until``.

        ``task`` selects whose scans count, or whose Processor's ticks; "" is any task, and the first module with tasks.
        """
        steps: Mapping[str, Callable[[], Stepped]] = {
            "scan": lambda: self._scans(task, count),
            "tick": lambda: self._ticks(task, count),
            "until": lambda: self._until(until_ns),
        }
        if what not in steps:
            self._refuse(f"{quoted(what)} is not a step: {near_or_listed(what, list(steps))}")
        if not self.halted:
            self._refuse("the rack is not halted: pause it first")
        if count < 1:
            self._refuse(f"{count} steps cannot be made")
        self._reports.done(
            STEP, detail=f"until {until_ns / NS_PER_S:.9g} s" if what == "until" else f"{count} {what} {task}".strip()
        )
        return steps[what]()

    def _scans(self, task: str, count: int) -> Stepped:
        items = [item for item in self._rack.scheduled if task in ("", item.name)]
        if not items:
            known = [item.name for item in self._rack.scheduled]
            self._refuse(f"the rack has no task {quoted(task)}: {near_or_listed(task, known)}")
        if all(item.task.status is not Status.RUNNING for item in items):
            self._reports.refuse(
                STEP, f"{f'task {task} does not run' if task else 'no task runs'}: put it into RUN first"
            )
        wanted = sum(item.statistics.scans for item in items) + count
        return self._go(LONGEST_STEP_NS, lambda: sum(item.statistics.scans for item in items) >= wanted)

    def _ticks(self, task: str, count: int) -> Stepped:
        modules = self._rack.task_modules
        if task:
            modules = [module for module in modules if task in {item.name for item in module.tasks}]
        if not modules:
            self._reports.refuse(
                STEP, f"the rack has no task {quoted(task)}" if task else "the rack has no module with tasks"
            )
        for_ns = count * modules[0].config.tick_ns
        if for_ns > LONGEST_STEP_NS:
            self._refuse(f"{count} ticks are {for_ns / NS_PER_S:g} s: a step lasts at most 1 s")
        return self._go(for_ns, None)

    def _until(self, until_ns: int) -> Stepped:
        for_ns = until_ns - self._rack.now_ns
        if not 0 < for_ns <= LONGEST_STEP_NS:
            now_s = self._rack.now_ns / NS_PER_S
            self._reports.refuse(
                STEP, f"{until_ns / NS_PER_S:.9g} s is not within 1 s after {now_s:.9g} s, which it is now"
            )
        return self._go(for_ns, None)

    def _go(self, for_ns: int, is_done: Callable[[], bool] | None) -> Stepped:
        """Execute events for ``for_ns`` at most; without ``is_done`` the step is done when that time is over."""
        rack = self._rack
        ran, before, end_ns = rack.operations.stopped is None, self._all_scans(), rack.now_ns + for_ns
        why = DONE if is_done is None else TIME_OVER
        while rack.scheduler.step(end_ns):
            if ran and rack.operations.stopped is not None:
                why = STOPPED
                break
            if is_done is not None and is_done():
                why = DONE
                break
        return Stepped(why, rack.now_ns, self._all_scans() - before)

    def _all_scans(self) -> int:
        return sum(item.statistics.scans for item in self._rack.scheduled)

    def _haltable(self, what: str) -> Haltable:
        if not isinstance(self._pace, Haltable):
            self._reports.refuse(what, "the rack follows another's clock: halt that")
        return self._pace

    def _refuse(self, reason: str) -> NoReturn:
        self._reports.refuse(STEP, reason)
