"""Message types and quality of service, as rclpy has them."""

from __future__ import annotations

import importlib
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from automax_ros.messages.types.topics import QosProfile


def message_class(type_name: str) -> Any:
    """Return the Python class of a message type such as ``std_msgs/msg/Int16``."""
    package, kind, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), name)


def ros_qos(profile: QosProfile) -> QoSProfile:
    """Return a topic's quality of service for rclpy."""
    reliable, latched = profile.reliability == "reliable", profile.durability == "transient_local"
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=profile.depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
