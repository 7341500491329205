"""Publishes the presence of a single-process rack and detects other racks of the same name.

Two racks of one name, each started where the other's lock cannot be seen, confuse their subscribers: each reports it,
in a line and in its diagnostics. Distributed racks do the same over their bus (``ros/distributed/bus``).
"""

from __future__ import annotations

import os
import time

from automax_msgs.msg import Presence as PresenceClass
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import Presence, Stage
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.distributed.bus import PRESENCE, presence_qos
from automax_ros.ros.distributed.bus_topics import BusTopic, Terms
from automax_ros.runtime.health import FROM_STRANGERS

PERIOD_NS = NS_PER_S
"""Period of the presence of a single-process rack (decision): no program waits for it."""
_MOST_BYTES = 1 << 16


class PresencePublisher:
    """Publishes the presence of a rack that is whole in this process."""

    def __init__(self, rack_context: RackContext, node: ModuleNode) -> None:
        self._rack_context, self._process = rack_context, int.from_bytes(os.urandom(8), "big") >> 1 or 1
        self._publisher = node.create_publisher(PresenceClass, PRESENCE, presence_qos())
        kind, terms = "automax_msgs/msg/Presence", Terms(_MOST_BYTES)
        BusTopic(node, PRESENCE, kind, QoSProfile(depth=10), self._receive, self._refuse, terms)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(PERIOD_NS / NS_PER_S, node.guarded_callback(PRESENCE, self._publish), clock=steady)

    def _publish(self) -> None:
        rack, run_id = self._rack_context.rack, self._rack_context.stream.run_id
        slots = tuple(sorted(rack.part.slots))
        presence = Presence(
            time.time_ns(), rack.config.name, run_id, self._process, slots[0], slots, rack.installed, int(Stage.RUNNING)
        )
        self._publisher.publish(encode(presence))

    def _receive(self, presence: Presence, _: bytes) -> None:
        if presence.process != self._process:
            name = self._rack_context.rack.config.name
            text = f"another rack is named {name}: their messages cannot be distinguished"
            self._rack_context.health.note("other rack", presence.run_id, lambda: text, most=FROM_STRANGERS)

    def _refuse(self, topic: str, what: str) -> None:
        self._rack_context.health.note("refused message", topic, lambda: f"{topic}: {what} was refused")
