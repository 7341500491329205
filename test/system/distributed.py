"""A distributed rack for tests: `automax run --distributed` as a child, and its own children by name."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from pathlib import Path
from typing import Any

from automax_ros.core.ticks import NS_PER_S

from .support import RACKS, Automax, Client, wait_until

LINE4 = RACKS / "line4"
SEATS = ("common_memory", "processor_1", "processor_2", "processor_3", "processor_4", "digital_io_5", "udc_10")
RINGS = range(1, 5)
FEED = {ring: (ring + 2) % 4 + 1 for ring in RINGS}
"""Which Processor is before each in the ring."""


def copied(folder: Path, *, rule: str = "hold", more: str = "") -> Path:
    """Return a copy of the rack LINE4 with a rule for lost processes, and with more entries of its stimuli."""
    rack = shutil.copytree(LINE4, folder / "line4")
    file = rack / "rack.yaml"
    file.write_text(file.read_text().replace("on_module_loss: hold", f"on_module_loss: {rule}"))
    stimuli = rack / "stimuli.yaml"
    stimuli.write_text(stimuli.read_text() + more)
    return rack


class Distributed(Automax):
    """`automax run RACK --distributed` with its stimuli; ``report`` is read at the end."""

    def __init__(self, rack: Path, *options: str | Path) -> None:
        self._report = rack.parent / "report.json"
        given = ("--stimuli", rack / "stimuli.yaml", "--report", self._report)
        super().__init__("run", rack, "--distributed", *given, *options)

    @property
    def seats(self) -> dict[str, int]:
        """The ids of the rack's processes that live, by name."""
        found = {}
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                if int(path.read_text().rpartition(")")[2].split()[1]) == self.pid:
                    words = (path.parent / "cmdline").read_bytes().decode().split("\0")
                    found[words[words.index("--module") + 1]] = int(path.parent.name)
            except (OSError, ValueError):
                continue  # it has just ended, or is the recorder
        return found

    def kill(self, seat: str) -> int:
        """Kill a process of the rack; return its id."""
        pid = self.seats[seat]
        os.kill(pid, signal.SIGKILL)
        return pid

    def wait_until_back(self, seat: str, pid: int) -> None:
        """Wait until another process has a seat."""
        wait_until(lambda: self.seats.get(seat, pid) != pid)

    @property
    def report(self) -> dict[str, Any]:
        """The report of the run that has ended."""
        return json.loads(self._report.read_text())


class Line(Client):
    """What a test sees of LINE4 in the graph: its counters, who takes part, and the wall clock at rack time 0."""

    def __init__(self) -> None:
        from automax_msgs.msg import Presence
        from std_msgs.msg import Int32

        super().__init__("line_client")
        self.values: dict[str, int] = {}
        self.processes: dict[int, Any] = {}
        self.began_ns = 0
        for ring in RINGS:
            for name in (f"N_{ring}", f"SEEN_{ring}", f"SUM_{ring}"):
                self._follow(Int32, name)

        def heard(presence: Any) -> None:
            self.processes[presence.seat] = presence
            self.began_ns = max(self.began_ns, presence.epoch_ns)

        self.node.create_subscription(Presence, "/line4/bus/presence", heard, 100)

    def _follow(self, kind: Any, name: str) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile

        def came(message: Any) -> None:
            self.values[name] = message.data

        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.node.create_subscription(kind, f"/line4/common/{name}", came, qos)

    def listen_raw(self, type_name: str, topic: str) -> list[bytes]:
        """Take the messages of a topic as they are."""
        from automax_ros.nodes.topics import message_class

        received: list[bytes] = []
        self.node.create_subscription(message_class(type_name), topic, received.append, 50_000, raw=True)
        return received

    def until_it_scans(self) -> None:
        """Wait until all processes run and all counters move."""
        from automax_msgs.msg import Presence

        running = Presence.RUNNING
        self.until(
            lambda: (
                len(self.processes) == len(SEATS) and all(item.state == running for item in self.processes.values())
            ),
            "all processes run",
        )
        before = dict(self.values)
        self.until(lambda: all(self.values.get(f"N_{n}", 0) > before.get(f"N_{n}", 0) for n in RINGS), "counters move")

    def until_new(self, seat: int, process: int) -> None:
        """Wait until another life of a process runs."""
        from automax_msgs.msg import Presence

        def is_back() -> bool:
            found = self.processes[seat]
            return found.process != process and found.state == Presence.RUNNING

        self.until(is_back, f"seat {seat} is back")

    def halt(self) -> None:
        """Let the ring stand still, and wait until each has seen the last of the one before it."""
        from std_msgs.msg import Bool

        self.send(Bool, "/line4/common/HALT/set", Bool(data=True))
        self.until(
            lambda: all(self.values.get(f"SEEN_{n}") == self.values.get(f"N_{FEED[n]}", -1) for n in RINGS),
            "the ring stands still",
        )
        self._until_heard()

    def until_quiet(self, received: list[bytes], after_ns: int, quiet_s: float = 2.0) -> None:
        """Wait until nothing has come for a while after a rack time, and all have taken what was sent."""
        seen = (len(received), time.monotonic())

        def is_quiet() -> bool:
            nonlocal seen
            if len(received) != seen[0]:
                seen = len(received), time.monotonic()
            is_over = self.began_ns and time.time_ns() > self.began_ns + after_ns
            return bool(is_over) and time.monotonic() - seen[1] > quiet_s

        self.until(is_quiet, "silence")
        self._until_heard()

    def _until_heard(self) -> None:
        """Wait until all processes have had the time to take what was sent until now."""
        from builtin_interfaces.msg import Time

        def later(stamp: Time) -> bool:
            return int(stamp.sec * NS_PER_S + stamp.nanosec) > since_ns

        for _ in range(3):
            since_ns = time.time_ns() + NS_PER_S // 2
            self.until(lambda: all(later(item.stamp) for item in self.processes.values()), "a word of all processes")
