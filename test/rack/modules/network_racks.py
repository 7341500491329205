"""Racks on one network, and a cable between them that a test can cut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from automax_ros.rack.modules.network import CYCLE_NS, NetworkModule
from automax_ros.rack.modules.network_drops import DropMessage, Sender
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load

MASTER = """rack: LINE
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  5: {module: 57C404, network: PAPER, drop: 0}
common:
  SPEED%: {}
  REF%: {slot: 5, drop: 3, register: 32}
  LENGTH!: {slot: 5, drop: 3, register: 40}
  FEEDBACK%: {slot: 5, drop: 3, register: 0}
  OK@: {slot: 5, drop: 3, register: 1, bit: 7}
  FOR_ALL%: {slot: 5, drop: 0, register: 32}
  UP3@: {slot: 5, drop: 0, register: 4, bit: 3}
  UP4@: {slot: 5, drop: 0, register: 4, bit: 4}
  TIMEOUTS%: {slot: 5, drop: 0, register: 15}
"""
LINE = """100 COMMON SPEED%, REF%, FOR_ALL%, LENGTH!
110 LENGTH! = -100000
120 CALL SCAN_LOOP(TICKS=1)
130 CALL MOVE(INPUT1=SPEED%, OUTPUT1=REF%, INPUT2=11, OUTPUT2=FOR_ALL%)
140 END
"""
SLAVE = """rack: WIND
slots:
  0: {module: 57C435, tasks: {WIND: {priority: 5}}}
  8: {module: 57C404, network: PAPER, drop: 3, depth: 2}
common:
  REF%: {slot: 8, drop: 3, register: 32}
  LENGTH!: {slot: 8, drop: 3, register: 40}
  FEEDBACK%: {slot: 8, drop: 3, register: 0}
  OK@: {slot: 8, drop: 3, register: 1, bit: 7}
  FOR_ALL%: {slot: 8, drop: 0, register: 32}
  DEPTH%: {slot: 8, drop: 0, register: 20}
  OWN%: {slot: 8, drop: 0, register: 12}
  DROPS%: {slot: 8, drop: 0, register: 4}
  RECEIVED%: {slot: 8, drop: 0, register: 14}
  MISSED%: {slot: 8, drop: 0, register: 17}
"""
WIND = """100 COMMON REF%, FEEDBACK%, OK@, DEPTH%
110 DEPTH% = 2
120 CALL SCAN_LOOP(TICKS=1)
130 CALL MOVE(INPUT1=REF%, OUTPUT1=FEEDBACK%)
140 CALL AND(INPUT1=TRUE, INPUT2=TRUE, OUTPUT=OK@)
150 END
"""


def built(folder: Path, yaml: str, task: str) -> Rack:
    """Return a rack of one task, not started."""
    folder.mkdir(parents=True, exist_ok=True)
    name = yaml.split("tasks: {")[1].split(":", maxsplit=1)[0]
    (folder / f"{name}.BLK").write_text(task)
    path = folder / "rack.yaml"
    path.write_text(yaml)
    loaded = load(path)
    assert not loaded.diagnostics
    assert loaded.config is not None
    return Rack(loaded.config)


def station(rack: Rack) -> NetworkModule:
    """Return the network module of a rack."""
    found = [module for module in rack.modules if isinstance(module, NetworkModule)]
    assert len(found) == 1
    return found[0]


class Cable:
    """Carries the frames of racks to all the others, at once; ``cut`` racks hear and say nothing."""

    def __init__(self, *racks: Rack) -> None:
        self.racks = racks
        self.cut: set[Rack] = set()
        self.senders = {rack: Sender(1000 + number, 5, rack.config.name) for number, rack in enumerate(racks)}
        self.carried: list[tuple[Rack, DropMessage]] = []
        for rack in racks:
            station(rack).connect(self._from(rack))

    def start(self) -> Cable:
        for rack in self.racks:
            rack.start()
        return self

    def cycles(self, count: int) -> None:
        """Let all racks run for cycles of the network, together in steps of 0.5 ms."""
        for _ in range(count * CYCLE_NS // 500_000):
            for rack in self.racks:
                rack.run(0.0005)

    def _from(self, rack: Rack) -> Callable[[int, Sequence[DropMessage]], None]:
        def send(_: int, frames: Sequence[DropMessage]) -> None:
            self.carried += [(rack, frame) for frame in frames]
            for other in self.racks:
                if other is not rack and not {rack, other} & self.cut:
                    station(other).receive([(self.senders[rack], frame) for frame in frames])

        return send
