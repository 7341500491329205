"""A drive whose scans take the time of their Processor: it fires and regulates as in ideal execution (52.0)."""

from __future__ import annotations

from itertools import pairwise, product

import pytest

from automax_ros.drive.current_loop.signals import LATE_BIT, LATEST_US, OVERCURRENT, Command, late_us
from automax_ros.drive.plant.controller import DriveController
from rack.modeled.modeled_drives import MOTORS, case_of, follow, held

MODELS = ("57C430A", "57C431", "57C435")
BASE_RPM = {"dc_10hp_240v": 1750, "dc_150hp_500v": 1750, "dc_800hp_700v": 1150}
SPEEDS_RPM = (0, 930, 1750, -1000)
REFERENCES = (205, 1200, 4095, -205, -4095)
"""From 5 to 100 % of LIM_BAR, both bridges."""
STEPS = (205, 4095, 800, -4095, -300, 2730, -200, 4095, -4095, 700)
"""Load steps and reversals, each from the one before."""


def assert_alike(folder, model, rpm, hertz, references, motor="dc_150hp_500v", latched=0):
    given = {"rpm": rpm, "hertz": hertz, "motor": motor, "latched": latched}
    ideal = held(folder, model, **given, execution="ideal")
    modeled = held(folder, model, **given)
    for reference in references:
        # From no current, as the manual has it for a start; the other bridge of the step before is off by then.
        for rack in (ideal, modeled):
            follow(rack, 0, hertz=hertz)
        want, got = (follow(rack, reference, hertz=hertz) for rack in (ideal, modeled))
        assert modeled.value("IOC@") is False
        assert got.mean == pytest.approx(want.mean, rel=0.03)
        assert got.mean == pytest.approx(reference, abs=max(12, 0.03 * abs(reference)))
        assert got.swing <= max(15, 0.02 * abs(reference)), (reference, got)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rpm", SPEEDS_RPM)
def test_the_steady_current_is_that_of_ideal_execution(tmp_path, model, rpm):
    assert_alike(tmp_path, model, rpm, 60, REFERENCES)


@pytest.mark.parametrize("rpm", [0, 1300])
def test_the_steady_current_is_that_of_ideal_execution_at_50_hz(tmp_path, rpm):
    assert_alike(tmp_path, "57C430A", rpm, 50, REFERENCES)


@pytest.mark.parametrize("part", [0, 0.4, -1])
@pytest.mark.parametrize("motor", ["dc_10hp_240v", "dc_800hp_700v"])
def test_the_steady_current_of_other_motors_is_that_of_ideal_execution(tmp_path, motor, part):
    assert_alike(tmp_path, "57C431", part * BASE_RPM[motor], 60, REFERENCES, motor)


