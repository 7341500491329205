"""A small rack cut into three processes that pass their batches on by hand, and the same rack in one piece."""

from __future__ import annotations

from pathlib import Path

from automax_ros.rack.distributed.image_sync import Batch, ImageSync
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import RackConfig
from rack.helpers import config_at

RACK = """
rack: CUT1
operator: true
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {ONE: {priority: 5}}}
  2: {module: 57C435, tick_ms: 5.5, tasks: {TWO: {priority: 5}}}
  5: {module: 57C403}
  10: {module: 57552, tasks: {WIND_A: {drive: A}}}
common:
  A%: {preset: 7}
  B%: {}
  R: {}
  T%(4): {}
  S$:8: {}
  GO@: {}
  OUT%: {slot: 5, register: 0}
  OUT3@: {slot: 5, register: 0, bit: 3}
  OUT7@: {slot: 5, register: 0, bit: 7}
  LONG!: {slot: 10, register: 300}
  LOW@: {slot: 10, register: 301, bit: 0}
  HALF: {slot: 10, register: 302}
"""
ONE = """10 COMMON A%, GO@
20 LOCAL N%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=A%)
120 N% = N% + 1
200 END
"""
TWO = """10 COMMON A%, B%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=A%, INPUT2=0, OUTPUT=B%)
200 END
"""
WIND_A = """100 CALL SCAN_LOOP(TICKS=2)
200 END
"""
PROCESS_SLOTS = ((0, 5), (1,), (2, 10))


def config_in(folder: Path, text: str = RACK) -> RackConfig:
    """Return the rack, read from files in a folder."""
    for name, source in (("rack.yaml", text), ("ONE.BLK", ONE), ("TWO.BLK", TWO), ("WIND_A.BLK", WIND_A)):
        (folder / name).write_text(source, encoding="ascii")
    return config_at(folder / "rack.yaml")


class Process:
    """One process: its part of the rack, its link, and what it has sent."""

    def __init__(self, config: RackConfig, slots: tuple[int, ...], *, common=lambda: False, **more) -> None:
        self.rack = Rack(config, local=slots)
        self.sent: list[Batch] = []
        self.link = ImageSync(self.rack, min(slots), self.sent.append, common, **more)
        self.taken: dict[int, int] = {}
        self.link.begin()

    def start(self) -> Process:
        self.rack.start()
        self.link.starting = False
        return self

    def hear(self, other: Process, most: int | None = None) -> None:
        """Take what another has sent and this one has not taken, at most some batches."""
        first = self.taken.get(other.link.process_slot, 0)
        batches = other.sent[first:] if most is None else other.sent[first : first + most]
        self.taken[other.link.process_slot] = first + len(batches)
        for batch in batches:
            self.link.receive(batch)


def cut(config: RackConfig) -> list[Process]:
    """Return the rack's processes, started."""
    return [process.start() for process in [Process(config, slots) for slots in PROCESS_SLOTS]]


def settle(processes: list[Process]) -> None:
    """Let all hear all, until none has anything left to send."""
    while any(
        process.taken.get(other.link.process_slot, 0) < len(other.sent)
        for process in processes
        for other in processes
        if other is not process
    ):
        for process in processes:
            for other in processes:
                if other is not process:
                    process.hear(other)


def image(process: Process) -> dict[tuple[str, int], object]:
    """Return all that a process holds, by name and element."""
    memory = process.rack.memory
    return {(memory.specs[view].name, element): value for view, element, value in memory.image()}
