"""Values in an engineer's unit that ROS writes: as counts, within their scale.

A topic through which ROS enters the rack.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind

from automax_ros.messages.cdr.cdr import MAX_TRAILING, CdrError, decode
from automax_ros.messages.types.topics import QosProfile
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.intake.raw_messages import RawMessage, SequenceTracker, taker_of
from automax_ros.ros.intake.rcl import library
from automax_ros.runtime.memory.views import MemoryValueError

REFUSAL_INTERVAL_S = 1.0
"""What is refused on one topic is logged at most this often."""
COMMAND = QosProfile("reliable", "volatile", "keep_last", 10)
BEST_EFFORT_COMMAND = QosProfile("best_effort", "volatile", "keep_last", 10)
REFUSED = "refused write"
DROPPED = "dropped message"
"""What ``Health`` counts: messages that DDS dropped, for more came than the door takes."""


class WriteTopic:
    """Hears a topic's messages from reliable and best-effort publishers; ``take`` is called between two scans.

    Messages wait in DDS, ten of them at most, and are taken at the rack's door (``Door``) as bytes: what is longer than
    the topic's messages can be, or not one of them, is refused unread. A reliable subscription alone would not hear
    best-effort publishers, a best-effort one alone would lose messages of reliable ones. So a best-effort one is opened
    when such a publisher comes; of the two copies that then come of a reliable one's messages the second is dropped.
    """

    def __init__(
        self, node: ModuleNode, topic: str, type_name: str, take: Callable[[Any], None], most_bytes: int
    ) -> None:
        """Subscribe.

        Args:
            node: whose topic it is.
            topic: its name.
            type_name: of its messages, such as ``std_msgs/msg/Int16``.
            take: gets the decoded message (one of ``wire.messages``), in the rack's present.
            most_bytes: size of the longest message that makes sense, without its header of 4 bytes.
        """
        self._node, self._topic, self._type_name = node, topic, type_name
        self._take = node.guarded_callback(topic, take)
        self._class, self._most_bytes = message_class(type_name), len(b"\0\1\0\0") + most_bytes + MAX_TRAILING
        self._hears_best_effort = self._is_best_effort = False
        self._throttle, self._senders = Throttle(REFUSAL_INTERVAL_S), SequenceTracker()
        self._subscribe(
            COMMAND, SubscriptionEventCallbacks(incompatible_qos=node.guarded_callback(topic, self._not_heard))
        )

    def refuse(self, of: str, reason: Exception) -> None:
        """Tell, not too often, that a message was not taken; ``of`` is what it would have written."""
        refusal = f"write refused: {reason}"
        self._node.site.health.note(REFUSED, of, lambda: refusal)
        if self._throttle.passes():
            self._node.get_logger().warning(refusal)

    def _subscribe(self, qos: QosProfile, events: SubscriptionEventCallbacks | None) -> None:
        subscription = self._node.own_subscription(self._class, self._topic, ros_qos(qos), events)
        self._node.site.door.add(_Way(self, subscription, self._most_bytes, reliable=qos is COMMAND))

    def _not_heard(self, info: QoSRequestedIncompatibleQoSInfo) -> None:
        if info.last_policy_kind != QoSPolicyKind.RELIABILITY:
            self._node.misfit(f"what a writer of {self._topic} sends is lost", info)
        elif not self._hears_best_effort:
            self._hears_best_effort = True
            self._subscribe(BEST_EFFORT_COMMAND, None)

    def receive(self, taken: RawMessage, *, reliable: bool) -> None:
        """Deal with a message that was taken."""
        if taken.sender:
            missing = self._senders.missing(taken)
            if missing is None:
                return
            if missing:
                self._note_dropped(missing)
        else:
            self._is_best_effort |= not reliable
            if reliable and self._is_best_effort:
                return
        try:
            if taken.payload is None:
                raise CdrError(f"a message of {taken.size:,} bytes, where {self._most_bytes:,} are the most")
            message = decode(self._type_name, taken.payload)
        except CdrError as error:
            self.refuse(self._topic, CdrError(f"{self._topic}: {error}"))
        else:
            self._take(message)

    def _note_dropped(self, missing: int) -> None:
        text = f"{self._topic}: messages come faster than they can be taken; the oldest were dropped"
        self._node.site.health.note(DROPPED, self._topic, lambda: text, times=missing)
        if self._throttle.passes():
            self._node.get_logger().warning(text)


class _Way:
    """One of an inlet's two subscriptions, as the door serves it."""

    def __init__(self, inlet: WriteTopic, subscription: Any, most_bytes: int, *, reliable: bool) -> None:
        self.name, self.handle = subscription.topic_name, subscription.handle
        self._inlet, self._reliable = inlet, reliable
        self._taker = taker_of(subscription, most_bytes)

    def take(self) -> bool:
        """Take the next message."""
        taken = self._taker.take()
        if taken is not None:
            self._inlet.receive(taken, reliable=self._reliable)
        return taken is not None

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Let rcl call a function for each message."""
        rcl = library()
        assert rcl is not None
        return int(rcl.on_message(pointer, callback, data))


class ScaledWriter:
    """The counts of what one topic writes to a variable. Beyond the scale a value is clamped, and told once."""

    def __init__(self, node: ModuleNode, topic: str, variable: CommonVariable, scale: Scale, unit: str) -> None:
        """Begin with nothing told; ``unit`` stands in messages."""
        self._node, self._topic, self._variable = node, topic, variable
        self._scale, self._unit, self._is_told = scale, unit, False

    def counts(self, value: float) -> int:
        """Return the counts of a value.

        Raises:
            MemoryValueError: not a finite number.
        """
        if not math.isfinite(value):
            raise MemoryValueError(f"{value!r} is not a value for {self._variable.name}")
        counts, clamped = self._scale.counts_of(value)
        if clamped:
            text = f"{self._topic}: {value:.8g} {self._unit}".rstrip()
            text += f" lies beyond the scale: {self._variable.name} is {counts} counts"
            self._node.site.health.note("clamped value", self._variable.name, lambda: text)
            if not self._is_told:
                self._is_told = True
                self._node.get_logger().warning(text)
        return counts