@pytest.mark.parametrize(
    ("latched", "rpm", "reference"),
    [(50, 1750, 3200), (50, 400, -4095), (80, 1750, 800), (80, 1750, 3200), (80, 400, -2457), (80, 0, 4095)],
)
def test_a_scan_that_computes_for_up_to_0_7_of_a_sixth_lets_the_current_stand(tmp_path, latched, rpm, reference):
    """Where an SCR is fired just before the command comes DELTA swung from scan to scan by hundreds of us."""
    assert_alike(tmp_path, "57C431", rpm, 60, [reference], latched=latched)


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("motor", "model", "hertz"), list(product(MOTORS, MODELS, (50, 60))))
def test_the_steady_current_is_that_of_ideal_execution_at_every_speed_and_load(tmp_path, motor, model, hertz):
    references = [round(sign * 40.95 * percent) for percent in (5, 8, 12, 20, 35, 60, 80, 100) for sign in (1, -1)]
    for seventh in range(-7, 8):
        rpm = seventh / 7 * BASE_RPM[motor]
        assert_alike(tmp_path, model, rpm, hertz, references, motor, latched=80 if seventh % 2 else 0)


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("rpm", [0, 600, -1000])
@pytest.mark.parametrize("model", ["57C430A", "57C435"])
def test_steps_and_reversals_neither_trip_nor_swing(tmp_path, model, rpm, fast):
    """IOC_THRESH is 250 %, 1.67 times LIM_BAR: also the peaks of the ripple stay below it."""
    rack = held(tmp_path, model, rpm=rpm, fast=fast)
    for reference in STEPS:
        got = follow(rack, reference)
        assert rack.value("STATE@") is True, (reference, rack.value("IOC@"))
        assert got.mean == pytest.approx(reference, abs=max(12, 0.03 * abs(reference)))
        assert got.swing <= max(15, 0.02 * abs(reference))


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("motor", "model", "hertz", "fast"), list(product(MOTORS, MODELS, (50, 60), (False, True))))
def test_steps_and_reversals_neither_trip_nor_swing_at_any_speed(tmp_path, motor, model, hertz, fast):
    for seventh in range(-7, 8):
        rpm = seventh / 7 * BASE_RPM[motor]
        rack = held(tmp_path, model, rpm=rpm, hertz=hertz, fast=fast, motor=motor)
        for reference in STEPS:
            got = follow(rack, reference, hertz=hertz)
            assert rack.value("STATE@") is True, (rpm, reference)
            assert got.mean == pytest.approx(reference, abs=max(12, 0.03 * abs(reference)))
            assert got.swing <= max(15, 0.02 * abs(reference)), (rpm, reference)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("alpha", [175, 120, 100, 90, 69, 65, 61])
def test_a_test_alpha_fires_as_in_ideal_execution(tmp_path, model, alpha):
    """52.1.4: TEST_ALPHA is the firing angle; DELTA% is 180 degrees less it, in us."""
    rpm = 0 if alpha >= 85 else 1000
    ideal = held(tmp_path, model, rpm=rpm, execution="ideal", alpha=alpha)
    modeled = held(tmp_path, model, rpm=rpm, alpha=alpha)
    want, got = follow(ideal, 0), follow(modeled, 0)
    assert got.mean == pytest.approx(want.mean, abs=1)
    assert got.swing <= 1
    assert got.delta == pytest.approx((180 - alpha) / 360 * 1e6 / 60, abs=1)


@pytest.mark.parametrize("model", MODELS)
def test_gates_are_fired_at_delta_whatever_the_scan_takes(tmp_path, model):
    """Each pair is fired once per cycle, a sixth after the one before, to 1 us."""
    rack = held(tmp_path, model, rpm=1000, alpha=65)
    fired = []
    bridge = rack.plants["MOTOR"].bridge
    rack.run(0.1)
    before = list(bridge.on_ns)
    for _ in range(600):
        rack.run(0.0001)
        fired += [now for old, now in zip(before, bridge.on_ns, strict=True) if now != old]
        before = list(bridge.on_ns)
    fired = sorted(set(fired))
    assert len(fired) == pytest.approx(0.06 * 360, abs=1)
    assert [late - early for early, late in pairwise(fired)] == pytest.approx([2_777_778] * (len(fired) - 1), abs=1000)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("latched", [0, 80])
def test_the_delay_that_drive_check_tells_is_that_of_the_rack(tmp_path, model, latched):
    rack = held(tmp_path, model, rpm=0, latched=latched)
    told = case_of(tmp_path / "rack.yaml").computing
    assert told is not None
    assert late_us(rack.drives.port(7).measure(8).status) == pytest.approx(told.delay_us, abs=1)


def test_how_late_a_command_came_stays_a_number_that_a_record_keeps():
    controller = DriveController(None)
    for late_ns, told in ((0, 0), (1_900_000, 1900), (10**12, LATEST_US)):
        controller.command(Command(2_777_778), 5, 5 + late_ns)
        assert controller.late_us == told
        assert late_us(told << LATE_BIT | OVERCURRENT) == told
        assert told << LATE_BIT < 1 << 31
