"""TACHLOSS_OVERSPEED and THERMAL_OVERLOAD when a task is checked (sections 35 and 36)."""

from __future__ import annotations

import pytest

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Diagnostic, Severity
from language.check_support import check_text, problems, task

DECLARE = "LOCAL A%, B%, D!, R, X@, Y@, T%(3)\n11 COMMON FB%, SPEED%, VOLTS%, OVR@, FAULT@, FBS%(3), OVRS@(3)"
THERMAL = "CALL THERMAL_OVERLOAD(I_FDBK=FB%, OVERLOAD=OVR@)"
TACH = "CALL TACHLOSS_OVERSPEED(SPEED_FDBK=SPEED%, ARM_VOLTAGE_FDBK=VOLTS%, SPEED_FAULT=FAULT@)"


def found_in(*lines: str, target: Platform = Platform.UDC) -> list[tuple[str, int | None, str]]:
    """Code, BASIC line and marked text of each problem."""
    text = task(*lines, declare=DECLARE)
    tick_ns = 500_000 if target is Platform.UDC else 5_500_000
    return [(item.code, item.statement, marked(text, item)) for item in problems(text, target=target, tick_ns=tick_ns)]


def marked(text: str, found: Diagnostic) -> str:
    """What the diagnostic points at."""
    return text.splitlines()[found.span.line - 1][found.span.column - 1 : found.span.end_column - 1]


def thermal(more: str) -> str:
    return THERMAL.replace(")", f", {more})")


@pytest.mark.parametrize(
    "lines",
    [
        (THERMAL,),
        (THERMAL, TACH),
        (thermal("LIM_BAR=150, THRESHOLD=114, TRIP_TIME=60, RESET=X@, CALC_RISE=A%"),),
        (thermal("LIM_BAR=115, THRESHOLD=114, TRIP_TIME=10"),),
        (thermal("LIM_BAR=400, THRESHOLD=124, TRIP_TIME=120"),),
        (thermal("LIM_BAR=115, THRESHOLD=110"),),
        (thermal("LIM_BAR=125, THRESHOLD=124"),),
        (thermal("LIM_BAR=A%, THRESHOLD=B%, TRIP_TIME=T%(1)"),),
        (thermal("LIM_BAR=A%, THRESHOLD=124"),),
        (THERMAL.replace("FB%", "FBS%(2)").replace("OVR@", "OVRS@(2)"),),
        (THERMAL, TACH.replace(")", ", OVERSPEED_LIM=4505, TL_SPD_LLIM=205, AV_SPD_LLIM=1638)")),
        (THERMAL, TACH.replace(")", ", TL_VFB_LLIM=1200, ARM_VFB_LLIM=A%, OVERSPEED=X@)")),
        (THERMAL, TACH.replace(")", ", TACH_LOSS=X@, ARM_VFB_LOSS=Y@)")),
        ("IF X@ THEN", THERMAL, "END_IF"),
    ],
)
def test_right_udc_tasks(lines: tuple[str, ...]) -> None:
    assert found_in(*lines) == []


@pytest.mark.parametrize("target", [Platform.AUTOMAX, Platform.PC3000])
@pytest.mark.parametrize(("text", "name"), [(THERMAL, "THERMAL_OVERLOAD"), (TACH, "TACHLOSS_OVERSPEED")])
def test_both_run_on_a_udc_only(text: str, name: str, target: Platform) -> None:
    assert found_in("A% = 1", text, target=target) == [("AMX4071", 40, name)]


def test_a_udc_task_without_thermal_overload_gets_a_warning() -> None:
    assert found_in(TACH) == [("AMX4097", 20, "CALL SCAN_LOOP(TICKS=4)")]
    text = task(TACH, declare=DECLARE)
    result = check_text(text, target=Platform.UDC, tick_ns=500_000)
    assert [item.severity for item in result.diagnostics] == [Severity.WARNING]
    assert result.program is not None


@pytest.mark.parametrize("target", [Platform.AUTOMAX, Platform.PC3000])
def test_other_tasks_need_none(target: Platform) -> None:
    assert found_in("A% = 1", target=target) == []


@pytest.mark.parametrize(
    ("text", "marked_text"),
    [
        (THERMAL.replace("FB%", "A%"), "A%"),
        (THERMAL.replace("FB%", "T%(2)"), "T%(2)"),
        (THERMAL.replace("OVR@", "X@"), "X@"),
    ],
)
def test_a_current_or_overload_that_is_not_common_gives_a_warning(text: str, marked_text: str) -> None:
    assert found_in(text) == [("AMX4096", 30, marked_text)]
    result = check_text(task(text, declare=DECLARE), target=Platform.UDC, tick_ns=500_000)
    assert result.diagnostics[0].severity is Severity.WARNING
    assert result.program is not None


