"""Topics by which ROS writes to a rack, and the conversion of values in engineering units to counts."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind

from automax_ros.core.types import Value
from automax_ros.messages.cdr.cdr import MAX_TRAILING, CdrError, decode
from automax_ros.messages.types.topics import QosProfile, Topic
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.ros_names import set_topic
from automax_ros.rackfile.model.writers import ROS_WRITER
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.intake.rcl import SequenceTracker, TakenMessage, TopicReader
from automax_ros.runtime.memory.views import MemoryValueError

REFUSAL_INTERVAL_S = 1.0
"""Refusals on one topic are logged at most this often."""
COMMAND = QosProfile("reliable", "volatile", "keep_last", 10)
BEST_EFFORT_COMMAND = QosProfile("best_effort", "volatile", "keep_last", 10)
REFUSED = "refused write"
_NUMBER_BYTES = 8
_LAYOUT_BYTES = 1024
"""Longest layout of an array's message that is read (decision)."""
DROPPED = "dropped message"
"""Counted by ``Health``: messages that DDS dropped because they arrived faster than they were taken."""


class WriteTopic:
    """Receives a topic's messages from reliable and best-effort publishers; calls ``take`` between two scans.

    ``take`` gets the decoded message (a class of ``messages/types/messages``); what it refuses with MemoryValueError or
    OperationRefused is reported, as a write to ``target``. ``most_bytes`` is the size of the longest valid message,
    without its header of 4 bytes.

    Messages wait in DDS, at most ten of them, and ``MessageIntake`` takes them as bytes: one that is malformed, or
    longer than the topic's messages can be, is refused unread. A reliable subscription alone would not match
    best-effort publishers; a best-effort one alone would lose messages of reliable ones. So a best-effort one is
    created when such a publisher appears; messages of reliable publishers then arrive twice, and the second copy is
    discarded.
    """

    def __init__(
        self, node: ModuleNode, topic: str, type_name: str, take: Callable[[Any], None], most_bytes: int, target: str
    ) -> None:
        def write(message: Any) -> None:
            try:
                take(message)
            except (MemoryValueError, OperationRefused) as error:
                self._refuse(target, error)

        self._node, self._topic, self._type_name = node, topic, type_name
        self._take = node.guarded_callback(topic, write)
        self._class, self._most_bytes = message_class(type_name), len(b"\0\1\0\0") + most_bytes + MAX_TRAILING
        self._reads_best_effort = self._is_best_effort = False
        self._throttle, self._senders = Throttle(REFUSAL_INTERVAL_S), SequenceTracker()
        incompatible = node.guarded_callback(topic, self._incompatible)
        self._subscribe(COMMAND, SubscriptionEventCallbacks(incompatible_qos=incompatible))

    def _refuse(self, target: str, reason: Exception) -> None:
        self._report(REFUSED, target, f"write refused: {reason}")

    def _report(self, kind: str, key: str, text: str, times: int = 1) -> None:
        """Count a problem; log it, at most once per second."""
        self._node.rack_context.health.note(kind, key, lambda: text, times=times)
        if self._throttle.passes():
            self._node.get_logger().warning(text)

    def _subscribe(self, qos: QosProfile, events: SubscriptionEventCallbacks | None) -> None:
        subscription = self._node.own_subscription(self._class, self._topic, ros_qos(qos), events)
        receive = partial(self.receive, reliable=qos is COMMAND)
        self._node.rack_context.intake.add(TopicReader(subscription, self._most_bytes, receive))

    def _incompatible(self, info: QoSRequestedIncompatibleQoSInfo) -> None:
        if info.last_policy_kind != QoSPolicyKind.RELIABILITY:
            self._node.report_qos_conflict(f"what a writer of {self._topic} sends is lost", info)
        elif not self._reads_best_effort:
            self._reads_best_effort = True
            self._subscribe(BEST_EFFORT_COMMAND, None)

    def receive(self, taken: TakenMessage, *, reliable: bool) -> None:
        """Check a message that was taken, and pass it on or refuse it."""
        if taken.sender:
            missing = self._senders.missing(taken)
            if missing is None:
                return
            if missing:
                text = f"{self._topic}: messages arrive faster than they can be processed; the oldest were discarded"
                self._report(DROPPED, self._topic, text, missing)
        else:
            self._is_best_effort |= not reliable
            if reliable and self._is_best_effort:
                return
        try:
            if taken.payload is None:
                raise CdrError(f"a message of {taken.size:,} bytes, where {self._most_bytes:,} are the most")
            message = decode(self._type_name, taken.payload)
        except CdrError as error:
            self._refuse(self._topic, CdrError(f"{self._topic}: {error}"))
        else:
            self._take(message)


