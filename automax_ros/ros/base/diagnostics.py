"""``/diagnostics`` of one process: one message with the health of the rack, its modules, tasks and plants.

It is published once per second of rack time, and immediately when a level changes, at most five times per second
(decision). While the rack is halted the wall clock counts, so that a halted rack does not look like a dead one. A
status is named ``RACK/NODE: PART``, such as ``pm1/processor_1: LINE``, as diagnostic_aggregator groups them; its
``hardware_id`` is ``PM1 slot 1``. Levels are those of REP-107; STALE is never published: readers set it when statuses
stop arriving.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.operator.halting import Haltable, is_halted
from automax_ros.rack.rack import Rack
from automax_ros.ros.intake.guard import Throttle
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent

PERIOD_NS = NS_PER_S
"""Period at which all statuses are published, rack time."""
SHORTEST_NS = 200 * NS_PER_MS
"""Shortest time from a message to the next check of the levels, rack time."""
LOOK_NS = 50 * NS_PER_MS
"""Shortest time between two checks of the levels, rack time."""
TOPIC = "/diagnostics"
_DEPTH = 10
_KEY = EventKey(EventClass.OBSERVE, 0, "diagnostics")
Source = Callable[[int], list[DiagnosticStatus]]
"""Returns the statuses at a rack time (ns)."""


class Diagnostics:
    """Publishes the statuses of its sources. Call ``begin`` once, with the node that publishes."""

    def __init__(self) -> None:
        self._sources: list[Source] = []
        self._levels: dict[str, bytes] = {}
        self._counts: dict[str, int] = {}
        self._sent_counts: dict[str, int] = {}
        self._next_check_ns = 0
        self._pending: ScheduledEvent | None = None
        self._changed = False
        self._halted_period, self._halted_check = Throttle(PERIOD_NS / NS_PER_S), Throttle(SHORTEST_NS / NS_PER_S)
        self._publisher: Any = None

    @property
    def begun(self) -> bool:
        """Whether ``begin`` was called."""
        return self._publisher is not None

    def begin(self, rack: Rack, stream: RackStream, pace: object, node: Node) -> None:
        """Publish from now on, by a publisher of a node; observe the rack and its pacer."""
        self._rack, self._stream, self._pace = rack, stream, pace
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, _DEPTH)
        rack.scheduler.every(PERIOD_NS, rack.now_ns, _KEY, lambda now, _: self._report(now))
        rack.observe(self)
        if isinstance(pace, Haltable):
            pace.while_halted = self._while_halted

    def add(self, source: Source) -> None:
        """Add a source; its statuses follow those of earlier sources."""
        self._sources.append(source)

    def newly(self, what: str, count: int) -> int:
        """Return by how much a count has risen since the last periodic report; ``what`` identifies the count."""
        self._counts[what] = count
        return count - self._sent_counts.get(what, 0)

    def look(self) -> None:
        """Publish at the next opportunity if a level has changed."""
        self._changed = True
        if self._pending is None and not is_halted(self._pace):
            at_ns = max(self._rack.now_ns, self._next_check_ns)
            self._pending = self._rack.scheduler.at(at_ns, _KEY, self._check_at)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Check the levels if a scan had errors or others were skipped."""
        if record.errors or record.skipped:
            self.look()

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes from outside: they change no status."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tuning: it changes no status."""

    def operated(self, operation: Operation) -> None:  # noqa: ARG002
        """Check the levels after each operation."""
        self.look()

    def _report(self, now_ns: int) -> None:
        self._send(self._statuses(now_ns), now_ns)
        self._sent_counts = dict(self._counts)

    def _check_at(self, now_ns: int) -> None:
        self._pending = None
        self._next_check_ns = now_ns + (SHORTEST_NS if self._check(now_ns) else LOOK_NS)

    def _check(self, now_ns: int) -> bool:
        self._changed = False
        statuses = self._statuses(now_ns)
        if {item.name: item.level for item in statuses} == self._levels:
            return False
        self._send(statuses, now_ns)
        return True

    def _while_halted(self) -> None:
        now = self._rack.now_ns
        if self._halted_period.passes():
            self._changed = False
            self._report(now)
        elif self._changed and self._halted_check.passes():
            self._check(now)

    def _statuses(self, now_ns: int) -> list[DiagnosticStatus]:
        return [status for source in self._sources for status in source(now_ns)]

    def _send(self, statuses: list[DiagnosticStatus], now_ns: int) -> None:
        self._levels = {item.name: item.level for item in statuses}
        stamp = self._stream.stamp(now_ns)
        message = DiagnosticArray(status=statuses)
        message.header.stamp = Time(sec=stamp // NS_PER_S, nanosec=stamp % NS_PER_S)
        self._publisher.publish(message)


def status_of(name: str, hardware: str, level: bytes, text: str, values: Mapping[str, str]) -> DiagnosticStatus:
    """Return a status (REP-107)."""
    return DiagnosticStatus(
        level=level,
        name=name,
        message=text,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def worst(statuses: list[DiagnosticStatus]) -> bytes:
    """Return the worst level of statuses; OK if there are none."""
    levels: list[bytes] = [item.level for item in statuses]
    return max(levels, default=bytes(DiagnosticStatus.OK))
