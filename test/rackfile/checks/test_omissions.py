"""What `automax check` says of plants and drives that have not found each other, and what `meant_so` takes back."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import config_at, written_in

from automax_ros.rackfile.checks.tasks import check_tasks, forgotten

LOOP = """\
100 COMMON REF%, RUN@, RESET@, SPEED%, VOLTS%
1000 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, REFERENCE=REF%, KP=0.3, &
      PI_W_LEAD=50.0, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, &
      SPEED_FDBK=SPEED%, OSV_FDBK=VOLTS%, FAULT_RESET=RESET@)
1100 END
"""
DRIVE = """\
rack: LINE1
{meant}slots:
  0: {{module: 57C435, tasks: {{LINE: {{priority: 5}}}}}}
  7: {{module: 57C406{plant}}}
  8: {{module: 57C408}}
{plants}common:
  REF%: {{ros: in}}
  RUN@: {{ros: in}}
  RESET@: {{ros: in}}
  SPEED%: {{ros: in}}
  VOLTS%: {{ros: in}}
"""
IDLE = "100 COMMON REF%, RUN@, RESET@, SPEED%, VOLTS%\n1000 CALL SCAN_LOOP(TICKS=4)\n1010 REF% = SPEED%\n1100 END\n"
UDC = """\
rack: LINE1
slots:
  0: {{module: 57C435, tasks: {{LINE: {{priority: 5}}}}}}
  10: {{module: 57552, tasks: {{WIND: {{drive: A}}}}, plants: {{A: WINDER, B: REEL}}}}
plants:
  WINDER: {{motor: dc_150hp_500v}}
  REEL: {{{reel}}}
common:
  CCLK@: {{slot: 10, register: 2000, bit: 6}}
  A_REF%: {{slot: 10, register: 101}}
  B_REF%: {{slot: 10, register: 1101}}
"""
OMISSIONS = ("AMX6224", "AMX6495", "AMX6496", "AMX6497", "AMX6498", "AMX6499")
LINE = "100 CALL SCAN_LOOP(TICKS=4)\n110 END\n"
WIND = "10 COMMON CCLK@, A_REF%, B_REF%\n20 CCLK@ = TRUE\n100 CALL SCAN_LOOP(TICKS=4)\n110 {} = 5\n900 END\n"


def told(folder: Path, yaml: str, **tasks: str) -> list[str]:
    """What is said of the whole rack, and of two writers in its tasks."""
    config = config_at(written_in(folder, yaml, **tasks))
    checked = check_tasks(config)
    assert all(item.result.program is not None for item in checked), [item.result.diagnostics for item in checked]
    found = [*forgotten(config, checked), *(one for item in checked for one in item.result.diagnostics)]
    return [f"{item.code} {item.span.line} {item.message}" for item in found if item.code in OMISSIONS]


def drive(plant: str = "", plants: str = "", meant: str = "") -> str:
    return DRIVE.format(plant=plant, plants=plants, meant=meant)


ROLL = "plants:\n  ROLL: {motor: dc_150hp_500v}\n"


def test_a_plant_that_no_module_names(tmp_path):
    assert told(tmp_path, drive(plants=ROLL), LINE=IDLE) == [
        "AMX6499 7 nothing drives the plant ROLL: no module names it"
    ]


def test_a_plant_whose_module_no_task_works(tmp_path):
    found = told(tmp_path, drive(", plant: ROLL", ROLL), LINE=IDLE)
    assert found == ["AMX6499 7 nothing drives the plant ROLL: no task has a DC_DRIVE_CML for the 57C406 in slot 7"]
    assert told(tmp_path, drive(", plant: ROLL", ROLL), LINE=LOOP) == []


@pytest.mark.parametrize(
    ("writes", "reel", "idle"),
    [
        ("A_REF%", "motor: dc_10hp_240v", ["REEL"]),
        ("B_REF%", "motor: dc_10hp_240v", ["WINDER"]),
        ("A_REF%", "", []),  # only the drive's parameters are known: it is not simulated
        ("B_REF%", "", ["WINDER"]),
    ],
)
def test_a_drive_of_a_udc_whose_commands_nobody_writes(tmp_path, writes, reel, idle):
    found = told(tmp_path, UDC.format(reel=reel), LINE=LINE, WIND=WIND.format(writes))
    plants = [text.split("the plant ")[1].split(":")[0] for text in found if text.startswith("AMX6499")]
    assert plants == idle
    assert all("writes the command registers of drive" in text for text in found if text.startswith("AMX6499"))


def test_a_plant_that_is_coupled_is_turned_by_the_other(tmp_path):
    both = "plants:\n  ROLL: {motor: dc_150hp_500v, couple: {to: HELP, ratio: 1.0}}\n  HELP: {motor: dc_150hp_500v}\n"
    assert told(tmp_path, drive(", plant: ROLL", both), LINE=LOOP) == []


def test_what_turns_by_itself_or_by_its_web_is_not_told(tmp_path):
    """A shaft that is held, and all that webs join to it; a line of which nothing is driven is told whole."""
    line = (
        "plants:\n"
        "  PULL: {{motor: dc_150hp_500v, roller: {{diameter_m: 0.5}}{held}}}\n"
        "  IDLER: {{motor: dc_150hp_500v, roller: {{diameter_m: 0.5}}}}\n"
        "webs:\n  W1: {{from: IDLER, to: PULL, length_m: 4.0, stiffness_n: 2.0e5}}\n"
    )
    held = ", load: {speed_rpm: 90}"
    assert told(tmp_path, drive(plants=line.format(held=held)), LINE=IDLE) == []
    found = told(tmp_path, drive(plants=line.format(held="")), LINE=IDLE)
    assert [text.split(":")[0] for text in found] == [
        "AMX6499 7 nothing drives the plant PULL",
        "AMX6499 8 nothing drives the plant IDLER",
    ]


def test_a_plant_is_meant_so(tmp_path):
    assert told(tmp_path, drive(plants=ROLL, meant="meant_so: [roll]\n"), LINE=IDLE) == []


def test_a_drive_without_a_plant_is_meant_so_by_its_slot(tmp_path):
    assert [text[:9] for text in told(tmp_path, drive(), LINE=LOOP)] == ["AMX6498 4"]
    assert told(tmp_path, drive(meant="meant_so: [7]\n"), LINE=LOOP) == []


RACK = """\
rack: LINE1
{meant}slots:
  0: {{module: 57C413}}
  1: {{module: 57C435, tasks: {{ONE: {{priority: 5}}, TWO: {{priority: 6}}}}}}
