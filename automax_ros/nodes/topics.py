"""Topics of a rack's stream as rclpy publishers."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, QoSPublisherMatchedInfo
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind

from automax_ros.running.health import Health
from automax_ros.wire.qos import QosProfile
from automax_ros.wire.stream import Topic

COMMAND_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
"""What ``/set`` topics are subscribed with."""


def message_class(type_name: str) -> Any:
    """Return the Python class of a message type such as ``std_msgs/msg/Int16``."""
    package, kind, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), name)


def ros_qos(profile: QosProfile) -> QoSProfile:
    """Return a stream's quality of service for rclpy."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=profile.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL
        if profile.durability == "transient_local"
        else DurabilityPolicy.VOLATILE,
    )


def incompatible(node: Node, what: str, health: Health) -> Callable[[Any], None]:
    """Return what is told of a reader or writer with an incompatible quality of service; ``what`` says what is lost."""

    def told(event: Any) -> None:
        policy = str(qos_policy_name_from_kind(event.last_policy_kind)).lower()
        text = f"{what}: its quality of service does not fit ({policy})"
        node.get_logger().warning(text)
        health.note("QoS conflict", what, lambda: text, times=event.total_count_change)

    return told


def publisher(
    node: Node, topic: Topic, health: Health, matched: Callable[[QoSPublisherMatchedInfo], None] | None = None
) -> Publisher[Any]:
    """Return a node's publisher of a topic; it takes the message as CDR bytes. ``matched`` is told of each reader."""
    told = incompatible(node, f"a reader of {topic.name} gets nothing", health)
    events = PublisherEventCallbacks(matched=matched, incompatible_qos=told)
    kind = message_class(topic.type_name)
    return node.create_publisher(kind, topic.name, ros_qos(topic.qos), event_callbacks=events)
