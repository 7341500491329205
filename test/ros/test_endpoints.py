"""Every topic of a rack fits what the tools of ROS 2 use unless told otherwise, for readers and for writers."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import config_at
from rclpy.context import Context
from rclpy.duration import Infinite
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_sensor_data,
)

from automax_ros.rack.rack import Rack
from automax_ros.ros.rack_nodes import RackNodes

CONFIG = Path(__file__).parents[2] / "config"
WITHOUT_END = {
    "liveliness": LivelinessPolicy.AUTOMATIC,
    "liveliness_lease_duration": Infinite,
    "deadline": Infinite,
}
"""As the graph tells of everybody who sets nothing of it."""
COMMAND_LINE_WRITER = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    **WITHOUT_END,
)
"""What `ros2 topic pub` offers unless told otherwise."""
USUAL = QoSProfile(depth=10, **WITHOUT_END)
"""What a node asks for that says nothing but a depth."""


@pytest.fixture(params=["dc_drive", "section_drive", "two_racks/winder"])
def live(request, ros_domain_id):
    config = config_at(CONFIG / request.param / "rack.yaml")
    context = Context()
    context.init(args=[])
    with RackNodes(Rack(config), context=context) as nodes:
        yield nodes
    context.try_shutdown()


def test_whoever_echoes_hears_and_whoever_publishes_is_heard(live):
    graph = live.nodes[0]
    topics = [name for name, _ in graph.get_topic_names_and_types()]
    offered = {name: [item.qos_profile for item in graph.get_publishers_info_by_topic(name)] for name in topics}
    wanted = {name: [item.qos_profile for item in graph.get_subscriptions_info_by_topic(name)] for name in topics}
    space = f"/{live.rack.config.namespace}/"
    assert any(topic.startswith(f"{space}common/") and senders for topic, senders in offered.items())
    assert any(topic.endswith("/set") and readers for topic, readers in wanted.items())
    for topic, profiles in offered.items():
        for profile in profiles:
            assert fits(profile, qos_profile_sensor_data), topic
            # A drop of a network that was lost is old when it comes again: racks alone read it.
            assert fits(profile, USUAL) is not topic.startswith("/dcsnet/"), topic
        # `ros2 topic echo` asks for the least that all senders of a topic offer: so all offer the same.
        assert len({(profile.reliability, profile.durability) for profile in profiles}) <= 1, topic
    for topic, profiles in wanted.items():
        for profile in profiles:
            assert fits(COMMAND_LINE_WRITER, profile), topic
            assert fits(USUAL, profile), topic
        own = offered.get(topic, [])
        assert all(fits(sender, reader) for sender in own for reader in profiles), topic


def fits(sender: QoSProfile, reader: QoSProfile) -> bool:
    compatibility, _ = qos_check_compatible(sender, reader)
    return compatibility != QoSCompatibility.ERROR
