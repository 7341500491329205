"""NOTCH (45): (s**2 + WN**2) / (s**2 + WN s / Q + WN**2), mapped at WN."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import TICK, changed, int16, mapping_constant, outputs_of, repeatable, run, signals

ROUNDED = 0.5 + 1e-4


def coefficients(q, wn, period_s):
    """Polynomials b and a of the z transfer function."""
    c = mapping_constant(period_s, wn)
    return signal.bilinear([1.0, 0.0, wn**2], [1.0, wn / q, wn**2], fs=c / 2)


def reference(q, wn, inputs, period_s=0.0055):
    return np.clip(signal.lfilter(*coefficients(q, wn, period_s), np.asarray(inputs, dtype=float)), -32768, 32767)


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(
    ("q", "turn", "amplitude"),
    [(0.5, 0.01, 4095), (0.7071, 0.05, 32767), (2.0, 0.3, 4095), (10.0, 0.1, 4095), (100.0, 0.6283185, 4095)],
)
@pytest.mark.parametrize("period_ns", [500_000, TICK, 22_000_000, 55_000_000])
def test_against_scipy(period_ns, q, turn, amplitude, name):
    """``turn`` is WN T in radians."""
    wn = turn / (period_ns / 1e9)
    inputs = np.trunc(signals(amplitude)[name])
    outputs = outputs_of(run("NOTCH", period_ns, q_factor=q, wn=wn), inputs)
    assert np.max(np.abs(outputs - reference(q, wn, inputs, period_ns / 1e9))) < ROUNDED


@pytest.mark.parametrize("q", [0.5, 100.0])
@pytest.mark.parametrize("period_ns", [500_000, TICK, 55_000_000])
@pytest.mark.parametrize("edge", ["low", "high"])
def test_against_scipy_at_the_limits(edge, period_ns, q):
    """The low limit of 0.01 rad/s lies far below the scan frequency: the reference runs in extended precision."""
    period = period_ns / 1e9
    wn = 0.01 if edge == "low" else 2 * math.pi / 10 / period
    inputs = np.trunc(signals(4095)["steps"])
    outputs = outputs_of(run("NOTCH", period_ns, q_factor=q, wn=wn), inputs)
    assert np.max(np.abs(outputs - extended(q, wn, period, inputs))) < 0.6


def extended(q, wn, period_s, inputs):
    """The filter by its states in terms of differences, exact for a WN T near 0."""
    g = np.longdouble(math.tan(wn * period_s / 2))
    d = 1 + g / np.longdouble(q) + g * g
    low = band = np.longdouble(0)
    outputs = []
    for x in inputs:
        high = (x - (g + 1 / np.longdouble(q)) * band - low) / d
        outputs.append(float(high + g * (band + g * high) + low))
        band, low = band + 2 * g * high, low + 2 * g * (band + g * high)
    return np.array(outputs)


def test_the_extended_reference_is_the_filter():
    inputs = signals(4095)["noise"]
    assert extended(3.0, 40.0, 0.0055, inputs) == pytest.approx(reference(3.0, 40.0, inputs), abs=1e-6)


@pytest.mark.parametrize("q", [0.5, 3.0, 100.0])
@pytest.mark.parametrize("scans", [10, 20, 64])
def test_nothing_passes_at_wn(q, scans):
    """WN of a whole number of scans a period: rounding of the input leaves its harmonics alone."""
    block = run("NOTCH", q_factor=q, wn=2 * math.pi / scans / 0.0055)
    n = np.arange(200 * scans + int(20 * q) * scans)
    inputs = np.round(4095 * np.sin(2 * math.pi * n / scans))
    assert np.max(np.abs(outputs_of(block, inputs)[-100:])) <= 2


@pytest.mark.parametrize("q", [0.5, 10.0])
@pytest.mark.parametrize("value", [32767, -32768, 1, -1, 4095])
def test_settles_on_its_input_exactly(q, value):
    outputs = outputs_of(run("NOTCH", q_factor=q, wn=40.0), [value] * 3000)
    assert outputs[-1000:] == [value] * 1000


def test_first_scan_starts_at_rest():
    b, _ = coefficients(2.0, 30.0, 0.0055)
    assert run("NOTCH", q_factor=2.0, wn=30.0).scan(input=10000)["output"] == round(10000 * b[0])


def test_the_clamp_of_the_output_leaves_the_state():
    """The dips of a full swing without its fundamental leave 16 bits."""
    inputs = ([-32768] * 14 + [32767] * 14) * 30 + [0] * 100
    wn = 2 * math.pi / 28 / 0.0055
    outputs = outputs_of(run("NOTCH", q_factor=0.5, wn=wn), inputs)
    free = signal.lfilter(*coefficients(0.5, wn, 0.0055), np.array(inputs, dtype=float))
    assert np.max(free) > 35500
    assert np.max(np.abs(outputs - np.clip(free, -32768, 32767))) < ROUNDED


def test_reset_holds_zero_and_the_output_moves_on_from_there():
    block = run("NOTCH", q_factor=2.0, wn=30.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, 700, 700):
        assert block.scan(input=value, reset=True) == {"output": 0}
    b, a = coefficients(2.0, 30.0, 0.0055)
    inputs = [700.0] * 20 + [2500.0] * 300
    expected, _ = signal.lfilter(b, a, inputs, zi=signal.lfiltic(b, a, [0.0, 0.0], [700.0, 700.0]))
    assert abs(expected[0]) < 30
    assert np.max(np.abs(outputs_of(block, inputs) - expected)) < ROUNDED


def test_one_scan_of_reset_is_as_good_as_many():
    """The input jumps on that scan: both inputs of the history follow it, so that the output does not step."""
    once, often = run("NOTCH", q_factor=2.0, wn=30.0), run("NOTCH", q_factor=2.0, wn=30.0)
    for block, scans in ((once, 1), (often, 5)):
        outputs_of(block, [-20000] * 7)
        for _ in range(scans):
            block.scan(input=8000, reset=True)
    assert abs(once.scan(input=8000)["output"]) < 300
    assert often.scan(input=8000) == once.outputs
    assert outputs_of(once, [100] * 200) == outputs_of(often, [100] * 200)


def test_changed_coefficients_act_on_the_histories():
    """Direct form I."""
    block = run("NOTCH")
    inputs = np.trunc(signals(3000, 400)["noise"])
    outputs = [
        block.scan(input=int(value), q_factor=1.0 if n < 200 else 5.0, wn=20.0 if n < 200 else 60.0)["output"]
        for n, value in enumerate(inputs)
    ]
    expected = changed(coefficients(1.0, 20.0, 0.0055), coefficients(5.0, 60.0, 0.0055), inputs)
    assert np.max(np.abs(outputs - expected)) < ROUNDED


@repeatable
@given(st.lists(int16, min_size=1, max_size=40), st.floats(0.5, 100.0), st.floats(0.01, 114.2))
def test_any_signal_against_scipy(inputs, q, wn):
    outputs = outputs_of(run("NOTCH", q_factor=q, wn=wn), inputs)
    assert np.max(np.abs(outputs - reference(q, wn, inputs))) < ROUNDED


@pytest.mark.parametrize("literals", [{"q_factor": 0.49, "wn": 10.0}, {"q_factor": 1.0, "wn": 115.0}])
def test_a_literal_beyond_its_limit_is_refused(literals):
    with pytest.raises(InstanceError):
        run("NOTCH", **literals)
