"""A rack with a drive: a current minor loop task, a task that gives it references, and a BASIC task with registers."""

from __future__ import annotations

from pathlib import Path

from automax_ros.rack.rack import Rack
from rack.helpers import rack_at

YAML = """\
rack: PM1
EXTRA
slots:
  0: {module: 57C435, tasks: {CML: {priority: 4}, SPEED: {priority: 6}, REGS: {priority: 9, file: REGS.BAS}}}
  7: {module: 57C406, plant: UNWIND}
  8: {module: 57C408}
plants:
  UNWIND: {motor: dc_150hp_500v, inertia: 100.0}
common:
  TLD%: {slot: 7, register: 4136}
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  FMCR@: {slot: 8, register: 1, bit: 0}
  START@: {}
  REF%: {}
  SPEED_REF%: {}
  SPEED%: {}
  OSV%: {}
  RUN@: {}
  RESET@: {}
  STATE@: {}
  LOCKED@: {}
  PERIOD%: {}
  CURRENT%: {}
  DELTA%: {}
  TACH@: {}
  DIAG%(37,1): {}
"""
CML = """\
10 COMMON REF%, RUN@, RESET@, SPEED%, OSV%, STATE@, LOCKED@, PERIOD%, CURRENT%, DELTA%, TACH@, DIAG%(37,1)
20 LOCAL SCANS%, NOTE_BRIDGE@
1000 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, REFERENCE=REF%, REF_LAG=400.0, KP=0.2, PI_W_LEAD=50.0, &
 AG_FACTOR=20, CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPEED%, OSV_FDBK=OSV%, &
 OSV_THRESH=5000, FAULT_RESET=RESET@, DC_CML_STATE=STATE@, SYNC_LOCKED=LOCKED@, LINE_PERIOD=PERIOD%, &
 BRIDGE_POL=NOTE_BRIDGE@, I_FDBK=CURRENT%, DELTA=DELTA%, TACH_LOSS_OUT=TACH@, DIAG_DATA=DIAG%)
1010 SCANS% = SCANS% + 1
1030 END
"""
SPEED = """\
10 COMMON REF%, RUN@, START@, SPEED_REF%
20 LOCAL GAIN% [CURRENT=8192, HIGH=32767, LOW=0, STEP=1]
1000 CALL SCAN_LOOP(TICKS=2)
1010 CALL AMPLIFIER(INPUT1=SPEED_REF%, GAIN1=GAIN%, OUTPUT=REF%)
1020 CALL AND(INPUT1=START@, OUTPUT=RUN@)
1030 END
"""
REGS = "10 COMMON TLD%\n20 TLD% = 120\n30 END\n"


def folder_of(folder: Path, *, extra: str = "", cml: str = CML, speed: str = SPEED, yaml: str = YAML) -> Path:
    """Write the rack; return its file."""
    for name, text in (("CML.BLK", cml), ("SPEED.BLK", speed), ("REGS.BAS", REGS)):
        (folder / name).write_text(text)
    path = folder / "rack.yaml"
    path.write_text(yaml.replace("EXTRA\n", extra))
    return path


def rack_of(folder: Path, **changes: str) -> Rack:
    """Return the rack, not started."""
    return rack_at(folder_of(folder, **changes))


def permit(rack: Rack) -> None:
    """Start the rack and give the drive its permissive, with a turning tachometer."""
    rack.start((("PERMIT@", True), ("SPEED%", 1000), ("SPEED_REF%", 3000)))


def running(folder: Path, seconds: float = 0.5, **changes: str) -> Rack:
    """Return a rack whose drive runs since somewhat less than some seconds."""
    rack = rack_of(folder, **changes)
    permit(rack)
    rack.run(0.6)
    rack.write("START@", True)
    rack.run(0.3 + seconds)
    assert rack.value("STATE@") is True
    return rack
