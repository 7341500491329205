"""The measurement of frequency and step responses: against scipy's filters, and with what it says of its own errors."""

import cmath
import math

import numpy as np
import pytest
from blocks.support import mapping_constant, repeatable, run
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.tuning import frequency
from automax_ros.tuning.driven import DrivenBlock
from automax_ros.tuning.frequency import (
    MeasuredResponse,
    Sweep,
    decibels,
    first_phase,
    logarithmic,
    phases,
    roots,
    rounding_error,
    settling_scans,
    whole_counts,
    whole_periods,
)
from automax_ros.tuning.step_response import default_scans, filtered, laplace_step, respond
from automax_ros.tuning.tuning import tuning

SQUARE_ROOT = math.sqrt(2.0)


def butterworth(w, order):
    return {1: [1, w], 2: [1, SQUARE_ROOT * w, w**2], 3: [1, 2 * w, 2 * w**2, w**3]}[order]


def notch(w, q, times):
    above, below = np.array([1.0, 0.0, w**2]), np.array([1.0, w / q, w**2])
    return (above, below) if times == 1 else (np.polymul(above, above), np.polymul(below, below))


def mapped(name, period_ns, parameters, numerator, denominator, w=None):
    """A block and its discrete function as scipy makes it; ``w`` where it maps at its own frequency."""
    period = period_ns / 1e9
    c = mapping_constant(period, w or parameters.get("WM"))
    b, a = signal.bilinear(numerator, denominator, fs=c / 2)
    return pytest.param(name, period_ns, parameters, b, a, id=f"{name}-{'-'.join(map(str, parameters.values()))}")


def pid(period_ns, b, **parameters):
    label = f"PID-{'-'.join(map(str, parameters.values()))}"
    return pytest.param("PID", period_ns, {**parameters, "LOOP_TIME": period_ns / 1e9}, b, [1.0, -1.0], id=label)


def pid_function(kp, ki, kd, loop_time):
    """KP + KI T/2 (1 + z**-1)/(1 - z**-1) + KD/T (1 - z**-1), over 1 - z**-1."""
    i, d = ki * loop_time / 2, kd / loop_time
    return [kp + i + d, i - kp - 2 * d, d]


MS = 1_000_000
CASES = [
    mapped("LAG", 22 * MS, {"WLG": 10.0}, [1.0], [0.1, 1.0]),
    mapped("LAG", 5 * MS, {"WLG": 40.0, "WM": 90.0}, [1.0], [1 / 40, 1.0]),
    mapped("DIFF_LAG", 11 * MS, {"WLG": 30.0}, [1 / 30, 0.0], [1 / 30, 1.0]),
    mapped("LEAD_LAG", 11 * MS, {"WLD": 2.0, "WLG": 30.0}, [0.5, 1.0], [1 / 30, 1.0]),
    mapped("LEAD_LAG", 11 * MS, {"WLD": 30.0, "WLG": 2.0}, [1 / 30, 1.0], [0.5, 1.0]),
    mapped("INTEGRATE", 11 * MS, {"KI": 2.5}, [2.5], [1.0, 0.0]),
    mapped("PROP_INT", 11 * MS, {"KP": 26.7, "WLD": 0.8}, [26.7, 26.7 * 0.8], [1.0, 0.0]),
    mapped("NOTCH", 5 * MS, {"WN": 30.0, "Q_FACTOR": 0.5}, *notch(30.0, 0.5, 1), w=30.0),
    mapped("NOTCH", 5 * MS, {"WN": 30.0, "Q_FACTOR": 20.0}, *notch(30.0, 20.0, 1), w=30.0),
    mapped("NOTCHN", 1 * MS, {"WN": 500.0, "Q_FACTOR": 5.0}, *notch(500.0, 5.0, 1), w=500.0),
    mapped("NOTCHN", 1 * MS, {"WN": 500.0, "Q_FACTOR": 5.0, "ORDER": 4}, *notch(500.0, 5.0, 2), w=500.0),
    *(
        mapped("HIGH_PASS_FILTER", 2 * MS, {"WLD": 300.0, "ORDER": n}, [1] + [0] * n, butterworth(300.0, n), w=300.0)
        for n in (1, 2, 3)
    ),
    *(
        mapped("LOW_PASS_FILTER", 2 * MS, {"WLG": 300.0, "ORDER": n}, [300.0**n], butterworth(300.0, n), w=300.0)
        for n in (1, 2, 3)
    ),
    pid(22 * MS, pid_function(2.0, 1.0, 0.05, 0.022), KP=2.0, KI=1.0, KD=0.05),
    pid(22 * MS, pid_function(2.0, 2.0, 0.1, 0.022), KP=2.0, KI=1.0, KD=0.05, ISA=True),
    pid(55 * MS, pid_function(0.5, 4.0, 0.2, 0.055), KP=0.5, KI=4.0, KD=0.2, DERIVATIVE=True),
    pid(55 * MS, pid_function(0.5, 2.0, 0.1, 0.055), KP=0.5, KI=4.0, KD=0.2, ISA=True, DERIVATIVE=True, ACTION=True),
    pid(55 * MS, pid_function(0.5, 4.0, 0.2, 0.055), KP=0.5, KI=4.0, KD=0.2, ACTION=True),
]  # fmt: skip


