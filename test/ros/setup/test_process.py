"""The program's executor while nodes come and go."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rclpy.node import Node
from system.support import wait_until

from automax_ros.ros.intake.guard import RequestGuard
from automax_ros.ros.setup.process import RosProcess
from automax_ros.runtime.health import Health

ROOT = Path(__file__).parents[3]
LEAVING = """
import threading

from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from std_msgs.msg import Int16

from automax_ros.ros.intake.guard import Guard
from automax_ros.ros.setup.process import RosProcess
from automax_ros.runtime.health import Health

TOPICS, CYCLES = [f"t{number}" for number in range(10)], 4
other, over, met = Context(), threading.Event(), threading.Event()
other.init(args=[])


def come_and_go() -> None:
    reader = Node("reader", context=other, enable_rosout=False)
    while not over.is_set():
        made = [reader.create_subscription(Int16, topic, print, 10) for topic in TOPICS]
        while not met.is_set() and not over.wait(0.01):
            pass
        over.wait(0.01)
        for subscription in made:
            reader.destroy_subscription(subscription)


comes = threading.Thread(target=come_and_go)
comes.start()
process, health = RosProcess(), Health()
process.spin(Guard(health, print))
for cycle in range(CYCLES):
    met.clear()
    with process.resting():
        node = Node("sender", context=process.context, enable_rosout=False)
        for topic in TOPICS:
            node.create_publisher(Int16, topic, 1, event_callbacks=PublisherEventCallbacks(matched=lambda _: met.set()))
        process.executor.add_node(node)
    assert met.wait(60.0)
    with process.resting():
        over.wait(0.03)
        process.executor.remove_node(node)
        node.destroy_node()
process.close()
over.set()
comes.join()
print(health.counts)
"""


def test_those_that_stay_are_served_when_others_have_left(ros_domain_id):
    process, served = RosProcess(), []
    stays, leaves = (Node(name, context=process.context, enable_rosout=False) for name in ("stays", "leaves"))
    stays.create_timer(0.005, lambda: served.append(1))
    for node in (stays, leaves):
        process.executor.add_node(node)
    process.spin(RequestGuard(Health(), print))
    wait_until(lambda: bool(served))
    with process.resting():
        process.executor.remove_node(leaves)
        leaves.destroy_node()
    assert set(process.executor.get_nodes()) == {stays}
    served.clear()
    wait_until(lambda: bool(served))
    process.close()


@pytest.mark.timeout(300)
def test_nodes_leave_while_readers_of_theirs_leave(ros_domain_id):
    """Each end of a rack of several processes; EventsExecutor crashed where its events were still to be carried out."""
    ended = subprocess.run(
        [sys.executable, "-c", LEAVING], cwd=ROOT, capture_output=True, text=True, timeout=280, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.splitlines()[-1] == "Counter()"
