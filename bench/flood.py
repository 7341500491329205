"""Effect of a hostile program on a rack: scans skipped while it sends, compared with idle, and memory. Never fails.

The attacker is that of the tests (``test/system/hostile.py``): 10 MB messages, 10,000 messages per second, malformed
CDR, large and many requests. It and DDS's own threads need a core themselves.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", "88")

from automax_ros.ros.setup.environment import prepare

SYSTEM = Path(__file__).parent.parent / "test" / "system"
KINDS = ("large", "fast", "malformed", "requests")
IDLE_S = 5.0
TASK = "processor_2: COPY"
"""A scan each 2.5 ms."""


class Watch:
    """The scans of the rack, from ``/diagnostics``."""

    def __init__(self) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray

        rclpy.init()
        self._spin = rclpy.spin_once
        self._node: Any = rclpy.create_node("bench_watch")
        self._last: dict[str, str] = {}
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._take, 10)

    def figures(self) -> tuple[int, int]:
        """Return scans and skipped scans so far, from a fresh message."""
        self._last = {}
        while not self._last:
            self._spin(self._node, timeout_sec=0.1)
        return int(float(self._last["scans"])), int(float(self._last["skipped"]))

    def _take(self, message: Any) -> None:
        for status in message.status:
            if status.name.endswith(TASK):
                self._last = {item.key: item.value for item in status.values}


def resident_mb(pid: int) -> float:
    """Return the memory of a process, MB."""
    match = re.search(r"VmRSS:\s*(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    return int(match[1]) / 1000 if match else 0.0


def attacked(kind: str) -> None:
    """Run one kind of attack; ``idle`` only waits."""
    if kind == "idle":
        time.sleep(IDLE_S)
    else:
        subprocess.run(
            [sys.executable, SYSTEM / "hostile.py", kind], check=True, stdout=subprocess.DEVNULL, timeout=120
        )


def main() -> None:
    """Print all figures."""
    prepare()
    with tempfile.TemporaryDirectory() as state:
        rack = SYSTEM / "racks" / "types" / "rack.yaml"
        command = [sys.executable, "-m", "automax_ros.cli.main", "run", rack, "--state", state]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            watch = Watch()
            print(f"scans of 2.5 ms that were skipped, of a rack with {len(KINDS)} attackers one after the other")
            for kind in ("idle", *KINDS, "idle"):
                scans, skipped = watch.figures()
                attacked(kind)
                scans_after, skipped_after = watch.figures()
                missed, done = skipped_after - skipped, scans_after - scans
                share = 100 * missed / max(1, missed + done)
                print(
                    f"  {kind:10} {missed:6} of {missed + done:6}  {share:6.2f} %  {resident_mb(process.pid):6.0f} MB"
                )
        finally:
            process.terminate()
            process.wait()


if __name__ == "__main__":
    main()