def transfer_of(name, period_ns, parameters):
    known = {key: float(value) for key, value in parameters.items() if key in CATALOGUE[name].coefficients.parameters}
    return tuning(CATALOGUE[name], period_ns / 1e9, known).transfer


@pytest.mark.parametrize(("name", "period_ns", "parameters", "b", "a"), CASES)
def test_sweep_measures_scipys_discrete_function(name, period_ns, parameters, b, a):
    """Within what it says that rounding may do, and 0.1 dB and 1 degree where it calls the point reliable and loud."""
    transfer = transfer_of(name, period_ns, parameters)
    sweep = Sweep(CATALOGUE[name], period_ns, parameters, transfer, None)
    nyquist = math.pi * 1e9 / period_ns
    found = sweep.measure(logarithmic(0.01 * nyquist, 0.95 * nyquist, 8))
    loud = 0
    for item in found:
        assert item.touched == ()
        _, (expected,) = signal.freqz(b, a, worN=[item.rad_s * period_ns / 1e9])
        assert abs(item.gain - expected) <= item.uncertainty + 2e-4 * abs(expected)
        if item.reliable and abs(expected) * item.amplitude > 40.0:
            loud += 1
            assert abs(20 * math.log10(abs(item.gain / expected))) < 0.1
            assert abs(math.degrees(cmath.phase(item.gain / expected))) < 1.0
    assert loud >= 3


@pytest.mark.parametrize(("name", "period_ns", "parameters", "b", "a"), CASES)
def test_step_is_scipys(name, period_ns, parameters, b, a):
    transfer = transfer_of(name, period_ns, parameters)
    scans = min(default_scans(transfer), 4000)
    found = respond(CATALOGUE[name], period_ns, parameters, transfer, None, scans)
    design = found.counts * signal.lfilter(b, a, np.ones(scans))
    assert found.touched == ()
    assert np.max(np.abs(np.array(found.output) - design)) <= 0.5 + 1e-3
    assert np.allclose(found.design, design, atol=0.01, rtol=1e-6)
    times = [n * found.period_s for n in range(1, 40)]
    if name != "PID":
        _, ideal = signal.step(
            (np.trim_zeros(transfer.numerator, "f"), transfer.denominator), T=np.array([0.0, *times])
        )
        assert laplace_step(transfer, times) == pytest.approx(list(ideal[1:]), abs=1e-6, rel=1e-6)


def test_laplace_step_of_pid_is_kp_and_ki_t():
    """The D term's impulse at 0 is left out."""
    transfer = transfer_of("PID", 22 * MS, {"KP": 2.0, "KI": 3.0, "KD": 0.5, "LOOP_TIME": 0.022})
    assert laplace_step(transfer, [0.1, 1.0, 10.0]) == pytest.approx([2.3, 5.0, 32.0])
    nothing = transfer_of("PID", 22 * MS, {"KP": 0.0, "KI": 0.0, "LOOP_TIME": 0.022})
    assert laplace_step(nothing, [1.0]) == [0.0]


