"""Racks on one network over real DDS: values to and fro, loss, two modules with one drop, what strangers send."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.modules.network_racks import LINE, MASTER, SLAVE, WIND, built, station
from system.support import wait_until

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.ros_names import network_topic


class Linked:
    """Racks as nodes of this process, each with an executor's thread of its own."""

    def __init__(self) -> None:
        from rclpy.context import Context

        self.context = Context()
        self.context.init(args=["--ros-args", "--disable-stdout-logs"])
        self.made: list = []

    def add(self, rack: Rack):
        import threading

        from rclpy.executors import SingleThreadedExecutor

        from automax_ros.ros.rack_nodes import RackNodes

        nodes, executor = RackNodes(rack, context=self.context), SingleThreadedExecutor(context=self.context)
        nodes.add_to(executor)
        thread = threading.Thread(target=executor.spin, daemon=True)
        self.made.append((nodes, executor, thread))
        nodes.start()
        thread.start()
        return nodes

    def close(self) -> None:
        for nodes, executor, thread in self.made:
            executor.shutdown()
            thread.join()
            nodes.close()
        self.context.try_shutdown()


@pytest.fixture
def linked(ros_domain_id):
    made = Linked()
    yield made
    made.close()


def value(nodes, name: str):
    with nodes.lock:
        return nodes.rack.value(name)


def write(nodes, name: str, number: int) -> None:
    with nodes.lock:
        nodes.rack.write(name, number)


def status(nodes):
    with nodes.lock:
        return station(nodes.rack).status()


def test_two_racks_are_linked_and_notice_each_others_end(linked, tmp_path: Path):
    line, wind = (
        linked.add(built(tmp_path / "line", MASTER, LINE)),
        linked.add(built(tmp_path / "wind", SLAVE, WIND)),
    )
    write(line, "SPEED%", -77)
    wait_until(lambda: value(wind, "REF%") == -77)
    wait_until(lambda: value(line, "FEEDBACK%") == -77)
    wait_until(lambda: value(line, "UP3@") and value(wind, "DROPS%") == 0b11001)
    assert value(wind, "LENGTH!") == -100_000
    with wind.lock:
        wind.rack.operations.power_off()
    wait_until(lambda: status(line).code == "C")
    assert value(line, "FEEDBACK%") == -77
    assert not value(line, "UP3@")
    assert line.rack.stop_reason is None
    with wind.lock:
        wind.rack.operations.power_on()
        wind.rack.operations.run_all()
    wait_until(lambda: status(line).code == "" and value(line, "UP3@"))


def test_two_modules_with_one_drop_are_told_to_both(linked, tmp_path: Path):
    racks = [
        linked.add(built(tmp_path / "line", MASTER, LINE)),
        linked.add(built(tmp_path / "wind", SLAVE, WIND)),
        linked.add(built(tmp_path / "twin", SLAVE.replace("rack: WIND", "rack: TWIN"), WIND)),
    ]
    for nodes, other in zip(racks[1:], ("TWIN", "WIND"), strict=True):
        wait_until(lambda nodes=nodes: nodes.health.counts.get("two modules with one drop", 0) > 0)
        assert any(f"rack {other} slot 8" in line for line in nodes.health.news())


def test_strangers_do_no_harm(linked, tmp_path: Path):
    """Bytes that are nothing, long messages, forged frames, two thousand messages at once: counted, and scans go on."""
    from automax_msgs.msg import NetworkDrop
    from rclpy.node import Node

    from automax_ros.messages.types.topics import NETWORK
    from automax_ros.ros.base.qos import ros_qos
    from automax_ros.ros.nodes.network import MOST_BYTES

    line = linked.add(built(tmp_path / "line", MASTER, LINE))
    stranger = Node("stranger", context=linked.context)
    publisher = stranger.create_publisher(NetworkDrop, "/dcsnet/PAPER", ros_qos(NETWORK))
    wait_until(lambda: publisher.get_subscription_count() > 0)
    junk = [
        b"",
        b"\x00",
        b"\x00\x01\x00\x00" + b"\xff" * 60,
        b"\x00\x01\x00\x00" + bytes(MOST_BYTES),
        b"\x00\x01\x00\x00" + bytes(100_000),
    ]

    def unreadable() -> int:
        return dict(status(line).counters)["unreadable"]

    def sent() -> bool:
        for payload in junk[2:]:
            publisher.publish(payload)
        publisher.publish(NetworkDrop(station=3, depth=9, drop=60, registers=[1] * 32))
        publisher.publish(NetworkDrop(station=3, depth=1, drop=3, registers=[1] * 5))
        return unreadable() >= 20

    wait_until(sent)
    before, scans = unreadable(), line.rack.statistics["LINE"].scans
    for _ in range(2000):
        publisher.publish(NetworkDrop(station=77))
    wait_until(lambda: unreadable() > before)
    wait_until(lambda: line.rack.statistics["LINE"].scans > scans + 20)
    assert value(line, "FEEDBACK%") == 0
    stranger.destroy_node()


def test_the_cable_stands_next_to_the_racks():
    assert network_topic("line1", "PAPER") == "/dcsnet/PAPER"
    assert network_topic("plant/line1", "PAPER") == "/plant/dcsnet/PAPER"
