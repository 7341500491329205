"""A rack with a UDC whose drive A has a PMI and a plant, and a speed loop of its own."""

from __future__ import annotations

from pathlib import Path

from automax_ros.drive.plant.plant import RAD_S_PER_RPM, DrivePlant
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from rack.helpers import rack_at, run_for, written_in

YAML = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 5.5, tasks: {IDLE: {priority: 5}}}
  10: {module: 57552, tasks: {WIND_A: {drive: A}}, plants: {A: WINDER}}
plants:
  WINDER: {motor: dc_150hp_500v, motor_overload_ratio: 150, PLANT}
common:
  CCLK@: {slot: 10, register: 2000, bit: 6}
  LINK%: {slot: 10, register: 80}
  COUNT%: {slot: 10, register: 81}
  CONTROL%: {slot: 10, register: 100}
  RUN@: {slot: 10, register: 100, bit: 0}
  COAST@: {slot: 10, register: 100, bit: 2}
  RESET@: {slot: 10, register: 100, bit: 8}
  CLEAR@: {slot: 10, register: 100, bit: 9}
  CREF%: {slot: 10, register: 101}
  ALPHA%: {slot: 10, register: 102}
  STATUS%: {slot: 10, register: 200}
  RUNNING@: {slot: 10, register: 200, bit: 0}
  PERMIT@: {slot: 10, register: 201, bit: 0, ros: in, preset: true}
  IET@: {slot: 10, register: 201, bit: 1, ros: in}
  FAULTS%: {slot: 10, register: 202}
  WARN%: {slot: 10, register: 203}
  SPEED%: {slot: 10, register: 204}
  POS%: {slot: 10, register: 205}
  ARM_C%: {slot: 10, register: 206}
  CURRENT%: {slot: 10, register: 207}
  ARM_V%: {slot: 10, register: 208}
  DELTA%: {slot: 10, register: 209}
  PERIOD%: {slot: 10, register: 212}
  PAIR%: {slot: 10, register: 213}
  BADBITS%: {slot: 10, register: 5, ros: in}
  WANT@: {slot: 10, register: 300, bit: 0, ros: in}
  FRESET@: {slot: 10, register: 300, bit: 1, ros: in}
  SREF%: {slot: 10, register: 302, ros: in}
  OVERLOAD@: {slot: 10, register: 304, bit: 0}
  TACHLOSS@: {slot: 10, register: 304, bit: 1}
  RISE%: {slot: 10, register: 306}
"""
SPEED_LOOP = """\
100 COMMON CCLK@, RUN@, RESET@, CREF%, RUNNING@, SPEED%, ARM_C%, CURRENT%
110 COMMON WANT@, FRESET@, SREF%, OVERLOAD@, TACHLOSS@, RISE%
120 LOCAL BAD_SPEED@, TRIPPED@, RESTING@, ERROR%
130 CCLK@ = TRUE
1000 CALL SCAN_LOOP(TICKS=4)
1100 CALL TACHLOSS_OVERSPEED(SPEED_FDBK=SPEED%, ARM_VOLTAGE_FDBK=ARM_C%, TACH_LOSS=TACHLOSS@, SPEED_FAULT=BAD_SPEED@)
1200 CALL THERMAL_OVERLOAD(I_FDBK=CURRENT%, LIM_BAR=150, OVERLOAD=OVERLOAD@, CALC_RISE=RISE%)
1300 TRIPPED@ = (TRIPPED@ OR BAD_SPEED@ OR OVERLOAD@) AND NOT FRESET@
1400 RUN@ = WANT@ AND NOT TRIPPED@
1500 RESET@ = FRESET@
1600 RESTING@ = NOT RUNNING@
1700 CALL DIFFERENCE(INPUT1=SREF%, INPUT2=SPEED%, OUTPUT=ERROR%)
1800 CALL PROP_INT(INPUT=ERROR%, KP=10.0, WLD=2.0, LIMIT_PLUS=4000, LIMIT_MINUS=-4000, RESET=RESTING@, OUTPUT=CREF%)
9000 END
"""
CURRENT = """\
100 COMMON CCLK@, RUN@, CREF%, WANT@, SREF%, FRESET@, RESET@, CURRENT%, OVERLOAD@, RISE%
130 CCLK@ = TRUE
1000 CALL SCAN_LOOP(TICKS=4)
1200 CALL THERMAL_OVERLOAD(I_FDBK=CURRENT%, LIM_BAR=150, OVERLOAD=OVERLOAD@, CALC_RISE=RISE%)
1400 RUN@ = WANT@
1500 RESET@ = FRESET@
1800 CREF% = SREF%
9000 END
"""
"""Takes SREF% as the current reference."""
IDLE = "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n"


def written(folder: Path, source: str = SPEED_LOOP, *, plant: str = "inertia: 3.0", points: str = "") -> Path:
    """Write the rack with a source of WIND_A."""
    return written_in(folder, YAML.replace("PLANT", plant) + points, IDLE=IDLE, WIND_A=source)


def built(folder: Path, source: str = SPEED_LOOP, *, plant: str = "inertia: 3.0", points: str = "") -> Rack:
    """Return the rack, not started."""
    return rack_at(written(folder, source, plant=plant, points=points))


def started(folder: Path, source: str = SPEED_LOOP, *, plant: str = "inertia: 3.0", reference: int = 2048) -> Rack:
    """Return the rack 0.8 s after its start: locked, started at 0.4 s with a reference."""
    rack = run_for(built(folder, source, plant=plant), 0.4)
    rack.write("WANT@", True)
    rack.run(0.4)
    assert rack.value("RUNNING@")
    rack.write("SREF%", reference)
    return rack


def winder(rack: Rack) -> DrivePlant:
    """Return the plant."""
    return rack.plants["WINDER"]


def rpm(rack: Rack) -> float:
    """Return the speed of the shaft."""
    return winder(rack).motor.speed_rad_s / RAD_S_PER_RPM


def breaks(rack: Rack, verb: str, text: str, plant: str = "WINDER") -> None:
    """Work on a plant."""
    SwitchOperations(rack).plant(plant, verb, text)
