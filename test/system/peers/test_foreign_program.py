"""A rack in a program that knows nothing of ours but RackNodes: threads, callbacks that wait, Ctrl-C, exceptions."""

import os
import signal
import subprocess
import sys

import pytest

from system.support import PATIENCE_S, ROOT

PROGRAM = """
import sys
from automax_ros import RackNodes, prepare
prepare()
import rclpy
from automax_msgs.srv import ReadStatus
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int16
from std_srvs.srv import Trigger


class Cell(Node):
    def __init__(self):
        super().__init__("cell")
        group = ReentrantCallbackGroup()
        self.status = self.create_client(ReadStatus, "/cell1/status", callback_group=group)
        self.create_service(Trigger, "~/ask", self.ask, callback_group=group)
        self.asking = self.create_client(Trigger, "~/ask", callback_group=group)
        self.ticks = 0
        self.create_timer(0.01, self.tick, callback_group=group)

    def ask(self, request, response):
        "A service that waits for the rack's, which the same executor serves."
        response.success = self.status.wait_for_service(20.0) and self.status.call(ReadStatus.Request()).ok
        return response

    def tick(self):
        self.ticks += 1
        if self.ticks == 30:
            print("asked", self.asking.call(Trigger.Request()).success, flush=True)
        if self.ticks == 40 and "raise" in sys.argv:
            raise RuntimeError("a mistake of the program's own")


rclpy.init()
cell = Cell()
executor = MultiThreadedExecutor(num_threads=4)
executor.add_node(cell)
try:
    with RackNodes("RACK") as nodes:
        nodes.add_to(executor)
        nodes.start()
        executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    print("scans", nodes.rack.statistics["LINE"].scans > 10, dict(nodes.health.counts))
finally:
    executor.shutdown()
    rclpy.try_shutdown()
"""


@pytest.fixture
def program(ros_domain_id, tmp_path):
    (tmp_path / "rack.yaml").write_text(
        "rack: CELL1\noperator: true\nslots:\n  0: {module: 57C435, tasks: {LINE: {priority: 5}}}\n"
    )
    (tmp_path / "LINE.BLK").write_text("10 CALL SCAN_LOOP(TICKS=1)\n20 END\n")
    source = PROGRAM.replace('"RACK"', repr(str(tmp_path / "rack.yaml")))

    def started(*arguments: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", source, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=os.environ,
        )

    return started


def test_callbacks_that_wait_for_the_rack_and_an_end_by_ctrl_c(program):
    """No deadlock between a service that waits, the rack's own and its scans; Ctrl-C leaves nothing running."""
    process = program()
    assert process.stdout.readline() == "asked True\n"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out, err) == (0, "scans True {}\n", "")


def test_an_exception_of_the_program_is_the_programs(program):
    """It comes out of its spin, the rack is closed, and the process ends with it."""
    process = program("raise")
    out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert out == "asked True\n"
    assert err.rstrip().endswith("RuntimeError: a mistake of the program's own")
    assert err.count("Traceback") == 1
