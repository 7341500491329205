"""Waits, in a process of a distributed rack, for a recorder that will receive all of its messages.

It looks for the recorder's subscriptions in the graph, and whether DDS has matched its own publishers with as many
readers: a reliable writer that is matched with a reader before its first message delivers all messages to it. On a full
machine the graph shows a reader half a second before.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from rclpy.qos import DurabilityPolicy

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.setup.arguments import RosArguments

_CHECK_NS = 100 * NS_PER_MS
"""Time between two checks (decision): the graph is queried for each topic."""


def recorder_name(arguments: RosArguments) -> str:
    """Return the name of the node ``recorder`` in a process with these arguments."""
    return arguments.name_of("recorder", main=True)


class RecorderWait:
    """Checks whether a recorder has subscribed to the topics of one process.

    These are the topics that the stream of this process publishes, by ``nodes``, and ``others``, topics of the rack.
    """

    def __init__(self, rack_context: RackContext, nodes: Sequence[ModuleNode], *others: str) -> None:
        self._nodes = nodes
        self._space, self._name = f"/{rack_context.rack.config.namespace}", recorder_name(rack_context.arguments)
        recorded = LiveTopics.expected(self._space, rack_context.rack.config).all
        sent = [topic.name for topic in rack_context.stream.topics if topic.name in recorded]
        self._unread = [*dict.fromkeys(sent), *(f"{self._space}/{topic}" for topic in others)]
        self._next_ns = 0

    def is_over(self) -> bool:
        """Return whether the recorder has subscribed to all of them."""
        now = time.monotonic_ns()
        if self._unread and now >= self._next_ns:
            self._next_ns = now + _CHECK_NS
            self._unread = [topic for topic in self._unread if not self._is_read(topic)]
        return not self._unread

    def _is_read(self, topic: str) -> bool:
        readers = self._nodes[0].get_subscriptions_info_by_topic(topic)
        if not any(item.node_name == self._name and item.node_namespace == self._space for item in readers):
            return False
        every = (publisher for node in self._nodes for publisher in node.publishers)
        own = [publisher for publisher in every if publisher.topic_name == topic]
        return all(publisher.get_subscription_count() >= self._fitting(readers, publisher) for publisher in own)

    @staticmethod
    def _fitting(readers: list[Any], publisher: Any) -> int:
        """Return how many readers a publisher is matched with in the end; one that wants more than it offers is not."""
        latched = publisher.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        return sum(latched or item.qos_profile.durability == DurabilityPolicy.VOLATILE for item in readers)
