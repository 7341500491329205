"""The scheduler: an event queue in integer nanoseconds; only the scheduler has the time.

Events are ordered by (time, class, priority, name): their order is deterministic. ``run_until`` is simulated time,
``run_due`` the wall clock's.
"""

from __future__ import annotations

import enum
import heapq
from collections.abc import Callable
from dataclasses import dataclass

Action = Callable[[int], None]
"""The action of an event, given its instant in ns."""
PeriodicAction = Callable[[int, int], None]
"""The action of a periodic event, given its instant in ns and the number of instants skipped just before it."""


class EventClass(enum.IntEnum):
    """The order at one instant: writes from outside, start of tasks, I/O, execution, scans, observers.

    EXECUTE continues a scan in modeled time: one that ends when the next is due has ended.
    """

    OUTSIDE = 0
    START = 1
    IO = 2
    EXECUTE = 3
    SCAN = 4
    OBSERVE = 5


@dataclass(frozen=True, order=True)
class EventKey:
    """The order of an event among those of its instant; ``priority`` 4 is the highest."""

    event_class: EventClass
    priority: int
    name: str


@dataclass(eq=False)
class ScheduledEvent:
    """An event that was posted; ``cancel`` removes it from the queue."""

    key: EventKey
    action: PeriodicAction
    period_ns: int = 0
    cancelled: bool = False

    def cancel(self) -> None:
        """Cancel the event; a second call does nothing."""
        self.cancelled = True


def _nothing(now_ns: int, skipped: int) -> None:
    """Do nothing."""


NO_EVENT = ScheduledEvent(EventKey(EventClass.OBSERVE, 0, ""), _nothing, cancelled=True)
"""What is never posted: the event of those that have none."""
_Queued = tuple[int, int, int, str, int, ScheduledEvent]
"""Instant, class, priority, name, serial number: a tuple, since tuples compare fast."""


