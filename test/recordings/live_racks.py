"""A small rack whose stream and recordings the tests of this folder look at."""

from __future__ import annotations

from pathlib import Path

from rack.helpers import rack_from

from automax_ros.rack.rack import Rack

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      SPEED: {priority: 4}
  2:
    module: 57C431
    tick_ms: 10
    tasks:
      WORK: {priority: 8}
common:
  REF%: {ros: in, preset: 100}
  SUM%: {}
  SLOW!: {rate_limit_hz: 10}
  GAIN: {ros: in, preset: 1.5}
  TOTAL: {}
  RUN@: {ros: in}
  NOTE$:8: {ros: in, preset: Grüße}
  COPY$:8: {}
  TABLE%(1,2): {ros: in}
  NAMES$:4(1): {}
  SHUT%: {ros: closed}
"""
SPEED = """\
10 COMMON REF%, SUM%, RUN@, TABLE%(1,2)
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], LAST%, NIL%
30 SUM% = 5
100 CALL SCAN_LOOP(TICKS=2)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=SUM%)
120 CALL LAG(INPUT=SUM%, WLG=10.0, RESET=-RUN@, OUTPUT=LAST%)
130 CALL LIMIT(INPUT=TABLE%(0,1), LIMIT_PLUS=1000, LIMIT_MINUS=-1000, OUTPUT=TABLE%(1,1))
140 IF RUN@ THEN LAST% = LAST% / NIL%
150 END
"""
WORK = """\
10 COMMON SLOW!, GAIN, TOTAL, NOTE$:8, COPY$:8, TABLE%(1,2), NAMES$:4(1), SHUT%, SUM%
20 LOCAL I%, J%
100 CALL SCAN_LOOP(TICKS=1)
110 SLOW! = SLOW! + 1
120 TOTAL = TOTAL * 0.5 + GAIN
130 COPY$ = NOTE$
140 NAMES$(1) = LEFT$(NOTE$, 2)
150 FOR I% = 0 TO 2
160 J% = TABLE%(0,I%) + SHUT%
170 TABLE%(1,I%) = J%
180 NEXT I%
190 SHUT% = SUM%
200 END
"""


def build(folder: Path, yaml: str = YAML, **tasks: str) -> Rack:
    """The rack, with some of its texts replaced."""
    return rack_from(folder, yaml, **{"SPEED": SPEED, "WORK": WORK, **tasks})
