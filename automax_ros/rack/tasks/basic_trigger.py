"""Triggers the bursts of a BASIC task: by a time, an event or a channel."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.compile.base.scan_io import Suspension
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.tasks.triggers import Due, Timeout
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.task import Status
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler

LATE_NS = NS_PER_S
"""A task that the host reaches later than this continues now (decision: it does not make up for lost time)."""


class WaitTrigger:
    """A burst is due when the task's wait ends: at that instant, in the task's place among all scans.

    A hardware event that it waits on must come within its TIMEOUT, in ticks of the Processor, or ``expired`` is called
    (decision: as for scans).
    """

    def __init__(
        self, task: BasicTask, events: Events, channels: Channels, scheduler: Scheduler, expired: Callable[[], None]
    ) -> None:
        """Create for a task; nothing is scheduled yet."""
        self._expired = expired
        self._timeout: Timeout | None = None
        self._task, self._events, self._channels, self._scheduler = task, events, channels, scheduler
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)
        self._due: Due | None = None
        self._event: ScheduledEvent | None = None

    def arm(self, first_ns: int, due: Due) -> None:
        """Schedule the first burst at ``first_ns``; a task that waits already continues to wait."""
        self.disarm()
        self._due = due
        self._task.suspended = self._suspended
        if self._task.ready:
            self._go_on_at(first_ns)
        else:
            self._wait()

    def disarm(self) -> None:
        """Schedule no more bursts."""
        self._due = None
        self._end_timeout()
        self._task.suspended = _nothing
        self._channels.forget(self._wake)
        for event in self._task.compiled.program.events:
            self._events.event(event.name).forget(self._wake)
        if self._event is not None:
            self._event.cancel()
            self._event = None

    @property
    def next_ns(self) -> int | None:
        """When the next burst is due; now, while that is not known."""
        if self._due is None:
            return None
        due_ns = self._scheduler.due_ns(self._event)
        return self._scheduler.now_ns if due_ns is None else due_ns

    def _suspended(self) -> None:
        """Wait for the next burst, when one has ended."""
        if self._task.status is Status.RUNNING and self._due is not None:
            self._wait()

    def _wait(self) -> None:
        task, (kind, number) = self._task, self._task.wish
        if task.timed:
            self._go_on_at(task.not_before(task.wake_ns))
        elif kind == Suspension.EVENT:
            event = self._events.event(task.compiled.program.events[number].name)
            if event.wait(self._wake):
                self._wake(task.memory.now_ns)
            else:
                self._begin_timeout(task.compiled.program.events[number].timeout)
        elif kind in (Suspension.EMPTY, Suspension.FULL, Suspension.ABSENT):
            self._channels.wait(Suspension(kind), number, self._wake)

    def _wake(self, now_ns: int) -> None:
        """Schedule the burst after the scan that wakes the task: it does not start inside another's scan."""
        self._end_timeout()
        self._task.make_ready()
        self._go_on_at(self._task.not_before(now_ns))

    def _begin_timeout(self, ticks: int | None) -> None:
        if ticks:
            tick_ns = self._task.compiled.program.tick_ns
            self._timeout = Timeout(ticks * tick_ns, self._key, self._scheduler, self._expired)
            self._timeout.begin(self._task.wake_ns)

    def _end_timeout(self) -> None:
        if self._timeout is not None:
            self._timeout.end()
            self._timeout = None

    def _go_on_at(self, time_ns: int) -> None:
        self._event = self._scheduler.at(max(time_ns, self._scheduler.now_ns), self._key, self._go_on)

    def _go_on(self, now_ns: int) -> None:
        self._event = None
        if self._scheduler.wall_ns - now_ns > LATE_NS:
            self._task.pass_over(self._scheduler.wall_ns)
            self._go_on_at(self._scheduler.wall_ns)
        elif self._due is not None:
            self._task.go()
            self._due(now_ns, 0)


def _nothing() -> None:
    """Do nothing: the end of a burst is not awaited."""
