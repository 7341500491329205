"""A rack with every kind of thing that stimuli reach, and how the tests read and play a file."""

from pathlib import Path

from rack.helpers import rack_from

from automax_ros.rack.rack import Rack
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import StimuliFile, read_for_rack

RACK = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 1.0, tasks: {SPEED: {priority: 5}, DRAW: {priority: 8}}}
  5: {module: 57C419}
common:
  REF%: {}
  RUN@: {}
  SUM!: {}
  GAIN: {}
  NOTE$:8: {}
  TABLE%(3): {}
  DIAG%(1,2): {}
  KEPT%: {non_volatile: true}
  START_PB@: {slot: 5, register: 0, bit: 3}
  FORCINGSTATUS@: {}
"""
SPEED = """\
10 COMMON REF%, RUN@, SUM!
20 LOCAL KP [CURRENT=1.0, HIGH=10.0, LOW=0.5, STEP=0.1], COUNT% [CURRENT=3, HIGH=9]
30 LOCAL SEEN%, N%, NIL%
100 CALL SCAN_LOOP(TICKS=1)
110 SEEN% = REF%
120 SUM! = SUM! + 1
130 IF RUN@ THEN N% = 1 / NIL%
140 END
"""
DRAW = "10 LOCAL N%\n20 CALL SCAN_LOOP(TICKS=2)\n30 N% = N% + 1\n40 END\n"


def rack_in(folder: Path, rack: str = RACK) -> Rack:
    """A rack of two tasks, built and not started."""
    return rack_from(folder, rack, SPEED=SPEED, DRAW=DRAW)


def read(rack: Rack, folder: Path, text: str) -> StimuliFile:
    path = folder / "stimuli.yaml"
    path.write_text(text, encoding="utf-8")
    return read_for_rack(path, rack)


def playing(rack: Rack, folder: Path, text: str) -> StimuliPlayer:
    """Start the rack with a file that has no errors."""
    file = read(rack, folder, text)
    assert file.stimuli is not None, file.diagnostics
    found = StimuliPlayer(file.stimuli, rack.scheduler)
    rack.start(first=found.begin)
    return found
