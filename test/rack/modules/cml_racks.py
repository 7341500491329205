"""A rack with a CML task, its 57C406, 57C408 and 57C405, a plant and another task."""

from __future__ import annotations

from pathlib import Path

from automax_ros.rack.rack import Rack
from rack.helpers import rack_at

COMMONS = (
    "REF%", "RUN@", "RESET@", "STATE@", "LOCKED@", "PERIOD%", "I_FDBK%", "DELTA%", "BRIDGE@", "POSA@", "POSB@",
    "RESET_SW@", "IOC@", "IET@", "SYNC@", "TACH@", "SPEED%",
)  # fmt: skip
CML = f"""\
10 COMMON {", ".join(COMMONS)}
100 CALL DC_DRIVE_CML(IO_CNTL_SLOT=SLOT, DIG_IO_SLOT=8, REFERENCE=REF%, REF_LAG=400.0, KP=0.2, &
PI_W_LEAD=50.0, AG_FACTOR=20, CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPEED%, &
FAULT_RESET=RESET@, DC_CML_STATE=STATE@, SYNC_LOCKED=LOCKED@, LINE_PERIOD=PERIOD%, INSWITCH_POSA=POSA@, &
INSWITCH_POSB=POSB@, INFAULT_RESET=RESET_SW@, BRIDGE_POL=BRIDGE@, I_FDBK=I_FDBK%, DELTA=DELTA%, IOC_OUT=IOC@, &
SYNC_LOSS_OUT=SYNC@, TACH_LOSS_OUT=TACH@, EXT_IET_OUT=IET@)
110 END
"""
YAML = """\
rack: PM1
execution: EXECUTION
slots:
  SLOTS
  8: {module: 57C408}
  9: {module: ANALOG}
plants:
  UNWIND: {motor: dc_150hp_500v, inertia: 3.0}
common:
  TLD%: {slot: DRIVE, register: 4136}
  PHASE%: {slot: DRIVE, register: 4137}
  STEP%: {slot: DRIVE, register: 4138}
  FAST@: {slot: DRIVE, register: 4146, bit: 0}
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  TRIP@: {slot: 8, register: 0, bit: 1, ros: in}
  FMCR@: {slot: 8, register: 1, bit: 0}
  OK@: {slot: 8, register: 1, bit: 2}
"""
ALONE = "0: {module: 57C435, tasks: {CML: {priority: 5}, WORK: {priority: 8}}}\n  7: {module: 57C406, plant: UNWIND}"
NEAR = """\
0: {module: 57C413}
  2: {module: 57C406, plant: UNWIND}
  3: {module: 57C435, tasks: {CML: {priority: 5}, WORK: {priority: 8}}}"""
WORK = "10 COMMON PERMIT@\n100 CALL SCAN_LOOP(TICKS=1)\n110 END\n"


def built(
    folder: Path,
    *,
    slots: str = ALONE,
    drive: int = 7,
    execution: str = "ideal",
    work: str = WORK,
    analog: str = "57C405, drive: DRIVE",
) -> Rack:
    """Return a rack that was not started; ``drive`` is the slot of its 57C406."""
    (folder / "CML.BLK").write_text(CML.replace("SLOT=SLOT", f"SLOT={drive}"))
    (folder / "WORK.BLK").write_text(work)
    commons = "".join(f"  {name}: {{}}\n" for name in COMMONS)
    text = (
        YAML.replace("SLOTS", slots)
        .replace("ANALOG", analog)
        .replace("EXECUTION", execution)
        .replace("DRIVE", str(drive))
        + commons
    )
    (folder / "rack.yaml").write_text(text)
    return rack_at(folder / "rack.yaml")


def started(folder: Path, **options: object) -> Rack:
    """Return a rack whose drive carries 55 % of its rated current."""
    rack = built(folder, **options)  # type: ignore[arg-type]
    rack.start()
    rack.write("PERMIT@", True)
    rack.write("SPEED%", 2000)
    rack.run(0.6)
    rack.write("RUN@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is True
    rack.write("REF%", 1500)
    rack.run(0.5)
    return rack
