"""Triggers a task's scans: by its Processor's clock, an event, a drive's 57C406, or what a BASIC task waits for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from automax_ros.compile.base.scan_io import Suspension
from automax_ros.core.ticks import NS_PER_S, UDC_TICK_NS
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.events import Event, Events
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.task import Status, Task
from automax_ros.runtime.time.scheduler import NO_EVENT, EventClass, EventKey, PeriodicAction, Scheduler

Due = PeriodicAction
"""Called when a scan is due, with the instant in ns and the number of instants skipped just before it."""
LATE_NS = UDC_TICK_NS
"""A host that is this late may have skipped scans whose end interrupts."""
_LAST = EventKey(EventClass.OBSERVE, 0, "")


class Trigger(Protocol):
    """Decides when scans of one task are due, from ``arm`` to ``disarm``."""

    def arm(self, first_ns: int, due: Due) -> None:
        """Start: no scan is due before ``first_ns``."""

    def disarm(self) -> None:
        """End; a second call does nothing."""

    @property
    def next_ns(self) -> int | None:
        """Argument with which ``arm`` continues from now; None while not armed."""
        ...


MakeTrigger = Callable[[Task], Trigger]
"""Returns the trigger of a task at its installation."""


class ClockTrigger:
    """A scan is due each TICKS x tick rate."""

    def __init__(self, task: Task, scheduler: Scheduler) -> None:
        """Create for a task; nothing is scheduled yet."""
        self._scheduler = scheduler
        self._period_ns = task.period_ns
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)
        self._event = NO_EVENT

    def arm(self, first_ns: int, due: Due) -> None:
        """Schedule a scan at ``first_ns`` and each period after it."""
        self.disarm()
        self._event = self._scheduler.every(self._period_ns, first_ns, self._key, due)

    def disarm(self) -> None:
        """Schedule no more scans."""
        self._event.cancel()

    @property
    def next_ns(self) -> int | None:
        """When the next scan is due."""
        return self._scheduler.due_ns(self._event)


class Timeout:
    """The time within which an event must be set again, while a task waits for it.

    A host that is late makes the interrupts of a module late too, so no timeout expires before all that is due was
    executed. If the host was late by ``LATE_NS`` or more the timeout starts again: scans of a UDC were skipped, and the
    one whose end interrupts may still be under way in modeled execution (decision).
    """

    def __init__(self, timeout_ns: int, key: EventKey, scheduler: Scheduler, expired: Callable[[], None]) -> None:
        """Create with the time and the function to call when it is over; it does not run yet."""
        self._timeout_ns, self._key, self._scheduler, self._expired = timeout_ns, key, scheduler, expired
        self._end = NO_EVENT

    def begin(self, since_ns: int) -> None:
        """Start the time at ``since_ns``, in place of an earlier start."""
        self.end()
        self._end = self._scheduler.at(since_ns + self._timeout_ns, self._key, self._over)

    def end(self) -> None:
        """Stop the time."""
        self._end.cancel()

    def _over(self, now_ns: int) -> None:
        wall_ns = self._scheduler.wall_ns
        if wall_ns - now_ns >= LATE_NS:
            self._end = self._scheduler.at(wall_ns + self._timeout_ns, self._key, self._over)
        elif now_ns < wall_ns:
            self._end = self._scheduler.at(wall_ns, _LAST, self._over)
        else:
            self._expired()


class EventTrigger:
    """A scan is due whenever an event is set (4.0, EVENT): at that instant, in the task's place among all scans.

    A hardware event must be set within its TIMEOUT, in ticks of the Processor, from RUN and from each event on, or
    ``expired`` is called (decision: no source gives the unit or the effect).
    """

    def __init__(self, event: Event, task: Task, scheduler: Scheduler, expired: Callable[[], None]) -> None:
        """Create for an event; no task waits for it yet."""
        self._event, self._scheduler = event, scheduler
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)
        self._due: Due | None = None
        self._set = NO_EVENT
        self._since_ns = 0
        program = task.compiled.program
        ticks = next((item.timeout for item in program.events if item.name == event.name), None)
        self._timeout = Timeout(ticks * program.tick_ns, self._key, scheduler, expired) if ticks else None

    def arm(self, first_ns: int, due: Due) -> None:
        """Wait for the event from now on, and continue to wait during a scan that it started."""
        self.disarm()
        self._due = due
        self._event.pending = False
        self._event.wait(self._wake)
        self._wait_since(first_ns)

    def disarm(self) -> None:
        """Stop waiting."""
        self._due = None
        self._event.forget(self._wake)
        if self._timeout is not None:
            self._timeout.end()
        self._set.cancel()

    @property
    def next_ns(self) -> int | None:
        """When it started to wait."""
        return self._since_ns if self._due is not None else None

    def _wait_since(self, now_ns: int) -> None:
        self._since_ns = now_ns
        if self._timeout is not None:
            self._timeout.begin(now_ns)

    def _wake(self, now_ns: int) -> None:
        """Schedule the scan after the scan that sets the event: it does not start inside another."""
        self._event.wait(self._wake)
        if self._due is not None:
            due, skipped = self._due, self._event.skipped
            self._set = self._scheduler.at(now_ns, self._key, lambda now: due(now, skipped))
            self._wait_since(now_ns)


class DriveTrigger:
    """A scan is due at each interrupt of the task's 57C406, six in a cycle of its line (52.0)."""

    def __init__(self, task: CmlTask) -> None:
        """Create for a task; its 57C406 does not interrupt yet."""
        self._task = task
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)

    def arm(self, first_ns: int, due: Due) -> None:
        """Start the interrupts of the 57C406 at ``first_ns``."""
        self._task.port.arm(first_ns, self._key, due)

    def disarm(self) -> None:
        """End the interrupts: the drive's gates and contactor are off at once."""
        self._task.port.disarm()

    @property
    def next_ns(self) -> int | None:
        """When the next interrupt comes."""
        return self._task.port.next_ns