common:
  TWICE%: {{}}
  NEVER%: {{}}
  SPARE%: {{}}
  OTHER_SPARE%: {{}}
  TABLE%(10): {{}}
"""
ONE = "10 COMMON TWICE%, NEVER%\n20 LOCAL OWN%\n100 CALL SCAN_LOOP(TICKS=2)\n110 TWICE% = NEVER%\n900 END\n"
TWO = "10 COMMON TWICE%\n20 LOCAL OWN%\n100 CALL SCAN_LOOP(TICKS=2)\n110 TWICE% = OWN%\n900 END\n"


def commons(folder: Path, *meant: str) -> list[str]:
    line = f"meant_so: [{', '.join(meant)}]\n" if meant else ""
    return told(folder, RACK.format(meant=line), ONE=ONE, TWO=TWO)


def test_each_name_takes_back_what_is_said_of_it_and_nothing_else(tmp_path):
    everything = commons(tmp_path)
    assert [text[:7] for text in everything] == ["AMX6496", "AMX6497", "AMX6495"]
    assert "SPARE% (line 8), OTHER_SPARE% (line 9), TABLE% (line 10)" in everything[1]
    assert [text[:7] for text in commons(tmp_path, "TWICE%")] == ["AMX6496", "AMX6497"]
    assert [text[:7] for text in commons(tmp_path, "NEVER%")] == ["AMX6497", "AMX6495"]
    less = commons(tmp_path, "SPARE%", "TABLE%")
    assert [text[:7] for text in less] == ["AMX6496", "AMX6497", "AMX6495"]
    assert "the common OTHER_SPARE% (line 10) is used by no task" in less[1]
    assert commons(tmp_path, "TWICE%", "NEVER%", "SPARE%", "OTHER_SPARE%", "TABLE%") == []


def test_a_name_of_which_nothing_would_be_said_is_told(tmp_path):
    mended = TWO.replace("TWICE% = OWN%", "OWN% = TWICE%")
    yaml = RACK.format(meant="meant_so:\n  - SPARE%\n  - TWICE%\n  - '1'\n")
    found = told(tmp_path, yaml, ONE=ONE, TWO=mended)
    assert [text for text in found if text.startswith("AMX6224")] == [
        "AMX6224 4 meant_so names TWICE%, of which nothing would be said",
        "AMX6224 5 meant_so names 1, of which nothing would be said",
    ]


def test_a_subscript_of_a_target_counts_as_read(tmp_path):
    """PLACE% is read to find the element that is written: without a writer it stays 0, which is told."""
    yaml = (
        "rack: LINE1\nslots:\n  0: {module: 57C435, tasks: {ONE: {priority: 5}}}\ncommon:\n  PLACE%: {}\n  T%(5): {}\n"
    )
    task = "10 COMMON PLACE%, T%(5)\n100 CALL SCAN_LOOP(TICKS=2)\n110 T%(PLACE%) = 3\n900 END\n"
    assert told(tmp_path, yaml, ONE=task) == [
        "AMX6496 5 PLACE% is read in line 110 of ONE.BLK, and no task writes it: it stays 0"
    ]


@pytest.mark.parametrize(
    "meant", ["meant_so: [SPARE%, TWICE%]\n", "meant_so:\n  - TWICE%\n", "meant_so: ['1', twice%]\n"]
)
def test_the_name_itself_is_marked(tmp_path, meant):
    yaml = RACK.format(meant=meant)
    config = config_at(written_in(tmp_path, yaml, ONE=ONE, TWO=TWO.replace("TWICE% = OWN%", "OWN% = TWICE%")))
    found = [item for item in forgotten(config, check_tasks(config)) if "TWICE%" in item.message]
    (span,) = [item.span for item in found if item.code == "AMX6224"]
    assert yaml.split("\n")[span.line - 1][span.column - 1 : span.end_column - 1].upper() == "TWICE%"
