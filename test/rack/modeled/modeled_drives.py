"""A drive on a shaft that is held, for comparing modeled execution with ideal execution."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import NamedTuple

from automax_ros.drive.assess.assessment import assess
from automax_ros.drive.assess.drive_case import DriveCase
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.drives import drive_cases
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig
from rack.helpers import config_at, run_for

MOTORS = ("dc_10hp_240v", "dc_150hp_500v", "dc_800hp_700v")
GAINS = {"KP": "KP=0.2", "PI_W_LEAD": "PI_W_LEAD=60.0", "AG_FACTOR": "AG_FACTOR=40", "CC_THRESH": "CC_THRESH=700"}
"""What stands in the task for each gain until ``drive-check`` has proposed one."""
COMMONS = (
    "REF%", "RUN@", "RESET@", "STATE@", "I_FDBK%", "DELTA%", "BRIDGE@", "IOC@", "BAD@", "TEST@", "ALPHA%",
)  # fmt: skip
TASK = f"""\
10 COMMON {", ".join(COMMONS)}
100 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, AC_LINE_FREQ=HERTZ, REFERENCE=REF%, REF_LAG=400.0, &
{", ".join(GAINS.values())}, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, CML_TEST=TEST@, &
TEST_ALPHA=ALPHA%, FAULT_RESET=RESET@, DC_CML_STATE=STATE@, BRIDGE_POL=BRIDGE@, I_FDBK=I_FDBK%, DELTA=DELTA%, &
IOC_OUT=IOC@, BAD_SCR_OUT=BAD@)
110 END
"""
YAML = """\
rack: PM1
execution: EXECUTION
slots:
  0: {module: 57C413}
  1: {module: MODEL, tasks: {CML: {priority: 4}}}
  2: {module: 57C435, tasks: {OTHERS}}
  7: {module: 57C406, plant: MOTOR}
  8: {module: 57C408}
  9: {module: 57C405, drive: 7}
plants:
  MOTOR: {motor: MOTOR_NAME, line: {hz: HERTZ}, load: {speed_rpm: RPM}}
common:
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  FAST@: {slot: 7, register: 4146, bit: 0, ros: in}
  TLD%: {slot: 7, register: 4136}
"""


class Current(NamedTuple):
    """I_FDBK over some scans, counts: its mean, its swing from least to greatest; and the last DELTA, us."""

    mean: float
    swing: int
    delta: int


def config_of(file: Path) -> RackConfig:
    """Return a rack file that is sound."""
    return config_at(file)


def case_of(file: Path) -> DriveCase:
    """Return the one drive of a rack as ``drive-check`` judges it."""
    config = config_of(file)
    programs = [item.result.program for item in check_tasks(config) if item.result.program is not None]
    (case,) = drive_cases(config, programs, {})
    assert isinstance(case, DriveCase)
    return case


def proposals(file: Path) -> dict[str, float]:
    """Return what ``drive-check`` proposes for the gains of the one drive of a rack."""
    found = {item.rule: item.values for item in assess(case_of(file)).findings}
    return {keyword: float(found[keyword]["proposed"] or 0) for keyword in GAINS}


def held(
    folder: Path,
    model: str,
    *,
    rpm: float,
    motor: str = "dc_150hp_500v",
    hertz: int = 60,
    execution: str = "modeled",
    fast: bool = False,
    alpha: int | None = None,
    latched: int = 0,
    others: str = "",
) -> Rack:
    """Return a rack whose drive runs without a reference, its shaft held at a speed; ``alpha``: in test mode.

    It has the gains that ``drive-check`` proposes for it. ``latched``: how many commons more its task latches, which
    lets its scans compute longer. ``others`` are tasks of another Processor.
    """
    more = [f"X{number}%" for number in range(latched)]
    text = YAML.replace("EXECUTION", execution).replace("MODEL", model).replace("HERTZ", str(hertz))
    text = text.replace("MOTOR_NAME", motor).replace("RPM", f"{rpm:g}").replace("OTHERS", others)
    (folder / "rack.yaml").write_text(text + "".join(f"  {name}: {{}}\n" for name in (*COMMONS, *more)))
    declared = "".join(f"{20 + place} COMMON {', '.join(more[place : place + 9])}\n" for place in range(0, latched, 9))
    source = TASK.replace("HERTZ", str(hertz)).replace("100 CALL", f"{declared}100 CALL")
    (folder / "CML.BLK").write_text(source)
    for keyword, proposed in proposals(folder / "rack.yaml").items():
        shown = f"{proposed:.10g}" if keyword in ("AG_FACTOR", "CC_THRESH") else f"{proposed:.4f}"
        source = source.replace(GAINS[keyword], f"{keyword}={shown}")
    (folder / "CML.BLK").write_text(source)
    rack = run_for(Rack(config_of(folder / "rack.yaml")))
    rack.write("PERMIT@", True)
    rack.run(0.6)
    rack.write("FAST@", fast)
    if alpha is not None:
        rack.write("TEST@", True)
        rack.write("ALPHA%", alpha)
        rack.run(0.1)
    rack.write("RUN@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is True
    return rack


def follow(rack: Rack, reference: int, *, hertz: int = 60, settle_s: float = 0.3) -> Current:
    """Give a reference and return the current of 60 scans after it had time to settle."""
    rack.write("REF%", reference)
    rack.run(settle_s)
    seen = []
    for _ in range(60):
        rack.run(1 / (6 * hertz))
        seen.append(int(rack.value("I_FDBK%")))
    return Current(fmean(seen), max(seen) - min(seen), int(rack.value("DELTA%")))
