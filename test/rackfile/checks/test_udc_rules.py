"""What must hold among the tasks of a UDC, the rack's other tasks and the UDC's drives."""

from __future__ import annotations

import pytest
from rack.helpers import config_at
from rack.modules.udc_racks import written

from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.loader import load

TASK = "10 COMMON {commons}\n{more}100 CALL SCAN_LOOP(TICKS={ticks})\n{scan}900 END\n"
THERMAL = "200 CALL THERMAL_OVERLOAD(I_FDBK=FB%, OVERLOAD=TRIP@{more})\n"
POINTS = """\
  FB%: {slot: 10, register: 207}
  TRIP@: {slot: 10, register: 300, bit: 0}
  OUT%: {slot: 10, register: 302}
  IN%: {slot: 10, register: 303}
  TWO!: {slot: 10, register: 304}
"""


def task(commons: str = "FB%, TRIP@", scan: str = "", *, ticks: int = 2, lim: str = "", more: str = "") -> str:
    """Return a task of drive A or B that is right but for what a test adds."""
    return TASK.format(commons=commons, more=more, ticks=ticks, scan=THERMAL.format(more=lim) + scan)


def found(folder, points: str = "", *, tasks: str = "WIND_A: {drive: A}", **sources: str) -> list[tuple[str, str]]:
    """Return the names of tasks and the codes of what is wrong with them."""
    path = written(folder, POINTS + points, tasks=tasks, **sources)
    config = config_at(path)
    return [(item.task.name, one.code) for item in check_tasks(config) for one in item.result.diagnostics]


def test_a_udc_task_without_a_fault_passes(tmp_path):
    assert found(tmp_path, WIND_A=task()) == []


@pytest.mark.parametrize(
    ("source", "code"),
    [
        (task(ticks=21), "AMX4085"),
        (task(scan="210 N% = IOREAD%(5, 0)\n", more="20 LOCAL N%\n"), "AMX4027"),
        (task(scan="210 IOWRITE 5, 0, 1\n"), "AMX4027"),
        (task(more="20 EVENT NAME=E1\n"), "AMX4027"),
        (task("FB%, TRIP@, OUT%", "210 CALL PID(INPUT=1)\n"), "AMX4071"),
        (task(scan="210 FB% = 3\n"), "AMX4017"),
    ],
)
def test_a_udc_task_is_checked_as_one(tmp_path, source, code):
    assert found(tmp_path, WIND_A=source)[0] == ("WIND_A", code)


def test_a_common_elsewhere_is_out_of_reach(tmp_path):
    source = task("FB%, TRIP@, REF%, OTHER%", "210 OTHER% = REF%\n")
    points = "  REF%: {}\n  OTHER%: {slot: 11, register: 300}\n"
    path = written(tmp_path, POINTS + points, tasks="WIND_A: {drive: A}", more="}\n  11: {module: 57552", WIND_A=source)
    (checked,) = (item for item in check_tasks(load(path).config) if item.task.name == "WIND_A")
    assert [(item.code, item.message) for item in checked.result.diagnostics] == [
        ("AMX6480", "REF% does not stand in the dual port of udc_10"),
        ("AMX6480", "OTHER% does not stand in the dual port of udc_10"),
    ]
    assert checked.result.program is None


def statements(count: int) -> str:
    return "".join(f"{1000 + number} OUT% = IN% + {number}\n" for number in range(count))


def test_the_estimated_size_is_at_most_20_kbytes(tmp_path):
    """An assignment of a sum of two has 8 bytes for itself and 6 for each of its 4 terms: 32."""
    long = TASK.replace("900 END", "9999 END").format(
        commons="FB%, TRIP@, OUT%, IN%", more="", ticks=2, scan=THERMAL.format(more="") + "{}"
    )
    config = load(written(tmp_path, POINTS, tasks="WIND_A: {drive: A}", WIND_A=long.format(""))).config
    from automax_ros.rackfile.modules.udc import estimated_bytes

    (alone,) = (item for item in check_tasks(config) if item.task.name == "WIND_A")
    fixed = estimated_bytes(alone.result.program)
    most = (20 * 1024 - fixed) // 32
    assert found(tmp_path, WIND_A=long.format(statements(most))) == []
    assert found(tmp_path, WIND_A=long.format(statements(most + 1))) == [("WIND_A", "AMX6481")]


