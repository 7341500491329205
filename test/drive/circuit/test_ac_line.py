"""The line: frequency, voltage and angle while they move; rotation; what it refuses."""

from math import cos, exp, pi, sqrt

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.circuit.ac_line import AcLine, Rotation

SECOND = 1_000_000_000


def pass_time(line, until_ns):
    """Go from segment to segment, looking at the line as each begins."""
    seen = []
    while line.next_change_ns < until_ns:
        line.advance(line.next_change_ns)
        seen.append((line.start_ns, line.frequency_hz, line.v_ll_v))
    line.advance(until_ns)
    return seen


def turns(line, time_ns):
    return line.angle(time_ns) / (2 * pi) % 1


def test_phase_voltages():
    line = AcLine(460.0, 50.0)
    peak = sqrt(2 / 3) * 460
    assert [line.phase_voltage(phase, 0) for phase in range(3)] == pytest.approx([peak, -peak / 2, -peak / 2])
    assert line.phase_voltage(1, round(SECOND / 150)) == pytest.approx(peak, rel=1e-9)
    mean_square = sum((line.phase_voltage(0, n * 20_000) - line.phase_voltage(1, n * 20_000)) ** 2 for n in range(1000))
    assert sqrt(mean_square / 1000) == pytest.approx(460)


def test_rotation():
    line = AcLine(460.0, 50.0, rotation=Rotation.CBA)
    assert line.phase_voltage(2, round(SECOND / 150)) == pytest.approx(sqrt(2 / 3) * 460, rel=1e-9)


def test_angle_keeps_its_digits_for_days():
    line = AcLine(460.0, 60.0)
    for day in range(1, 4):
        pass_time(line, day * 86_400 * SECOND)
    assert turns(line, 3 * 86_400 * SECOND + SECOND // 240) == pytest.approx(0.25, abs=1e-7)


def test_frequency_step_keeps_the_angle():
    line = AcLine(460.0, 60.0)
    line.step_frequency(SECOND // 8, 50.0)
    pass_time(line, SECOND)
    assert line.frequency_hz == 50.0
    assert turns(line, SECOND) == pytest.approx((60 / 8 + 50 * 7 / 8) % 1, abs=1e-9)


def test_drift_ends_at_its_target_and_counts_every_turn():
    line = AcLine(460.0, 62.0)
    line.drift_frequency(SECOND, 48.0, 7.0)
    seen = pass_time(line, 5 * SECOND)
    assert line.frequency_hz == 48.0
    at_half = next(hertz for time, hertz, _ in seen if time >= 2 * SECOND)
    assert at_half == pytest.approx(55.0, abs=0.01)
    assert abs(turns(line, 5 * SECOND) - 0.5) == pytest.approx(0.5, abs=1e-9)  # 62 + 2 x 55 + 2 x 48: whole turns


def test_angle_within_a_segment_is_off_by_what_is_told():
    rate, segment_s = 28.0, 0.5e-3
    line = AcLine(460.0, 62.0)
    line.drift_frequency(0, 48.0, rate)
    line.advance(0)
    worst = 0.0
    for _ in range(50):
        for part in range(10):
            t = (line.start_ns + part * 50_000) * 1e-9
            true = 2 * pi * (line.frequency_hz * part * 50e-6 - rate * (part * 50e-6) ** 2 / 2)
            worst = max(worst, abs(line.angle(t * 1e9) - line.start_angle - true))
        line.advance(line.next_change_ns)
    assert worst <= pi * rate * segment_s**2 / 4 * 1.01
    assert worst > 0.5 * pi * rate * segment_s**2 / 4


def test_voltage_settles_with_its_time_constant():
    line = AcLine(460.0, 60.0)
    line.settle_voltage(SECOND, 368.0, 0.05)
    seen = pass_time(line, 2 * SECOND)
    volts = next(volts for time, _, volts in seen if time >= SECOND + 50_000_000)
    assert volts == pytest.approx(368 + 92 * exp(-1), rel=1e-3)
    assert line.v_ll_v == pytest.approx(368.0)


def test_generator_transient_sags_and_recovers():
    line = AcLine(460.0, 60.0)
    line.generator_transient(SECOND, 0.15, 1.5, 0.05, 0.4)
    seen = pass_time(line, 8 * SECOND)
    assert min(volts for _, _, volts in seen) == pytest.approx(460 * (1 - 0.15 * (1 - exp(-3))), rel=1e-3)
    assert min(hertz for _, hertz, _ in seen) == pytest.approx(60 - 1.5 * (1 - exp(-3)), rel=1e-4)
    assert (line.v_ll_v, line.frequency_hz) == (pytest.approx(460, rel=1e-5), pytest.approx(60, rel=1e-5))


def test_phases_come_and_go():
    line = AcLine(460.0, missing=[1])
    line.lose_phase(SECOND, 2)
    line.restore_phase(2 * SECOND, 1)
    assert line.missing == {1}
    pass_time(line, SECOND + 1)
    assert line.missing == {1, 2}
    pass_time(line, 2 * SECOND + 1)
    assert line.missing == {2}


def test_instant_of_an_angle():
    line = AcLine(460.0, 50.0, angle_rad=1.0)
    instant = line.instant_of(pi, 3 * SECOND // 4)
    assert 0 <= instant - 3 * SECOND // 4 < SECOND // 50
    assert cos(line.angle(instant)) == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: AcLine(460.0, 47.9),
        lambda: AcLine(-1.0),
        lambda: AcLine(460.0, inductance_h=float("inf")),
        lambda: AcLine(460.0, missing=[3]),
        lambda: AcLine(460.0).step_frequency(0, 63.0),
        lambda: AcLine(460.0).drift_frequency(0, 50.0, 0.0),
        lambda: AcLine(460.0).settle_voltage(0, 400.0, -1.0),
        lambda: AcLine(460.0).step_voltage(-1, 400.0),
    ],
)
def test_what_a_line_refuses(wrong):
    with pytest.raises(ParameterError):
        wrong()
