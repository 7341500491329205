"""A distributed rack for tests: `automax run --distributed` as a child, and its own children by name."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.types.messages import NAMES, Presence, Stage
from automax_ros.messages.types.topics import SCAN, VALUE, QosProfile
from automax_ros.recordings.live.topics import TopicKind
from automax_ros.ros.clients.recorder import RawSubscription
from system.support import PATIENCE_S, RACKS, Automax, Client, wait_until

LINE4 = RACKS / "line4"
PROCESS_NAMES = ("common_memory", "processor_1", "processor_2", "processor_3", "processor_4", "digital_io_5", "udc_10")
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
    """`automax run RACK --distributed` with its stimuli, if it has any; ``report`` is read at the end."""

    def __init__(self, rack: Path, *options: str | Path) -> None:
        self._report = rack.parent / "report.json"
        stimuli = rack / "stimuli.yaml"
        given = ("--report", self._report, *(("--stimuli", stimuli) if stimuli.exists() else ()))
        super().__init__("run", rack, "--distributed", *given, *options)

    @property
    def process_ids(self) -> dict[str, int]:
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

    def kill(self, name: str) -> int:
        """Kill a process of the rack; return its id."""
        pid = self.process_ids[name]
        os.kill(pid, signal.SIGKILL)
        return pid

    def wait_until_back(self, name: str, pid: int) -> None:
        """Wait until another process has its place."""
        wait_until(lambda: self.process_ids.get(name, pid) != pid)

    @property
    def report(self) -> dict[str, Any]:
        """The report of the run that has ended."""
        return json.loads(self._report.read_text())


class Line(Client):
    """What a test sees of LINE4 in the graph: its counters, who takes part, and the wall clock at rack time 0.

    It looks at what waits in DDS instead of being called for each message: seven processes send 2,500 in a second, and
    whoever lags behind on a busy machine would look at what was long ago.
    """

    patience_s = 4 * PATIENCE_S
    """Seven processes share the machine with the tests next to this one, and each start takes 2.5 s of a core."""

    def __init__(self) -> None:
        from rclpy.node import Node

        super().__init__("line_client")
        self._not_served = Node("line_sources", context=self.context, enable_rosout=False)
        self.values: dict[str, int] = {}
        self.processes: dict[int, Presence] = {}
        self.began_ns = 0
        self._sources: list[tuple[RawSubscription, Callable[[bytes], object]]] = []
        for name in (f"{what}_{ring}" for ring in RINGS for what in ("N", "SEEN", "SUM")):
            self._look_at("std_msgs/msg/Int32", f"/line4/common/{name}", partial(self._came, name), VALUE)
        self._look_at(NAMES[Presence], "/line4/bus/presence", self._heard)

    def __exit__(self, *error: object) -> None:
        if error[0] is not None:
            print(f"seen at the end: {self.values}, {[*self.processes.values()]}")
        self._not_served.destroy_node()
        super().__exit__(*error)

    def listen_raw(self, type_name: str, topic: str) -> list[bytes]:
        """Take the messages of a topic as they are."""
        received: list[bytes] = []
        self._look_at(type_name, topic, received.append)
        return received

    def look(self) -> None:
        """Take all that has come."""
        for source, take in self._sources:
            for found in source.taken():
                assert found.payload is not None
                take(found.payload)

    def _look_at(self, type_name: str, topic: str, take: Callable[[bytes], object], qos: QosProfile = SCAN) -> None:
        self._sources.append((RawSubscription(self._not_served, topic, TopicKind(type_name, qos)), take))

    def _came(self, name: str, payload: bytes) -> None:
        self.values[name] = decode("std_msgs/msg/Int32", payload)[0]

    def _heard(self, payload: bytes) -> None:
        presence = decode(NAMES[Presence], payload)
        assert isinstance(presence, Presence)
        self.processes[presence.seat] = presence
        self.began_ns = max(self.began_ns, presence.epoch_ns)

    def until_it_scans(self) -> None:
        """Wait until all processes run and all counters move."""
        running = Stage.RUNNING
        self.until(
            lambda: (
                len(self.processes) == len(PROCESS_NAMES)
                and all(item.state == running for item in self.processes.values())
            ),
            "all processes run",
        )
        before = dict(self.values)
        self.until(lambda: all(self.values.get(f"N_{n}", 0) > before.get(f"N_{n}", 0) for n in RINGS), "counters move")

    def until_new(self, slot: int, process: int) -> None:
        """Wait until another life of a process runs."""

        def is_back() -> bool:
            found = self.processes[slot]
            return found.process != process and found.state == Stage.RUNNING

        self.until(is_back, f"the process of slot {slot} is back")

    def halt(self) -> None:
        """Let the ring stand still, and wait until each has seen the last of the one before it."""
        from std_msgs.msg import Bool

        topic = "/line4/common/HALT/set"
        publisher = self.node.create_publisher(Bool, topic, 10)
        shown: list[bool] = []
        kind = "std_msgs/msg/Bool"
        self._look_at(kind, "/line4/common/HALT", lambda payload: shown.append(decode(kind, payload)[0]), VALUE)
        sent_s = 0.0

        def is_halted() -> bool:
            nonlocal sent_s
            # For a while a reader of a process that was killed is found as well as that of the one that came back.
            if time.monotonic() - sent_s > 1.0:
                publisher.publish(Bool(data=True))
                sent_s = time.monotonic()
            return bool(shown and shown[-1])

        self.until(is_halted, "HALT is set")
        self.node.destroy_publisher(publisher)
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
        for _ in range(3):
            self._until_word_since(time.time_ns() + NS_PER_S // 2)

    def _until_word_since(self, time_ns: int) -> None:
        self.until(lambda: all(item.stamp > time_ns for item in self.processes.values()), "a word of all processes")