def test_a_and_b_have_the_same_ticks(tmp_path):
    both = "WIND_A: {drive: A}, WIND_B: {drive: B}"
    second = task("FB%, OUT%, IN%").replace("TRIP@", "BTRIP@").replace("COMMON ", "COMMON BTRIP@, ")
    points = "  BTRIP@: {slot: 10, register: 306, bit: 0}\n"
    assert found(tmp_path, points, tasks=both, WIND_A=task(), WIND_B=second) == []
    other = second.replace("TICKS=2", "TICKS=3")
    assert found(tmp_path, points, tasks=both, WIND_A=task(), WIND_B=other) == [("WIND_B", "AMX6482")]


@pytest.mark.parametrize(
    ("neighbour", "written_too", "wrong"),
    [
        ("X@: {slot: 10, register: 300, bit: 5}", False, True),
        ("X@: {slot: 10, register: 301, bit: 0}", False, True),
        ("X%: {slot: 10, register: 301}", False, True),
        ("X@: {slot: 10, register: 302, bit: 0}", False, False),
        ("X@: {slot: 10, register: 301, bit: 0}", True, False),
        ("X%: {slot: 10, register: 301}", True, False),
    ],
)
def test_booleans_go_out_by_pairs_of_registers(tmp_path, neighbour, written_too, wrong):
    name = neighbour.partition(":")[0]
    value = "TRUE" if name == "X@" else "5"
    source = task(f"FB%, TRIP@, {name}", f"210 {name} = {value}\n" if written_too else "")
    points = f"  {neighbour}\n"
    if "register: 302" in neighbour:
        points = points.replace("302", "310")
    assert found(tmp_path, points, WIND_A=source) == ([("WIND_A", "AMX6483")] if wrong else [])


def test_words_may_mix_in_a_pair(tmp_path):
    assert found(tmp_path, WIND_A=task("FB%, TRIP@, OUT%, IN%", "210 OUT% = IN%\n")) == []


@pytest.mark.parametrize(
    ("statement", "wrong"),
    [
        ("OUT% = 1", True),
        ("OUTBIT@ = TRUE", True),
        ("CALL SUMMER(INPUT1=1, INPUT2=2, OUTPUT=OUT%)", True),
        ("IN% = 1", False),
        ("N% = OUT%", False),
    ],
)
def test_a_register_is_an_output_of_the_udc_or_of_a_processor(tmp_path, statement, wrong):
    line = f"10 COMMON OUT%, IN%, OUTBIT@\n20 LOCAL N%\n100 CALL SCAN_LOOP(TICKS=4)\n110 {statement}\n900 END\n"
    points = "  OUTBIT@: {slot: 10, register: 302, bit: 4}\n"
    source = task("FB%, TRIP@, OUT%, IN%", "210 OUT% = IN%\n")
    assert found(tmp_path, points, WIND_A=source, LINE=line) == ([("LINE", "AMX6484")] if wrong else [])


@pytest.mark.parametrize(
    ("ratio", "lim", "wrong"),
    [
        (150, "", False),
        (200, "", True),
        (200, ", LIM_BAR=200", False),
        (150, ", LIM_BAR=200", True),
        (200, ", LIM_BAR=LIM%", False),
        (None, "", False),
        (None, ", LIM_BAR=200", True),
    ],
)
def test_lim_bar_is_the_motor_overload_ratio_of_the_drive(tmp_path, ratio, lim, wrong):
    source = task(lim=lim, more="20 LOCAL LIM%\n")
    path = written(tmp_path, POINTS, tasks="WIND_A: {drive: A}", more=", plants: {A: WINDER}", WIND_A=source)
    text = path.read_text() + "plants:\n  WINDER: {motor: dc_150hp_500v"
    text += "}\n" if ratio is None else f", motor_overload_ratio: {ratio}}}\n"
    path.write_text(text)
    (checked,) = (item for item in check_tasks(load(path).config) if item.task.name == "WIND_A")
    found = [(item.code, item.statement) for item in checked.result.diagnostics]
    assert found == ([("AMX6485", 200)] if wrong else [])


