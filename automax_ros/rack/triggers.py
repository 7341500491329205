"""What makes a task scan: its Processor's clock, an event, or the module it stands in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from automax_ros.running.events import Event, Events
from automax_ros.running.scheduler import EventClass, EventKey, PeriodicAction, ScheduledEvent, Scheduler
from automax_ros.running.task import Task

Due = PeriodicAction
"""Is called when a scan is due, with the instant in ns and the number of instants skipped just before it."""


class Trigger(Protocol):
    """Tells when scans of one task are due, from ``arm`` to ``disarm``."""

    def arm(self, first_ns: int, due: Due) -> None:
        """Begin: no scan is due before ``first_ns``."""
        ...

    def disarm(self) -> None:
        """End; a second time this does nothing."""
        ...

    @property
    def next_ns(self) -> int | None:
        """What ``arm`` must be given to go on as from now; None while it is not armed."""
        ...


MakeTrigger = Callable[[Task], Trigger]
"""Makes the trigger of a task as it is installed."""


class ClockTrigger:
    """A scan is due each TICKS x tick rate."""

    def __init__(self, task: Task, scheduler: Scheduler) -> None:
        """Take the task; nothing is scheduled yet."""
        self._scheduler = scheduler
        self._period_ns = task.period_ns
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)
        self._event: ScheduledEvent | None = None

    def arm(self, first_ns: int, due: Due) -> None:
        """Let a scan be due at ``first_ns`` and each period after it."""
        self.disarm()
        self._event = self._scheduler.every(self._period_ns, first_ns, self._key, due)

    def disarm(self) -> None:
        """Let no scan be due any more."""
        if self._event is not None:
            self._event.cancel()
            self._event = None

    @property
    def next_ns(self) -> int | None:
        """When the next scan is due."""
        return self._scheduler.due_ns(self._event) if self._event is not None else None


class EventTrigger:
    """A scan is due whenever an event is set (4.0, EVENT): at that instant, in the task's place among all scans."""

    def __init__(self, event: Event, task: Task, scheduler: Scheduler) -> None:
        """Take the event; nobody waits for it yet."""
        self._event, self._scheduler = event, scheduler
        self._key = EventKey(EventClass.SCAN, task.priority, task.name)
        self._due: Due | None = None
        self._set: ScheduledEvent | None = None

    def arm(self, first_ns: int, due: Due) -> None:  # noqa: ARG002
        """Wait for the event from now on, and go on waiting while a scan that it started is under way."""
        self.disarm()
        self._due = due
        self._event.pending = False
        self._event.wait(self._wake)

    def disarm(self) -> None:
        """Wait no longer."""
        self._due = None
        self._event.forget(self._wake)
        if self._set is not None:
            self._set.cancel()
            self._set = None

    @property
    def next_ns(self) -> int | None:
        """The present, while it waits."""
        return self._scheduler.now_ns if self._due is not None else None

    def _wake(self, now_ns: int) -> None:
        """Let the scan be due after whatever sets the event: a scan does not begin inside another."""
        self._event.wait(self._wake)
        if self._due is not None:
            due, skipped = self._due, self._event.skipped
            self._set = self._scheduler.at(now_ns, self._key, lambda now: due(now, skipped))


class ModuleTrigger:
    """The module itself says when a scan is due, as long as the trigger is ``armed``."""

    def __init__(self, scheduler: Scheduler) -> None:
        """Begin unarmed."""
        self._scheduler = scheduler
        self.armed = False

    def arm(self, first_ns: int, due: Due) -> None:  # noqa: ARG002
        """Let the module begin."""
        self.armed = True

    def disarm(self) -> None:
        """Let the module pass the task over."""
        self.armed = False

    @property
    def next_ns(self) -> int | None:
        """The present, while it is armed."""
        return self._scheduler.now_ns if self.armed else None


def usual_trigger(task: Task, events: Events, scheduler: Scheduler) -> Trigger:
    """Return the trigger of a Processor's task: the event that its SCAN_LOOP names, else the clock (4.0)."""
    event = task.compiled.program.event
    return ClockTrigger(task, scheduler) if event is None else EventTrigger(events.event(event), task, scheduler)
