"""A drive on a shaft that is held, for comparing modeled execution with ideal execution."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import NamedTuple

from automax_ros.rack.loader import load
from automax_ros.rack.rack import Rack

COMMONS = (
    "REF%", "RUN@", "RESET@", "STATE@", "I_FDBK%", "DELTA%", "BRIDGE@", "IOC@", "BAD@", "TEST@", "ALPHA%",
)  # fmt: skip
TASK = f"""\
10 COMMON {", ".join(COMMONS)}
100 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, AC_LINE_FREQ=HERTZ, REFERENCE=REF%, REF_LAG=400.0, KP=0.225, &
PI_W_LEAD=61.0, AG_FACTOR=61, CC_THRESH=682, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, CML_TEST=TEST@, &
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
  7: {module: 57C406, plant: MOTOR}
  8: {module: 57C408}
  9: {module: 57C405, drive: 7}
plants:
  MOTOR: {motor: dc_150hp_500v, line: {v_ll: 460, hz: HERTZ, ls_mh: 0.14, rs_mohm: 5}, load: {speed_rpm: RPM}}
common:
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  FAST@: {slot: 7, register: 4146, bit: 0, ros: in}
"""


class Current(NamedTuple):
    """I_FDBK over some scans, counts: its mean, its swing from least to greatest; and the last DELTA, us."""

    mean: float
    swing: int
    delta: int


def held(
    folder: Path,
    model: str,
    *,
    rpm: float,
    hertz: int = 60,
    execution: str = "modeled",
    fast: bool = False,
    alpha: int | None = None,
) -> Rack:
    """Return a rack whose drive runs without a reference, its shaft held at a speed; ``alpha``: in test mode."""
    (folder / "CML.BLK").write_text(TASK.replace("HERTZ", str(hertz)))
    text = YAML.replace("EXECUTION", execution).replace("MODEL", model).replace("HERTZ", str(hertz))
    text = text.replace("RPM", f"{rpm:g}") + "".join(f"  {name}: {{}}\n" for name in COMMONS)
    (folder / "rack.yaml").write_text(text)
    found = load(folder / "rack.yaml")
    assert found.config is not None, found.diagnostics
    rack = Rack(found.config)
    rack.start()
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