@pytest.mark.parametrize(
    ("tasks", "code"),
    [
        ("WIND_A: {drive: A, priority: 4}", "AMX6007"),
        ("WIND_A: {priority: 4}", "AMX6007"),
        ("WIND_A: {}", "AMX6009"),
        ("WIND_A: {drive: a}", "AMX6470"),
        ("WIND_A: {drive: [A]}", "AMX6008"),
        ("WIND_A: {drive: A}, LINE2: {drive: A, file: LINE.BLK}", "AMX6470"),
        ("WIND_A: {drive: A}, X: {drive: B, file: LINE.BLK}, Y: {drive: B, file: LINE.BLK}", "AMX6303"),
        ("WIND_A: {drive: A, file: WIND_A.BAS}", "AMX6304"),
        ("LINE: {drive: A}", "AMX6301"),
    ],
)
def test_tasks_of_a_udc_have_a_drive_each(tmp_path, tasks, code):
    (tmp_path / "WIND_A.BAS").write_text("10 END\n")
    result = load(written(tmp_path, "", tasks=tasks, WIND_A=task()))
    assert code in [item.code for item in result.diagnostics]
    assert result.config is None


def test_a_processors_task_has_no_drive(tmp_path):
    path = written(tmp_path, "", tasks="WIND_A: {drive: A}", WIND_A=task())
    path.write_text(path.read_text().replace("{priority: 5}", "{priority: 5, drive: A}"))
    assert [item.code for item in load(path).diagnostics] == ["AMX6007"]


@pytest.mark.parametrize("register", [24, 79, 90, 99, 600, 999, 1018, 1079, 1600, 1999, 2003, 2047])
def test_registers_of_the_module_itself_take_no_points(tmp_path, register):
    path = written(tmp_path, f"  X%: {{slot: 10, register: {register}}}\n", tasks="WIND_A: {drive: A}", WIND_A=task())
    assert [item.code for item in load(path).diagnostics] == ["AMX6421"]


@pytest.mark.parametrize(("register", "code"), [(300, None), (1598, None), (599, "AMX6421"), (100, "AMX6422")])
def test_a_real_stands_on_application_registers_alone(tmp_path, register, code):
    path = written(tmp_path, f"  GAIN: {{slot: 10, register: {register}}}\n", tasks="WIND_A: {drive: A}", WIND_A=task())
    assert [item.code for item in load(path).diagnostics] == ([code] if code else [])


WAITING = """\
10 COMMON ISCR%, NTH%
20 EVENT NAME=UDC_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=20
30 NTH% = {n}
100 CALL SCAN_LOOP(TICKS=4, EVENT=UDC_INT)
900 END
"""


@pytest.mark.parametrize(
    ("n", "more", "wrong"),
    [("2", "", False), ("3", "", True), ("3", "40 NTH% = 2\n", False), ("K% + 1", "", False)],
)
def test_an_interrupt_every_n_scans_fits_the_ticks_that_it_starts(tmp_path, n, more, wrong):
    """The UDC scans every 1 ms, LINE counts with 4 x 0.5 ms: N has to be 2."""
    line = WAITING.format(n=n).replace("20 EVENT", "15 LOCAL K%\n20 EVENT").replace("100 CALL", f"{more}100 CALL")
    assert found(tmp_path, WIND_A=task(), LINE=line) == ([("LINE", "AMX6445")] if wrong else [])