@pytest.mark.parametrize(("name", "period_ns", "parameters", "b", "a"), CASES)
def test_driven_block_is_the_instance_scan_for_scan(name, period_ns, parameters, b, a):
    literals = {key.lower(): value for key, value in parameters.items()}
    block = run(name, period_ns, **literals)
    driven = DrivenBlock(CATALOGUE[name], period_ns, parameters)
    sign = -1 if parameters.get("ACTION") else 1
    by_feedback = parameters.get("DERIVATIVE", False)
    n = np.arange(300)
    counts = np.round(150 * np.sin(n / 7.0) + 40 * np.sin(n * 1.3)).astype(int).tolist()
    expected = []
    for value in counts:
        if name != "PID":
            expected.append(block.scan(input=value)["output"])
        elif by_feedback:
            expected.append(block.scan(input=0, feedback=-sign * value)["output"])
        else:
            expected.append(block.scan(input=sign * value, feedback=0)["output"])
    assert driven.run(counts) == expected
    driven.begin()
    assert driven.run(counts) == expected


@repeatable
@given(amplitude=st.floats(0.01, 3000.0), phase=st.floats(0.0, 6.28), turns=st.sampled_from([1, 7, 101]))
def test_rounding_error_bounds_what_rounding_does_to_a_sine(amplitude, phase, turns):
    window = 4001
    angle = 2 * np.pi * turns * np.arange(window) / window + phase
    exact = amplitude * np.sin(angle)
    error = np.floor(np.abs(exact) + 0.5) * np.sign(exact) - exact
    fundamental = 2 / window * abs(np.sum(error * np.exp(-1j * angle)))
    assert fundamental <= rounding_error(amplitude, window) * 1.001


@repeatable
@given(share=st.floats(1e-5, 0.99), period_s=st.floats(0.0005, 0.3))
def test_window_has_whole_periods_that_do_not_repeat(share, period_s):
    wanted = share * math.pi / period_s
    turns, window = whole_periods(wanted, period_s)
    assert math.gcd(turns, window) == 1
    assert turns / window < 0.5
    assert 2 * math.pi * turns / window / period_s == pytest.approx(wanted, rel=2e-3)
    assert window >= 990


@repeatable
@given(
    amplitude=st.integers(1, 32767),
    turns=st.sampled_from([1, 2, 3, 53, 499]),
    window=st.integers(1001, 2001),
    first=st.integers(0, 5000),
)
def test_sine_has_no_mean_and_its_amplitude(amplitude, turns, window, first):
    wave = whole_counts(amplitude, turns, window, first)
    assert len(wave) == window
    assert sum(wave) == 0 or math.gcd(turns, window) > 1
    assert max(map(abs, wave)) <= amplitude
    exact = [amplitude * math.sin(2 * math.pi * (first + turns * n) / window) for n in range(window)]
    assert wave == pytest.approx(exact, abs=0.5 + 1e-6)


