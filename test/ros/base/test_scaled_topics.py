"""A variable with a scale over real DDS: Float32 both ways, clamped and told once, refused if not finite."""

import math
import time

from ros.support import until

RACK = """\
rack: SCALED
slots:
  0: {module: 57C435, tasks: {T: {priority: 5}}}
  6: {module: 57C409}
  7: {module: 57C410}
common:
  PRESSURE%: {slot: 6, register: 0, ros: in, scale: {counts: [0, 4095], value: [0.0, 10.0]}, unit: bar}
  SPEED%: {slot: 7, register: 3, ros: out, scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}, unit: rpm}
  REF%: {ros: in}
"""
SOURCES = {"T": "10 COMMON PRESSURE%, SPEED%\n20 CALL SCAN_LOOP(TICKS=1)\n30 SPEED% = -PRESSURE%\n40 END\n"}


def test_bars_in_and_revolutions_out(live, client):
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import Float32

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    speeds: list[float] = []
    pressures: list[float] = []
    client.node.create_subscription(Float32, "/scaled/common/SPEED", lambda it: speeds.append(it.data), latched)
    client.node.create_subscription(Float32, "/scaled/common/PRESSURE", lambda it: pressures.append(it.data), latched)
    writer = client.node.create_publisher(Float32, "/scaled/common/PRESSURE/set", 10)
    value = live.rack.value

    def send(bar: float, counts: int) -> None:
        def arrived() -> bool:
            writer.publish(Float32(data=bar))
            time.sleep(0.01)
            return value("PRESSURE%") == counts and value("SPEED%") == -counts

        until(live, client, arrived)
        until(live, client, lambda: speeds and abs(speeds[-1] + counts * 1750.0 / 4095) < 1e-3)
        until(live, client, lambda: pressures and abs(pressures[-1] - counts * 10.0 / 4095) < 1e-5)

    send(5.2, 2129)
    assert not live.health.counts
    send(12.5, 4095)
    send(-1.0, 0)
    news = live.health.news()
    assert len(news) == 1, "it is told once"
    assert "12.5 bar" in news[0]
    assert "4095 counts" in news[0]
    assert live.health.counts["clamped value"] >= 2
    refused = live.health.counts["refused write"]
    assert not refused
    for wrong in (math.nan, math.inf, -math.inf):
        before = live.health.counts["refused write"]

        def told(wrong=wrong, before=before) -> bool:
            writer.publish(Float32(data=wrong))
            time.sleep(0.01)
            return live.health.counts["refused write"] > before

        until(live, client, told)
    assert value("PRESSURE%") == 0
    assert [text for text in live.health.news() if "PRESSURE%" in text]


def test_without_power_only_inputs_change(live, client):
    from std_msgs.msg import Float32, Int16

    pressure = client.node.create_publisher(Float32, "/scaled/common/PRESSURE/set", 10)
    reference = client.node.create_publisher(Int16, "/scaled/common/REF/set", 10)
    until(live, client, lambda: pressure.get_subscription_count() and reference.get_subscription_count())
    live.rack.operations.power_off()
    reference.publish(Int16(data=7))
    until(live, client, lambda: live.health.counts["refused write"])
    pressure.publish(Float32(data=10.0))
    until(live, client, lambda: live.rack.value("PRESSURE%") == 4095)
    assert live.rack.value("REF%") == 0
