"""Whether a recorder hears all that this process of a distributed rack is going to send.

Its subscriptions are looked for in the graph: a reliable writer that has met a reader before its first message sends it
all of them, or sends them again.
"""

from __future__ import annotations

import time

from automax_ros.bags.live.topics import LiveTopics
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.nodes.module_node import ModuleNode, Site
from automax_ros.nodes.recorder import recorder_name

_LOOK_NS = 100 * NS_PER_MS
"""Time between two looks (decision): the graph is asked for each topic."""


class RecorderWait:
    """Looks for the recorder of one process."""

    def __init__(self, site: Site, node: ModuleNode, *others: str) -> None:
        """Look for readers of what the stream of this process sends, and of ``others``, topics of the rack."""
        self._node = node
        self._space, self._name = f"/{site.rack.config.namespace}", recorder_name(site.arguments)
        recorded = LiveTopics.expected(self._space, site.rack.config).all
        sent = [topic.name for topic in site.stream.topics if topic.name in recorded]
        self._unheard = [*dict.fromkeys(sent), *(f"{self._space}/{topic}" for topic in others)]
        self._next_ns = 0

    def is_over(self) -> bool:
        """Return whether the recorder hears all of it."""
        now = time.monotonic_ns()
        if self._unheard and now >= self._next_ns:
            self._next_ns = now + _LOOK_NS
            self._unheard = [topic for topic in self._unheard if not self._is_heard(topic)]
        return not self._unheard

    def _is_heard(self, topic: str) -> bool:
        readers = self._node.get_subscriptions_info_by_topic(topic)
        return any(item.node_name == self._name and item.node_namespace == self._space for item in readers)
