"""The time of a rack and ``/clock``: which pacer a rack has, and whether it publishes or follows ``/clock``.

- On the wall clock, ``/clock`` is neither published nor read.
- Simulated (``automax run --simulated --ros``), the rack publishes ``/clock`` after all messages of the instant.
- With ``use_sim_time`` the rack follows the ``/clock`` of another node: it starts with the first message, and each
  further one executes everything up to its time (``FollowingPacer``). Writes received before a message of the clock
  are processed before it (``MessageIntake``).
"""

from __future__ import annotations

import time
from collections.abc import Callable

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import CdrError, decode, encoder
from automax_ros.messages.types.messages import Clock
from automax_ros.messages.types.topics import QosProfile
from automax_ros.ros.base.node import ModuleNode, RackContext, RackLock
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.intake.rcl import TopicReader
from automax_ros.runtime.time.following_pacer import FollowingPacer
from automax_ros.runtime.time.pacer import Pace, Pacer
from automax_ros.runtime.time.scheduler import Scheduler
from automax_ros.runtime.time.simulated_pacer import SimulatedPacer, SimulatedTime

CLOCK = "/clock"
_TYPE = "rosgraph_msgs/msg/Clock"
_PUBLISHED = QosProfile("reliable", "volatile", "keep_last", 10)
_FOLLOWED = QosProfile("best_effort", "volatile", "keep_last", 1000)
"""Matches reliable and best-effort publishers of ``/clock``; its depth is what waits while the rack is busy."""
_MOST_BYTES = 64
_LATEST_NS = ((1 << 31) - 366 * 24 * 3600) * NS_PER_S
"""The time stamps of ROS end in 2038: a clock with less than a year left until then is refused (decision)."""
_WAIT_S = 0.05
_CHECK_INTERVAL_S = 1.0
"""Seconds between two checks for other publishers of ``/clock``."""
JUMP = "clock jump"
TAKEN = "other /clock"
MALFORMED = "malformed /clock"
"""Names under which ``Health`` counts these problems."""


class RackClock:
    """Creates the pacer of one rack and connects it to ``/clock``."""

    def __init__(self, scheduler: Scheduler, lock: RackLock, *, follows: bool, simulated: SimulatedTime | None) -> None:
        self._rack_context: RackContext | None = None
        self._node: ModuleNode | None = None
        self._topic = CLOCK
        self._publish: Callable[[bytes], object] = _not_published
        self._encode = encoder(_TYPE)
        self._throttle, self._log_throttle = Throttle(_CHECK_INTERVAL_S), Throttle(_CHECK_INTERVAL_S)
        self._follower: FollowingPacer | None = None
        self.pace: Pace
        if simulated is not None:
            self.pace = SimulatedPacer(scheduler, self._publish_time, rate=simulated.rate, turn=lock.for_scan)
        elif follows:
            self.pace = self._follower = FollowingPacer(scheduler, self._report_jump, turn=lock.for_scan)
        else:
            self.pace = Pacer(scheduler, turn=lock.for_scan)

    @property
    def is_there(self) -> bool:
        """Whether the rack can start: if it follows ``/clock``, after its first message."""
        return self._follower is None or self._follower.has_clock

    def join(self, rack_context: RackContext, node: ModuleNode) -> None:
        """Publish ``/clock`` or subscribe to it, by a node of the rack."""
        self._rack_context, self._node = rack_context, node
        if isinstance(self.pace, SimulatedPacer):
            publisher = node.create_publisher(message_class(_TYPE), CLOCK, ros_qos(_PUBLISHED))
            self._publish, self._topic = publisher.publish, publisher.topic_name
        elif self._follower is not None:
            subscription = node.own_subscription(message_class(_TYPE), CLOCK, ros_qos(_FOLLOWED))
            self._topic = subscription.topic_name
            rack_context.intake.add(
                TopicReader(subscription, _MOST_BYTES, lambda taken: self._receive(taken.payload)), last=True
            )

    def wait(self, should_stop: Callable[[], bool], on_idle: Callable[[int], None] | None = None) -> bool:
        """Wait until the rack can start; return False if asked to stop. ``on_idle`` gets rack time meanwhile, 0."""
        while not self.is_there:
            if on_idle is not None:
                on_idle(self.pace.now_ns)
            if should_stop():
                return False
            time.sleep(_WAIT_S)
        return True

    def _publish_time(self, now_ns: int) -> None:
        assert self._rack_context is not None
        self._publish(self._encode(Clock(self._rack_context.stream.stamp(now_ns))))
        self._check_publishers(own=1)

    def _receive(self, payload: bytes | None) -> None:
        assert self._rack_context is not None
        try:
            message = decode(_TYPE, payload or b"")
            assert isinstance(message, Clock)
            if not 0 <= message.clock < _LATEST_NS:
                raise CdrError(f"{message.clock} ns is not a valid clock time")
            self._follow(message.clock)
        except CdrError as error:
            text = f"{CLOCK}: {error}"
            self._rack_context.health.note(MALFORMED, CLOCK, lambda: text)
            return
        self._check_publishers(own=0)

    def _follow(self, clock_ns: int) -> None:
        """Follow ``/clock`` to a time.

        Raises:
            CdrError: time stamps, which are ahead of a clock that went back, would exceed the range of ROS.
        """
        assert self._rack_context is not None
        assert self._follower is not None
        with self._rack_context.lock.for_scan:
            stamp = self._rack_context.stream.stamp(self._follower.now_ns) + self._follower.ahead_ns(clock_ns)
            if stamp >= _LATEST_NS:
                raise CdrError(f"{clock_ns} ns comes after a clock that went back, and would be a stamp of {stamp} ns")
            self._follower.follow_to(clock_ns)

    def _check_publishers(self, own: int) -> None:
        assert self._node is not None
        assert self._rack_context is not None
        if self._throttle.passes() and self._node.count_publishers(self._topic) > 1:
            text = "another node sends /clock too" if own else "several nodes send /clock"
            if not self._rack_context.health.counts[TAKEN]:
                self._node.get_logger().warning(text)
            self._rack_context.health.note(TAKEN, CLOCK, lambda: text)

    def _report_jump(self, by_ns: int) -> None:
        assert self._rack_context is not None
        assert self._node is not None
        if by_ns > 0:
            self._rack_context.stream.leave_out(by_ns)
            text = f"/clock went ahead by {by_ns / NS_PER_S:.9g} s: the rack leaves that time out"
        else:
            text = f"/clock went back by {-by_ns / NS_PER_S:.9g} s: rack time and stamps go on from where they are"
        self._rack_context.health.note(JUMP, by_ns > 0, lambda: text)
        if self._log_throttle.passes():
            self._node.get_logger().warning(text)


def _not_published(_: bytes) -> None:
    """Publish nothing: the rack has no node yet."""