def test_both_not_common_are_two_warnings() -> None:
    text = "CALL THERMAL_OVERLOAD(I_FDBK=A%, OVERLOAD=X@)"
    assert found_in(text) == [("AMX4096", 30, "A%"), ("AMX4096", 30, "X@")]


@pytest.mark.parametrize(
    ("more", "value"),
    [
        ("LIM_BAR=114, THRESHOLD=110", "114"),
        ("LIM_BAR=401", "401"),
        ("LIM_BAR=-200, THRESHOLD=110", "-200"),
        ("THRESHOLD=109", "109"),
        ("THRESHOLD=125", "125"),
        ("TRIP_TIME=9", "9"),
        ("TRIP_TIME=0", "0"),
        ("TRIP_TIME=121", "121"),
        ("TRIP_TIME=32767", "32767"),
    ],
)
def test_a_constant_out_of_range_is_a_warning_since_it_is_limited_at_run_time(more: str, value: str) -> None:
    assert found_in(thermal(more)) == [("AMX4098", 30, value)]
    result = check_text(task(thermal(more), declare=DECLARE), target=Platform.UDC, tick_ns=500_000)
    assert result.diagnostics[0].severity is Severity.WARNING
    assert result.program is not None


@pytest.mark.parametrize("pair", [(115, 115), (120, 124), (124, 124)])
def test_a_lim_bar_not_above_threshold_is_a_warning(pair: tuple[int, int]) -> None:
    found = found_in(thermal(f"LIM_BAR={pair[0]}, THRESHOLD={pair[1]}"))
    assert [item[:2] for item in found] == [("AMX4098", 30)]
    assert found[0][2] in map(str, pair)


def test_a_lim_bar_not_above_the_threshold_in_force_is_a_warning_too() -> None:
    """Limited to 115 it lies below a THRESHOLD of 120: section 36 logs both; at least one is said."""
    assert {item[0] for item in found_in(thermal("LIM_BAR=100, THRESHOLD=120"))} == {"AMX4098"}


@pytest.mark.parametrize(
    ("text", "code", "value"),
    [
        (thermal("LIM_BAR=40000"), "AMX2007", "40000"),
        (thermal("LIM_BAR=150.0"), "AMX2015", "150.0"),
        (thermal("LIM_BAR=R"), "AMX2015", "R"),
        (thermal("TRIP_TIME=D!"), "AMX2015", "D!"),
        (thermal("TRIP_TIME=A% + 1"), "AMX4077", "A% + 1"),
        (thermal("RESET=A%"), "AMX2015", "A%"),
        (thermal("CALC_RISE=D!"), "AMX2015", "D!"),
        (thermal("CALC_RISE=5"), "AMX4078", "5"),
        (THERMAL.replace("FB%", "R"), "AMX2015", "R"),
        (THERMAL.replace("FB%", "MISSING%"), "AMX4001", "MISSING%"),
        (THERMAL.replace("OVR@", "TRUE"), "AMX4078", "TRUE"),
        (THERMAL.replace("OVR@", "-OVR@"), "AMX4079", "-OVR@"),
        (THERMAL.replace("I_FDBK=FB%, ", ""), "AMX4074", None),
        (THERMAL.replace(", OVERLOAD=OVR@", ""), "AMX4074", None),
        (thermal("WLG=1.0"), "AMX4072", None),
    ],
)
def test_each_fault_of_thermal_overload_is_one_error(text: str, code: str, value: str | None) -> None:
    found = found_in(text)
    assert [item[:2] for item in found] == [(code, 30)]
    assert value is None or found[0][2] == value


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (TACH.replace("SPEED_FDBK=SPEED%, ", ""), "AMX4074"),
        (TACH.replace("ARM_VOLTAGE_FDBK=VOLTS%, ", ""), "AMX4074"),
        (TACH.replace(", SPEED_FAULT=FAULT@", ""), "AMX4074"),
        (TACH.replace("FAULT@", "A%"), "AMX2015"),
        (TACH.replace("FAULT@", "-FAULT@"), "AMX4079"),
        (TACH.replace("SPEED%", "R"), "AMX2015"),
        (TACH.replace(")", ", OVERSPEED_LIM=40000)"), "AMX2007"),
        (TACH.replace(")", ", TL_SPD_LIM=205)"), "AMX4072"),
    ],
)
def test_each_fault_of_tachloss_overspeed_is_one_error(text: str, code: str) -> None:
    assert [item[:2] for item in found_in(THERMAL, text)] == [(code, 40)]
