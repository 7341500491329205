"""ROS figures of this machine: jitter of the rack's loop, and latency of a write from another process. Never fails.

The loop is the rack's own, a ``Pacer``, in three forms: without ROS, which shows the jitter of the host itself; with
the executor served between scans on the same thread; and as in a rack, with the executor on a separate thread.
Latency is the time from a client's publish on ``/set`` to the latch that reads the value, by the clocks of one host.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", "87")

from automax_ros.ros.setup.environment import prepare

LOOP_SECONDS = 5.0
WRITES = 200

RACK = """rack: BENCH
slots:
  0:
    module: 57C435
    tick_ms: {tick}
    tasks:
      T: {{priority: 4}}
common:
  IN!: {{ros: in}}
  SEEN!: {{ros: out}}
"""
TASK = """10 COMMON IN!, SEEN!
100 CALL SCAN_LOOP(TICKS={ticks})
110 SEEN! = IN!
120 END
"""


def percentiles(values: list[float]) -> str:
    """Return p50, p99 and the greatest, in the values' unit."""
    ordered = sorted(values)
    return (
        f"p50 {statistics.median(ordered):8.1f}  p99 {ordered[int(len(ordered) * 0.99)]:8.1f}  max {ordered[-1]:8.1f}"
    )


FORMS = ("no ROS", "one thread", "threads")


def loop_jitter(period_ns: int, form: str) -> tuple[list[float], int]:
    """Return the lateness of each wake-up in us, and the number of skipped deadlines, of the rack's loop."""
    from rclpy.context import Context
    from rclpy.node import Node

    from automax_ros.ros.setup.process import make_executor
    from automax_ros.runtime.time.pacer import Pacer
    from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

    context = Context()
    context.init(args=["--ros-args", "--disable-stdout-logs"])
    executor = make_executor(context)
    node = Node("bench_loop", context=context)
    executor.add_node(node)
    scheduler, late, skipped_total = Scheduler(), [], 0
    waits = {"one thread": lambda seconds: executor.spin_once(timeout_sec=seconds)}
    pacer = Pacer(scheduler, wait=waits.get(form, time.sleep))
    ended = threading.Event()

    def spin() -> None:
        while not ended.is_set():
            executor.spin_once(timeout_sec=0.1)

    spinning = threading.Thread(target=spin)
    if form == "threads":
        spinning.start()

    def scan(instant_ns: int, skipped: int) -> None:
        nonlocal skipped_total
        late.append((pacer.now_ns - instant_ns) / 1000)
        skipped_total += skipped

    scheduler.every(period_ns, period_ns, EventKey(EventClass.SCAN, 4, "T"), scan)
    pacer.run(round(LOOP_SECONDS * 1e9))
    ended.set()
    if form == "threads":
        spinning.join()
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    return late, skipped_total


def write_latency(tick_ms: float) -> list[float]:
    """Return the time in us from a publish on /set in this process to the latch in a rack of another process."""
    import rclpy
    from automax_msgs.msg import Scan
    from rclpy.qos import QoSProfile
    from rclpy.serialization import deserialize_message
    from std_msgs.msg import Int32

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "rack.yaml").write_text(RACK.format(tick=tick_ms))
        (folder / "T.BLK").write_text(TASK.format(ticks=1))
        process = subprocess.Popen(
            [sys.executable, "-m", "automax_ros.cli.main", "run", str(folder / "rack.yaml")], stdout=subprocess.DEVNULL
        )
        rclpy.init()
        node = rclpy.create_node("bench_client")
        publisher = node.create_publisher(Int32, "/bench/common/IN/set", QoSProfile(depth=10))
        seen: dict[int, int] = {}

        def take(data: bytes) -> None:
            message = deserialize_message(data, Scan)
            for view, value in zip(message.read.variable, message.read.value, strict=True):
                if view == 0 and int(value) not in seen:
                    seen[int(value)] = message.stamp.sec * 1_000_000_000 + message.stamp.nanosec

        node.create_subscription(Scan, "/bench/scans", take, QoSProfile(depth=1000), raw=True)
        try:
            while publisher.get_subscription_count() == 0 or not seen:
                rclpy.spin_once(node, timeout_sec=0.1)
            sent: dict[int, int] = {}
            for number in range(1, WRITES + 1):
                sent[number] = time.time_ns()
                publisher.publish(Int32(data=number))
                end = time.monotonic() + 0.02
                while time.monotonic() < end:
                    rclpy.spin_once(node, timeout_sec=0.002)
        finally:
            process.terminate()
            process.wait()
            node.destroy_node()
            rclpy.shutdown()
    return [(seen[number] - moment) / 1000 for number, moment in sent.items() if number in seen]


def main() -> None:
    """Print all figures."""
    prepare()
    print("lateness of the rack's loop in us")
    for milliseconds in (0.5, 2.5, 5.5):
        for form in FORMS:
            late, skipped = loop_jitter(round(milliseconds * 1e6), form)
            over = 100 * sum(item > 1000 for item in late) / len(late)
            print(
                f"  {milliseconds:4} ms {form:10}  {percentiles(late)}  over 1 ms {over:5.2f} %  "
                f"{len(late)} scans, {skipped} deadlines missed"
            )
    print("write from another process to the latch in us (a latch each 0.5 ms; stamps are those of the grid)")
    print(f"          {percentiles(write_latency(0.5))}")


if __name__ == "__main__":
    main()
