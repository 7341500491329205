"""Each drive fault in a rack, from what breaks in the plant to the outputs and the error log of the drive's task."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from automax_ros.rack.operator.faults import Display, DriveTrips, displays_of
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from rack.helpers import rack_at, run_for

FAULTS = {"IOC@": 7110, "SYNC@": 7111, "TACH@": 7112, "OSV@": 7113, "IET@": 7114, "PHROT@": 7115, "BAD@": 7116}
YAML = """\
rack: PM1
slots:
  0: {module: 57C435, tasks: {CML: {priority: 4}, SPEED: {priority: 6}}}
  7: {module: 57C406, plant: UNWIND}
  8: {module: 57C408}
plants:
  UNWIND:
    motor: dc_150hp_500v
    inertia: 2.0
    line: {rotation: CBA}
    feeds: {SPD%: {signal: tach_rpm, scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}}}
common:
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  TRIP@: {slot: 8, register: 0, bit: 1, ros: in}
  FMCR@: {slot: 8, register: 1, bit: 0}
  SPD%: {}
  WANTED%: {}
  REF%: {}
  RUN@: {}
  RESET@: {}
  STATE@: {}
  NUM%: {}
"""
CML = """\
10 COMMON SPD%, REF%, RUN@, RESET@, STATE@, NUM%, IOC@, SYNC@, TACH@, OSV@, IET@, PHROT@, BAD@
1000 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, REFERENCE=REF%, KP=0.2, PI_W_LEAD=50.0, AG_FACTOR=20, &
 CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPD%, OSV_FDBK=SPD%, OSV_THRESH=3600, &
 FAULT_RESET=RESET@, DC_CML_STATE=STATE@, IOC_OUT=IOC@, SYNC_LOSS_OUT=SYNC@, TACH_LOSS_OUT=TACH@, OSV_OUT=OSV@, &
 EXT_IET_OUT=IET@, PHROT_FLT_OUT=PHROT@, BAD_SCR_OUT=BAD@, BAD_SCR_NUM=NUM%)
1010 END
"""
SPEED = """\
10 COMMON WANTED%, SPD%, REF%
20 LOCAL ERROR%
1000 CALL SCAN_LOOP(TICKS=1)
1010 ERROR% = 6*(WANTED% - SPD%)
1020 IF ERROR% > 2500 THEN ERROR% = 2500
1030 IF ERROR% < -2500 THEN ERROR% = -2500
1040 REF% = ERROR%
1050 END
"""


def rack_of(folder: Path, *, yaml: str = YAML, cml: str = CML, execution: str = "ideal") -> Rack:
    """Return the rack, not started."""
    (folder / "CML.BLK").write_text(cml)
    (folder / "SPEED.BLK").write_text(SPEED)
    text = yaml.replace("rack: PM1\n", f"rack: PM1\nexecution: {execution}\n")
    (folder / "rack.yaml").write_text(text + "".join(f"  {name}: {{}}\n" for name in FAULTS))
    return rack_at(folder / "rack.yaml")


def powered(folder: Path, **changes: str) -> Rack:
    """Return a rack that has run for a while; nobody has started its drive."""
    rack = run_for(rack_of(folder, **changes))
    rack.write("PERMIT@", True)
    rack.run(0.6)
    return rack


def turning(folder: Path, counts: int = 2500, **changes: str) -> Rack:
    """Return a rack whose drive keeps a speed."""
    rack = powered(folder, **changes)
    assert start(rack)
    rack.write("WANTED%", counts)
    rack.run(2.0)
    assert abs(rack.value("SPD%") - counts) < 300
    assert active(rack) == set()
    return rack


def start(rack: Rack) -> bool:
    """Give a new edge of CML_RUN; return whether the drive runs then."""
    rack.write("RUN@", False)
    rack.run(0.2)
    rack.write("RUN@", True)
    rack.run(0.5)
    return bool(rack.value("STATE@"))


def reset(rack: Rack) -> bool:
    """Press the reset; return whether all faults are gone."""
    rack.write("RESET@", True)
    rack.run(0.03)
    rack.write("RESET@", False)
    rack.run(0.03)
    return not active(rack)


def active(rack: Rack) -> set[str]:
    return {name for name in FAULTS if rack.value(name)}


def logged(rack: Rack) -> list[int]:
    """The codes in the error log of the drive's task: first, second, last."""
    return [entry.code for entry in rack.task("CML").errors.entries]


