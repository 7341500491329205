"""A rack with webs, and its messages: an unwinder, a press, and a roller that no drive turns, all held at speeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from recordings.live_racks import build

from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack

YAML = """\
rack: LINE1
operator: true
slots:
  0: {module: 57C435, tasks: {SPEED: {priority: 4}}}
  7: {module: 57C406, plant: UNWIND}
  10: {module: 57552, tasks: {WIND: {drive: B}}, plants: {B: PRESS}}
plants:
  UNWIND:
    motor: dc_150hp_500v
    gear: 4.0
    roll: {diameter_m: 1.25, core_m: 0.15, width_m: 2.5, caliper_um: 90, density_kg_m3: 780}
    load: {speed_rpm: 200}
  PRESS: {motor: dc_150hp_500v, gear: 5.0, roller: {diameter_m: 0.5}, load: {speed_rpm: 627}}
  PULL: {motor: dc_10hp_240v, roller: {diameter_m: 0.25}, load: {speed_rpm: 251}}
webs:
  W1: {from: UNWIND, to: PRESS, length_m: 0.5, stiffness_n: 2.0e5, feeds: {TENSION: {signal: tension_n, every_ms: 5}}}
  W2: {from: PRESS, to: PULL, length_m: 0.5, stiffness_n: 1.0e5}
common:
  TENSION: {ros: out}
"""
SPEED = "100 CALL SCAN_LOOP(TICKS=1)\n120 END\n"
WIND = "100 CALL SCAN_LOOP(TICKS=2)\n120 END\n"


def web_rack(folder: Path, text: str = YAML) -> Rack:
    """The rack, its sources in a folder that exists."""
    return build(folder, text, SPEED=SPEED, WIND=WIND)


class Heard:
    """A rack with its stream, and all messages so far by topic and plant of its node."""

    def __init__(self, rack: Rack, epoch_ns: int = 0) -> None:
        self.rack, self.messages = rack, dict[str, list[Any]]()
        self.stream = RackStream(rack, 77)

        def sink(topic: Any) -> Any:
            heard = self.messages.setdefault(f"{topic.name} {topic.plant}".strip(), [])
            return lambda stamp, data: heard.append((stamp, decode(topic.type_name, data)))

        self.takes = self.stream.add_sink(sink)
        self.stream.begin(epoch_ns)
