"""A rack of one task that follows a reference, as an integrator with a limit does."""

from pathlib import Path

from rack.helpers import rack_from

from automax_ros.core.ticks import seconds_ns
from automax_ros.rack.rack import Rack
from automax_ros.sweep.measures import read_measures
from automax_ros.sweep.points import read_varied
from automax_ros.sweep.run import Plan, RackTemplate, Stimuli

RACK = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 1.0, tasks: {LOOP: {priority: 5}}}
common:
  REF%: {preset: 1000}
  FDBK%: {}
  ERR%: {}
  NEAR@: {}
  SLOW: {preset: 4.0}
  TABLE%(3): {}
  NOTE$:8: {}
  RUN@: {preset: true}
"""
LOOP = """\
10 COMMON REF%, FDBK%, ERR%, NEAR@, SLOW, RUN@, TABLE%(3)
20 LOCAL KP [CURRENT=1.0, HIGH=2.5, LOW=0.1, STEP=0.1], STEPS% [CURRENT=3, HIGH=9]
30 LOCAL NIL%
100 CALL SCAN_LOOP(TICKS=2)
110 ERR% = REF% - FDBK%
120 FDBK% = FDBK% + KP * ERR% / SLOW
130 NEAR@ = ABS(ERR%) < 100
140 TABLE%(1) = TABLE%(1) + STEPS%
150 IF NOT RUN@ THEN FDBK% = 1 / NIL%
160 IF NOT RUN@ THEN 160
170 END
"""


def rack_in(folder: Path) -> Rack:
    """The rack, built and not started."""
    return rack_from(folder, RACK, LOOP=LOOP)


def plan_of(rack: Rack, varied: list[str], measures: str, seconds: str = "0.2", stimuli: Stimuli | None = None) -> Plan:
    """A plan for runs of a rack."""
    quantities = tuple(read_varied(rack, text).quantity for text in varied)
    found = read_measures(measures, rack.config, seconds_ns(seconds))
    return Plan(RackTemplate.of(rack), quantities, found, seconds_ns(seconds), stimuli)
