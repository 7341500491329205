"""A topic through which ROS enters the rack."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind

from automax_ros.nodes.module_node import ModuleNode
from automax_ros.nodes.throttle import Throttle
from automax_ros.nodes.topics import ros_qos
from automax_ros.wire.qos import QosProfile

REFUSAL_INTERVAL_S = 1.0
"""What is refused on one topic is logged at most this often."""
COMMAND = QosProfile("reliable", "volatile", "keep_last", 10)
BEST_EFFORT_COMMAND = QosProfile("best_effort", "volatile", "keep_last", 10)


class Inlet:
    """Hears a topic's messages from reliable and best-effort publishers; ``take`` is called between two scans.

    A reliable subscription alone would not hear best-effort publishers, a best-effort one alone would lose messages of
    reliable ones. So a best-effort one is opened when such a publisher comes, and from its first message on it takes
    those of all publishers: rclpy does not tell which of two copies is the same message.
    """

    def __init__(self, node: ModuleNode, topic: str, kind: Any, take: Callable[[Any], None]) -> None:
        """Subscribe; ``kind`` is the message's class."""
        self._node, self._topic, self._kind, self._take = node, topic, kind, take
        self._hears_best_effort = self._is_best_effort = False
        self._throttle = Throttle(REFUSAL_INTERVAL_S)
        node.create_subscription(
            kind,
            topic,
            node.inside(topic, self._take_reliable),
            ros_qos(COMMAND),
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=node.inside(topic, self._not_heard)),
        )

    def refuse(self, of: str, reason: Exception) -> None:
        """Tell, not too often, that a message was not taken; ``of`` is what it would have written."""
        refusal = f"write refused: {reason}"
        self._node.site.health.note("refused write", of, lambda: refusal)
        if self._throttle.passes():
            self._node.get_logger().warning(refusal)

    def _not_heard(self, info: QoSRequestedIncompatibleQoSInfo) -> None:
        if info.last_policy_kind != QoSPolicyKind.RELIABILITY:
            self._node.misfit(f"what a writer of {self._topic} sends is lost", info)
        elif not self._hears_best_effort:
            self._hears_best_effort = True
            callback = self._node.inside(self._topic, self._take_best_effort)
            self._node.create_subscription(self._kind, self._topic, callback, ros_qos(BEST_EFFORT_COMMAND))

    def _take_best_effort(self, message: Any) -> None:
        self._is_best_effort = True
        self._take(message)

    def _take_reliable(self, message: Any) -> None:
        if not self._is_best_effort:
            self._take(message)