def subscribe_variable(
    node: ModuleNode,
    topic: str,
    type_name: str,
    view: int,
    elements_of: Callable[[Any], list[tuple[int, Value]]],
    most_bytes: int,
) -> None:
    """Subscribe to a topic that writes a common variable, as the writer ``ros``.

    ``elements_of`` returns the (element, value) that a message writes; it raises MemoryValueError if it is refused.
    """
    rack = node.rack_context.rack
    variable = rack.config.variables[view]

    def take(message: Any) -> None:
        if not rack.operations.powered and not rack.config.is_input(variable):
            raise MemoryValueError(f"the power is off, and {variable.name} is not an input")
        rack.write_view(view, elements_of(message), ROS_WRITER)

    WriteTopic(node, topic, type_name, take, most_bytes, variable.name)


class ScaledWriter:
    """Converts a topic's values to counts of a variable. Values beyond the scale are clamped; the first is logged."""

    def __init__(self, node: ModuleNode, topic: str, variable: CommonVariable, scale: Scale, unit: str) -> None:
        self._node, self._topic, self._variable = node, topic, variable
        self._scale, self._unit, self._is_logged = scale, unit, False

    def counts(self, value: float) -> int:
        """Return the counts of a value.

        Raises:
            MemoryValueError: the value is not finite.
        """
        if not math.isfinite(value):
            raise MemoryValueError(f"{value!r} is not a value for {self._variable.name}")
        counts, clamped = self._scale.counts_of(value)
        if clamped:
            text = f"{self._topic}: {value:.8g} {self._unit}".rstrip()
            text += f" lies beyond the scale: {self._variable.name} is {counts} counts"
            self._node.rack_context.health.note("clamped value", self._variable.name, lambda: text)
            if not self._is_logged:
                self._is_logged = True
                self._node.get_logger().warning(text)
        return counts


def subscribe_values(node: ModuleNode, view: int, variable: CommonVariable, topic: Topic) -> None:
    """Subscribe a node to the ``/set`` of one variable, the whole of it."""
    name, scale = set_topic(topic.name), variable.scale
    scaled = None if scale is None else ScaledWriter(node, name, variable, scale, variable.unit)

    def elements_of(message: Any) -> list[tuple[int, Value]]:
        return _elements(variable, message) if scaled is None else [(0, scaled.counts(message.data))]

    # An element has at most 8 bytes, whatever its type, a character 4; an array's layout may contain names.
    most_bytes = _LAYOUT_BYTES * variable.is_array + variable.elements * (_NUMBER_BYTES + 4 * variable.length)
    subscribe_variable(node, name, topic.type_name, view, elements_of, most_bytes)


def _elements(variable: CommonVariable, message: Any) -> list[tuple[int, Value]]:
    """Return what a message writes, the whole variable, as (element, value).

    Raises:
        MemoryValueError: the length of an array message differs from the variable's.
    """
    if not variable.is_array:
        return [(0, message.data)]
    data = list(message.data)
    if len(data) != variable.elements:
        raise MemoryValueError(f"{variable.name} has {variable.elements} elements, the message has {len(data)}")
    return list(enumerate(data))
