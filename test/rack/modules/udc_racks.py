"""Racks with a UDC for its tests."""

from __future__ import annotations

from pathlib import Path

from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from rack.helpers import Observer, rack_at

HEAD = """\
rack: PM1
{top}slots:
  0: {{module: 57C435, tick_ms: 0.5, tasks: {{LINE: {{priority: 5}}}}}}
  10: {{module: 57552, tasks: {{{tasks}}}{more}}}
common:
"""
BOTH = "WIND_A: {drive: A}, WIND_B: {drive: B}"
IDLE = "10 CALL SCAN_LOOP(TICKS=20)\n20 END\n"
POINTS = """\
  CCLK@: {slot: 10, register: 2000, bit: 6}
  ISCR%: {slot: 10, register: 2000}
  NTH%: {slot: 10, register: 2001}
  COUNT%: {slot: 10, register: 2002}
"""


def written(folder: Path, points: str, *, tasks: str = BOTH, top: str = "", more: str = "", **sources: str) -> Path:
    """Write a rack file, with POINTS, and the sources of its tasks; LINE is idle unless it is given."""
    for name, text in ({"LINE": IDLE} | sources).items():
        (folder / f"{name}.BLK").write_text(text)
    path = folder / "rack.yaml"
    path.write_text(HEAD.format(tasks=tasks, top=top, more=more) + POINTS + points)
    return path


def built(folder: Path, points: str, **more: str) -> Rack:
    """Return the rack, not started."""
    return rack_at(written(folder, points, **more))


class Seen(Observer):
    """What an observer is told: writes, and scans with their instants."""

    def __init__(self, rack: Rack) -> None:
        self.rack = rack
        self.scans: list[tuple[int, str, int]] = []
        self.writes: list[tuple[int, str, int | float | bool]] = []
        self.operations: list[Operation] = []
        rack.observe(self)

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        self.scans.append((record.time_ns, task.name, record.scan))
        self.written(writes)

    def written(self, writes: list[WriteGroup]) -> None:
        for item in (entry for group in writes for entry in group.entries()):
            spec = self.rack.memory.specs[item.view]
            if not spec.is_array:
                self.writes.append((item.time_ns, spec.name, item.value))

    def operated(self, operation: Operation) -> None:
        self.operations.append(operation)

    def start(self) -> Seen:
        self.rack.start()
        return self

    def of(self, name: str) -> list[tuple[int, int | float | bool]]:
        """Return the writes of one common: instants in us, values."""
        return [(time // 1000, value) for time, written, value in self.writes if written == name]