RESUMED_LATE_NS = NS_PER_S
"""A BASIC task that the host reaches later than this continues now (decision: it does not make up for lost time)."""


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
        self._event = NO_EVENT

    def arm(self, first_ns: int, due: Due) -> None:
        """Schedule the first burst at ``first_ns``; a task that waits already continues to wait."""
        self.disarm()
        self._due = due
        self._task.suspended = self._handle_suspension
        if self._task.ready:
            self._go_on_at(first_ns)
        else:
            self._wait()

    def disarm(self) -> None:
        """Schedule no more bursts."""
        self._due = None
        self._end_timeout()
        self._task.suspended = lambda: None
        self._channels.forget(self._wake)
        for event in self._task.compiled.program.events:
            self._events.event(event.name).forget(self._wake)
        self._event.cancel()

    @property
    def next_ns(self) -> int | None:
        """When the next burst is due; now, while that is not known."""
        if self._due is None:
            return None
        due_ns = self._scheduler.due_ns(self._event)
        return self._scheduler.now_ns if due_ns is None else due_ns

    def _handle_suspension(self) -> None:
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
                ticks, tick_ns = task.compiled.program.events[number].timeout, task.compiled.program.tick_ns
                if ticks:
                    self._timeout = Timeout(ticks * tick_ns, self._key, self._scheduler, self._expired)
                    self._timeout.begin(task.wake_ns)
        elif kind in (Suspension.EMPTY, Suspension.FULL, Suspension.ABSENT):
            self._channels.wait(Suspension(kind), number, self._wake)

    def _wake(self, now_ns: int) -> None:
        """Schedule the burst after the scan that wakes the task: it does not start inside another's scan."""
        self._end_timeout()
        self._task.make_ready()
        self._go_on_at(self._task.not_before(now_ns))

    def _end_timeout(self) -> None:
        if self._timeout is not None:
            self._timeout.end()
            self._timeout = None

    def _go_on_at(self, time_ns: int) -> None:
        self._event = self._scheduler.at(max(time_ns, self._scheduler.now_ns), self._key, self._go_on)

    def _go_on(self, now_ns: int) -> None:
        if self._scheduler.wall_ns - now_ns > RESUMED_LATE_NS:
            self._task.pass_over(self._scheduler.wall_ns)
            self._go_on_at(self._scheduler.wall_ns)
        elif self._due is not None:
            self._task.go()
            self._due(now_ns, 0)