def tripped(rack: Rack, *outputs: str) -> bool:
    """Whether these faults are active and logged, gates and contactor off, and a start is refused."""
    told = active(rack) == set(outputs) and logged(rack) == [FAULTS[name] for name in outputs]
    stopped = not rack.value("STATE@") and not rack.value("FMCR@")
    return told and stopped and not start(rack) and logged(rack) == [FAULTS[name] for name in outputs]


def test_a_shorted_scr_trips_and_is_named_at_the_next_start(tmp_path):
    rack = turning(tmp_path)
    controls = SwitchOperations(rack)
    controls.plant("UNWIND", "short_scr", "16")
    rack.run(0.05)
    assert tripped(rack, "IOC@")
    assert reset(rack)
    assert not start(rack)
    assert (active(rack), rack.value("NUM%"), logged(rack)) == ({"BAD@"}, 3, [7110, 7116])
    assert displays_of(rack) == [Display("processor_0", "87", "shorted SCR")]
    controls.plant("UNWIND", "repair", "all")
    assert reset(rack)
    assert start(rack)
    assert (active(rack), rack.value("NUM%")) == (set(), 0)


def test_a_lost_tachometer_stops_a_drive_that_would_run_away(tmp_path):
    rack = turning(tmp_path)
    trips = DriveTrips(rack)
    assert trips.lines() == []
    at_s = rack.now_ns / 1e9
    SwitchOperations(rack).plant("UNWIND", "lose_tach", "true")
    rack.run(0.3)
    assert tripped(rack, "TACH@")
    assert rack.plants["UNWIND"].motor.speed_rad_s < 200.0
    (line,) = trips.lines()
    found = re.fullmatch(r"CML: tach loss at ([0-9.]+) s, not cleared", line)
    assert found
    assert at_s - 0.05 <= float(found[1]) <= at_s + 0.35
    assert DriveTrips(rack).lines() == ["CML: tach loss, not cleared"], "nobody was there to note the time"
    assert reset(rack)
    assert trips.lines() == []


@pytest.mark.parametrize("verb", [("line_hz", "55"), ("lose_phase", "1")])
def test_a_line_that_goes_astray_is_a_sync_loss_until_it_is_back(tmp_path, verb):
    rack = turning(tmp_path)
    SwitchOperations(rack).plant("UNWIND", *verb)
    rack.run(0.5)
    assert "SYNC@" in active(rack)
    assert not rack.value("FMCR@")
    assert not reset(rack) or verb[0] == "line_hz"
    SwitchOperations(rack).plant("UNWIND", "repair", "all")
    rack.run(1.5)
    reset(rack)
    assert active(rack) == set()
    assert start(rack)


def test_a_load_that_drives_the_motor_too_fast_trips_osv(tmp_path):
    rack = turning(tmp_path)
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "-3000")
    rack.run(0.1)
    assert tripped(rack, "OSV@")
    assert not reset(rack)
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "3000")
    while rack.value("SPD%") > 3600:
        rack.run(0.01)
    assert reset(rack)


def test_the_external_trip_input_trips(tmp_path):
    rack = turning(tmp_path)
    rack.write("TRIP@", True)
    rack.run(0.01)
    assert tripped(rack, "IET@")
    assert not reset(rack)
    rack.write("TRIP@", False)
    assert reset(rack)
    assert start(rack)


def test_a_line_of_the_other_rotation_is_refused_or_followed(tmp_path):
    yaml = YAML.replace("CBA", "ABC")
    assert tripped(powered(tmp_path, yaml=yaml), "PHROT@")
    for more in ("NONSTAND_PHROT=TRUE", "AUTO_PHROT=TRUE"):
        rack = powered(tmp_path, yaml=yaml, cml=CML.replace("DC_CML_STATE=", f"{more}, DC_CML_STATE="))
        assert start(rack)
        rack.write("WANTED%", 1000)
        rack.run(1.0)
        assert (abs(rack.value("SPD%") - 1000) < 300, active(rack)) == (True, set())
