"""The interrupts of a 57C406: when they come, and the scan that each of them makes due."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.core.text import count_of
from automax_ros.rack.modules.running import ModuleState
from automax_ros.running.scheduler import EventClass, EventKey, PeriodicAction, ScheduledEvent, Scheduler

USUAL_NS = 2_777_778
"""Time between two interrupts until a task says otherwise, ns: a sixth of a cycle at 60 Hz (decision)."""
LATE_NS = 1_000_000
"""From how late on an interrupt counts as late, ns."""


@dataclass
class InterruptTiming:
    """How interrupts kept their time on the wall clock; in simulated time none is late.

    Attributes:
        interrupts: how many there were.
        late: how many came more than ``LATE_NS`` after their instant.
        greatest_ns: the greatest lateness, ns.
    """

    interrupts: int = 0
    late: int = 0
    greatest_ns: int = 0

    def describe(self) -> str:
        """Return the counts in words."""
        late = f"{self.late} later than {LATE_NS / 1e6:g} ms"
        return f"{count_of(self.interrupts, 'interrupt')}, {late}, the latest by {self.greatest_ns / 1e6:.3g} ms"

    def note(self, late_ns: int) -> None:
        """Count an interrupt that was as late as that; one that was not has 0 or less."""
        self.interrupts += 1
        self.greatest_ns = max(self.greatest_ns, late_ns)
        if late_ns > LATE_NS:
            self.late += 1


class DriveInterrupts:
    """Interrupts from ``arm`` to ``disarm``. One that a late host missed is carried out late, in order (decision).

    Attributes:
        at_ns: when the last one was, ns.
        interval_ns: the time from one to the next, ns, as the last command has it.
    """

    def __init__(self, scheduler: Scheduler, slot: int, measure: Callable[[int], None]) -> None:
        """Begin without; ``measure`` is called at each with its instant, before the scan that it makes due."""
        self._scheduler, self._measure = scheduler, measure
        self._key = EventKey(EventClass.IO, slot, "interrupt")
        self._event: ScheduledEvent | None = None
        self._event_ns = 0
        self._scan: ScheduledEvent | None = None
        self._scan_key = self._key
        self._due: PeriodicAction = _nothing
        self.armed = False
        self.at_ns = 0
        self.interval_ns = USUAL_NS
        self.timing = InterruptTiming()

    @property
    def next_ns(self) -> int | None:
        """When the next one comes, None while it is not armed."""
        return None if self._event is None else self._event_ns

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Interrupt at an instant, and from then on each interval; ``due`` has its place ``key`` among the scans."""
        self.disarm()
        self._scan_key, self._due, self.armed = key, due, True
        self._post(first_ns, ScheduledEvent(self._key, self._happen))

    def disarm(self) -> None:
        """Interrupt no more."""
        self.armed = False
        for event in (self._event, self._scan):
            if event is not None:
                event.cancel()
        self._event = self._scan = None

    def follow(self, next_ns: int) -> None:
        """Let the next one come as long after the last as a command says, ns; now where that has passed."""
        self.interval_ns = max(1, next_ns)
        if self._event is None:
            return
        at_ns, now_ns = self.at_ns + self.interval_ns, self._scheduler.now_ns
        at_ns = max(at_ns, now_ns)
        if at_ns != self._event_ns:
            self._event.cancel()
            self._post(at_ns, ScheduledEvent(self._key, self._happen))

    def state(self) -> dict[str, int]:
        """Return when the last one was, and the interval; who arms it keeps when the next one comes."""
        return {"at_ns": self.at_ns, "interval_ns": self.interval_ns}

    def load(self, state: ModuleState) -> None:
        """Take over a state."""
        self.at_ns, self.interval_ns = state["at_ns"], state["interval_ns"]

    def _post(self, at_ns: int, event: ScheduledEvent) -> None:
        self._event, self._event_ns = self._scheduler.post(at_ns, event), at_ns

    def _happen(self, now_ns: int, _: int) -> None:
        scheduler, event = self._scheduler, self._event
        assert event is not None
        self.at_ns = now_ns
        self.timing.note(scheduler.wall_ns - now_ns)
        # Before the scan: time passes in a modeled one, and in what follows it, at most to the next interrupt.
        self._post(now_ns + self.interval_ns, event)
        self._measure(now_ns)
        if scheduler.advance_to(now_ns, self._scan_key):
            self._due(now_ns, 0)
        else:
            self._scan = scheduler.at(now_ns, self._scan_key, self._scan_now)

    def _scan_now(self, now_ns: int) -> None:
        self._scan = None
        self._due(now_ns, 0)


def _nothing(now_ns: int, skipped: int) -> None:
    """Make no scan due: nobody has armed the interrupts."""