@pytest.mark.parametrize(
    "polynomial",
    [
        [1.0, 5.0],
        [0.1, 1.0],
        [1.0, 4.0, 400.0],
        [1.0, 2e-3, 2e-6, 1e-9],
        np.polymul([1, 6, 900], [1, 6, 900]).tolist(),
        [0.0, 2.0, 1.0],
        [1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [3.0],
    ],
)
def test_roots_are_numpys(polynomial):
    found, left = roots(polynomial), list(np.roots(polynomial))
    assert len(found) == len(left)
    for root in found:
        nearest = min(left, key=lambda other: abs(root - other))
        left.remove(nearest)
        assert abs(root - nearest) <= 1e-5 * max(1e-3, abs(nearest))


def test_roots_of_nothing():
    assert roots([0.0, 0.0, 0.0]) == []


@repeatable
@given(wlg=st.floats(0.01, 60.0))
def test_transients_have_died_out_when_the_window_begins(wlg):
    transfer = transfer_of("LAG", 22 * MS, {"WLG": wlg})
    scans = settling_scans(transfer)
    assert (-transfer.a[1]) ** scans < 1e-6
    assert (-transfer.a[1]) ** (scans - 6) > 0.9e-6 or scans < 20


def test_filtered_is_lfilter():
    b, a = signal.butter(3, 0.2)
    noise = np.random.default_rng(1985).uniform(-1, 1, 200)
    assert filtered(b.tolist(), a.tolist(), noise.tolist()) == pytest.approx(signal.lfilter(b, a, noise).tolist())


def test_limits_that_are_hit_are_told():
    """An amplitude that somebody insists on; the default one keeps away from all limits."""
    block, transfer = CATALOGUE["INTEGRATE"], transfer_of("INTEGRATE", 11 * MS, {"KI": 2.5})
    (low,) = Sweep(block, 11 * MS, {"KI": 2.5}, transfer, 4095).measure([0.5])
    assert low.touched == ("the integrator's range +-8191 (section 51)",)
    assert not low.reliable
    (free,) = Sweep(block, 11 * MS, {"KI": 2.5}, transfer, None).measure([0.5])
    assert free.touched == ()
    assert free.amplitude * 5.0 < 8191
    bound = {"KI": 2.5, "LIMIT_PLUS": 100, "LIMIT_MINUS": -50}
    (small,) = Sweep(block, 11 * MS, bound, transfer, None).measure([0.5])
    assert small.amplitude * 5.0 < 50
    (hit,) = Sweep(block, 11 * MS, bound, transfer, 40).measure([0.5])
    assert hit.touched == ("LIMIT_MINUS -50", "LIMIT_PLUS 100")


def test_change_limit_of_pid_is_told_and_kept_off():
    parameters = {"KP": 2.0, "KI": 0.0, "LOOP_TIME": 0.022, "MAX_CHANGE": 100}
    transfer = transfer_of("PID", 22 * MS, parameters)
    (hit,) = Sweep(CATALOGUE["PID"], 22 * MS, parameters, transfer, 1000).measure([10.0])
    assert hit.touched == ("MAX_CHANGE 100",)
    (free,) = Sweep(CATALOGUE["PID"], 22 * MS, parameters, transfer, None).measure([10.0])
    assert free.reliable
    assert abs(free.gain) == pytest.approx(2.0, rel=1e-3)


def test_feed_forward_is_rest_and_takes_its_part_of_the_room():
    parameters = {"KP": 2.0, "KI": 0.0, "LOOP_TIME": 0.022, "FEED_FORWARD": 30000}
    transfer = transfer_of("PID", 22 * MS, parameters)
    (found,) = Sweep(CATALOGUE["PID"], 22 * MS, parameters, transfer, None).measure([10.0])
    assert found.touched == ()
    assert found.amplitude * 2 < 2767
    assert abs(found.gain) == pytest.approx(2.0, rel=1e-3)
    step = respond(CATALOGUE["PID"], 22 * MS, parameters, transfer, 1000, 30)
    assert (step.rest, step.final, step.output[-1]) == (30000, 32000, 32000)
    assert step.overshoot == 0.0
    assert step.settling_s == 0.0


@pytest.mark.parametrize("most", [50, 1])
def test_pid_is_at_rest_before_anything_is_measured(most):
    """MAX_CHANGE leads OUTPUT to FEED_FORWARD; neither step nor sine sees that."""
    parameters = {"KP": 0.5, "KI": 0.0, "LOOP_TIME": 0.022, "FEED_FORWARD": 5000, "MAX_CHANGE": most}
    transfer = transfer_of("PID", 22 * MS, parameters)
    step = respond(CATALOGUE["PID"], 22 * MS, parameters, transfer, 20 * most, 30)
    assert step.rest == 5000
    assert step.output == tuple(5000 + min(most * n, 10 * most) for n in range(1, 31))
    (found,) = Sweep(CATALOGUE["PID"], 22 * MS, parameters, transfer, most).measure([10.0])
    assert abs(found.gain - 0.5) <= found.uncertainty
    assert found.touched == (() if most > 1 else ("MAX_CHANGE 1",))


@pytest.mark.parametrize(
    ("limits", "rest", "first"), [({"LIMIT_PLUS": 3000}, 3000, 3000), ({"LIMIT_MINUS": 6000}, 11000, 11002)]
)
def test_rest_of_pid_is_where_its_limits_leave_it(limits, rest, first):
    """The low limit holds the integrator too, to which FEED_FORWARD is added: 6000 + 5000."""
    parameters = {"KP": 2.0, "KI": 0.0, "LOOP_TIME": 0.022, "FEED_FORWARD": 5000, **limits}
    transfer = transfer_of("PID", 22 * MS, parameters)
    step = respond(CATALOGUE["PID"], 22 * MS, parameters, transfer, 1, 10)
    assert (step.rest, step.output[0]) == (rest, first)
    assert step.touched == (("LIMIT_PLUS 3000",) if rest == 3000 else ())


def test_integrator_begins_where_its_limits_leave_it():
    step = respond(
        CATALOGUE["INTEGRATE"],
        22 * MS,
        {"KI": 1.0, "LIMIT_MINUS": 100},
        transfer_of("INTEGRATE", 22 * MS, {"KI": 1.0}),
        500,
        20,
    )
    assert step.rest == 100
    assert 100 < step.output[0] < 120


def test_what_takes_too_long_is_not_measured(monkeypatch):
    transfer = transfer_of("LAG", 22 * MS, {"WLG": 10.0})
    monkeypatch.setattr(frequency, "MOST_SCANS_IN_ALL", 5000)
    sweep = Sweep(CATALOGUE["LAG"], 22 * MS, {"WLG": 10.0}, transfer, None)
    slow, middle, fast = sweep.measure([1e-6, 5.0, 100.0])
    assert slow is None
    assert middle.rad_s == pytest.approx(5.0, rel=1e-3)
    assert fast.rad_s == pytest.approx(100.0, rel=1e-3)


def test_same_measurement_every_time():
    transfer = transfer_of("PROP_INT", 11 * MS, {"KP": 3.0, "WLD": 2.0})
    sweep = Sweep(CATALOGUE["PROP_INT"], 11 * MS, {"KP": 3.0, "WLD": 2.0}, transfer, None)
    wanted = [1.0, 30.0]
    assert sweep.measure(wanted) == sweep.measure(wanted)
    assert [item.rad_s for item in sweep.measure(wanted[::-1])] == [item.rad_s for item in sweep.measure(wanted)][::-1]


def test_uncertainty_in_db_and_degrees():
    point = MeasuredResponse(1.0, 100, complex(0.0, 0.1), 0.05, ())
    assert point.uncertainty_db == pytest.approx(20 * math.log10(1.5))
    assert point.uncertainty_deg == pytest.approx(30.0)
    assert not point.reliable
    nothing = MeasuredResponse(1.0, 100, 0j, 0.005, ())
    assert (nothing.uncertainty_db, nothing.uncertainty_deg, nothing.reliable) == (math.inf, 180.0, False)
    assert decibels(0j) is None


@pytest.mark.parametrize(
    ("name", "parameters", "start"),
    [
        ("LAG", {"WLG": 10.0}, 0.0),
        ("DIFF_LAG", {"WLG": 10.0}, 90.0),
        ("INTEGRATE", {"KI": 1.0}, -90.0),
        ("HIGH_PASS_FILTER", {"WLD": 30.0, "ORDER": 3}, 270.0),
        ("NOTCH", {"WN": 20.0, "Q_FACTOR": 2.0}, None),
        ("PID", {"KP": 1.0, "KI": 0.0, "LOOP_TIME": 0.022}, 0.0),
        ("PID", {"KP": 1.0, "KI": 1.0, "LOOP_TIME": 0.022}, -90.0),
    ],
)
def test_phase_begins_with_90_degrees_a_zero_at_0(name, parameters, start):
    assert first_phase(transfer_of(name, 22 * MS, parameters)) == start


def test_phases_go_on_without_a_jump():
    gains = [cmath.exp(1j * math.radians(angle)) for angle in (265.0, 200.0, 170.0, 90.0, -10.0)]
    assert phases(gains, 270.0) == pytest.approx([265.0, 200.0, 170.0, 90.0, -10.0])
    assert phases(gains, None) == pytest.approx([-95.0, -160.0, 170.0, 90.0, -10.0])