class Scheduler:
    """The event queue of one rack.

    ``wall_ns`` is the time that ``run_due`` catches up with: ahead of ``now_ns`` while late events are executed.
    ``zero_ns`` is the time of the pacer's clock at time 0, None without a pacer.
    """

    def __init__(self, start_ns: int = 0) -> None:
        self.now_ns = start_ns
        self._queue: list[_Queued] = []
        self._serial = 0
        self._end_ns = start_ns
        self.wall_ns = start_ns
        self.zero_ns: int | None = None

    def at(self, time_ns: int, key: EventKey, action: Action) -> ScheduledEvent:
        """Post an event that is executed once; ValueError if the instant lies in the past."""

        def once(now_ns: int, _: int) -> None:
            action(now_ns)

        return self.post(time_ns, ScheduledEvent(key, once))

    def every(self, period_ns: int, first_ns: int, key: EventKey, action: PeriodicAction) -> ScheduledEvent:
        """Post an event at ``first_ns`` and each ``period_ns`` after it; ValueError for a period of 0 or the past."""
        if period_ns <= 0:
            raise ValueError(f"a period of {period_ns} ns is not positive")
        return self.post(first_ns, ScheduledEvent(key, action, period_ns))

    def post(self, time_ns: int, event: ScheduledEvent) -> ScheduledEvent:
        """Post an event that is not in the queue, and return it; ValueError if the instant lies in the past."""
        if time_ns < self.now_ns:
            raise ValueError(f"an event at {time_ns} ns lies before the present, {self.now_ns} ns")
        self._serial += 1
        key = event.key
        heapq.heappush(self._queue, (time_ns, key.event_class, key.priority, key.name, self._serial, event))
        return event

    @property
    def next_ns(self) -> int | None:
        """The instant of the next event, None if there is none."""
        while self._queue and self._queue[0][5].cancelled:
            heapq.heappop(self._queue)
        return self._queue[0][0] if self._queue else None

    def due_ns(self, event: ScheduledEvent) -> int | None:
        """Return the next instant of an event, None if it has none any more."""
        found = (entry[0] for entry in self._queue if entry[5] is event)
        return None if event.cancelled else next(found, None)

    def advance_to(self, time_ns: int, key: EventKey) -> bool:
        """Advance to ``time_ns`` if the present run reaches it and no event precedes one of that instant and key.

        It is faster than another event.
        """
        if time_ns >= self._end_ns:
            return False
        queue = self._queue
        while queue and queue[0][0] <= time_ns:
            if queue[0][5].cancelled:
                heapq.heappop(queue)
            elif queue[0][0] < time_ns or queue[0][1:4] <= (key.event_class, key.priority, key.name):
                return False
            else:
                break
        self.now_ns = time_ns
        return True

    def run_until(self, end_ns: int) -> None:
        """Advance simulated time to ``end_ns``: every event before it is executed at its instant."""
        queue = self._queue
        self._end_ns = end_ns
        while queue and queue[0][0] < end_ns:
            instant, event = queue[0][0], queue[0][5]
            if event.cancelled:
                heapq.heappop(queue)
                continue
            self.now_ns = instant
            if event.period_ns:
                heapq.heapreplace(queue, self._queue_entry(instant + event.period_ns, event))
            else:
                heapq.heappop(queue)
            event.action(instant, 0)
        self.now_ns = max(self.now_ns, end_ns)

    def run_through(self, time_ns: int) -> None:
        """Advance simulated time to ``time_ns``: every event up to and at it is executed at its instant."""
        if time_ns >= self.now_ns:
            self.run_until(time_ns + 1)
            self.now_ns = time_ns

    def step(self, end_ns: int) -> bool:
        """Execute only the next event before ``end_ns``; if there is none, advance to ``end_ns`` and return False."""
        due = self.next_ns
        if due is None or due >= end_ns:
            self.now_ns = max(self.now_ns, end_ns)
            return False
        self.now_ns = self._end_ns = due
        event = heapq.heappop(self._queue)[5]
        if event.period_ns:
            heapq.heappush(self._queue, self._queue_entry(due + event.period_ns, event))
        event.action(due, 0)
        return True

    def run_due(self, now_ns: int) -> None:
        """Execute, in order, the events due at a time of the wall clock, and those posted meanwhile up to that time.

        A periodic event that is late by whole periods is executed once, at its last instant; the others are skipped.
        """
        queue = self._queue
        self._end_ns, self.wall_ns = now_ns + 1, now_ns
        skipped = self._skip_until(now_ns)
        while queue and queue[0][0] <= now_ns:
            instant, _, _, _, _, event = queue[0]
            if event.period_ns and not event.cancelled:
                heapq.heapreplace(queue, self._queue_entry(instant + event.period_ns, event))
            else:
                heapq.heappop(queue)
            if not event.cancelled:
                self.now_ns = max(self.now_ns, instant)
                event.action(instant, skipped.pop(event, 0))
        self.now_ns = max(self.now_ns, now_ns)

    def _skip_until(self, now_ns: int) -> dict[ScheduledEvent, int]:
        """Move periodic events that are late by whole periods to their last instant; return how many each skips."""
        skipped: dict[ScheduledEvent, int] = {}
        waiting: list[_Queued] = []
        while self._queue and self._queue[0][0] <= now_ns:
            entry = heapq.heappop(self._queue)
            instant, event = entry[0], entry[5]
            if event.period_ns and now_ns - instant >= event.period_ns:
                skipped[event] = (now_ns - instant) // event.period_ns
                entry = (instant + skipped[event] * event.period_ns, *entry[1:])
            waiting.append(entry)
        for entry in waiting:
            heapq.heappush(self._queue, entry)
        return skipped

    def pass_until(self, now_ns: int) -> None:
        """Advance to a time of the wall clock, before an action from outside, at most to the next event."""
        due = self.next_ns
        self.now_ns = max(self.now_ns, now_ns if due is None else min(now_ns, due))

    def _queue_entry(self, time_ns: int, event: ScheduledEvent) -> _Queued:
        self._serial += 1
        return time_ns, event.key.event_class, event.key.priority, event.key.name, self._serial, event
