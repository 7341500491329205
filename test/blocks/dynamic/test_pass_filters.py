"""HIGH_PASS_FILTER and LOW_PASS_FILTER (46, 47): Butterworth filters of order 1 to 3, mapped at their own frequency."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import changed, int16, mapping_constant, outputs_of, repeatable, run, signals

MS = 1_000_000
ROUNDED = 0.5 + 1e-5
HIGH, LOW = "HIGH_PASS_FILTER", "LOW_PASS_FILTER"
FREQUENCY = {HIGH: "wld", LOW: "wlg"}
LOWEST = {1: 0.000004, 2: 0.02, 3: 0.1}
"""Low limit of the frequency times T (46.1, 47.1)."""


def laplace(name, order, w):
    """Numerator and denominator as printed."""
    denominator = {
        1: [1.0, w],
        2: [1.0, math.sqrt(2.0) * w, w**2],
        3: [1.0, 2.0 * w, 2.0 * w**2, w**3],
    }[order]
    return ([1.0] + [0.0] * order if name == HIGH else [w**order]), denominator


def coefficients(name, order, w, period_s):
    """Polynomials b and a of the z transfer function."""
    return signal.bilinear(*laplace(name, order, w), fs=mapping_constant(period_s, w) / 2)


def reference(name, order, w, period_s, inputs):
    free = signal.lfilter(*coefficients(name, order, w, period_s), np.asarray(inputs, dtype=float))
    return np.clip(free, -32768, 32767)


def filter_of(name, order, w, period_ns=MS):
    return run(name, period_ns, order=order, **{FREQUENCY[name]: w})


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_printed_functions_are_butterworth_filters(order):
    for name, kind in ((HIGH, "highpass"), (LOW, "lowpass")):
        b, a = laplace(name, order, 30.0)
        butter_b, butter_a = signal.butter(order, 30.0, kind, analog=True)
        assert b == pytest.approx(butter_b)
        assert a == pytest.approx(butter_a)


@pytest.mark.parametrize("kind", ["steps", "sine", "noise"])
@pytest.mark.parametrize("turn", ["lowest", 0.4, 2.0])
@pytest.mark.parametrize("period_ns", [MS // 2, 10 * MS])
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_against_scipy(name, order, period_ns, turn, kind):
    """``turn`` is the frequency times T. Full steps leave 16 bits after a high-pass: the output clamps."""
    w = (LOWEST[order] * 1.0001 if turn == "lowest" else turn) / (period_ns / 1e9)
    inputs = np.trunc(signals(32767)[kind])
    outputs = outputs_of(filter_of(name, order, w, period_ns), inputs)
    assert np.max(np.abs(outputs - reference(name, order, w, period_ns / 1e9, inputs))) < ROUNDED


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
@pytest.mark.parametrize("period_ns", [MS // 2, 2 * MS])
def test_against_scipy_at_the_highest_frequency(name, order, period_ns):
    w = 0.9989 * math.pi / (period_ns / 1e9)
    inputs = np.trunc(signals(4095)["noise"])
    outputs = outputs_of(filter_of(name, order, w, period_ns), inputs)
    assert np.max(np.abs(outputs - reference(name, order, w, period_ns / 1e9, inputs))) < ROUNDED


@pytest.mark.parametrize("name", [HIGH, LOW])
def test_order_is_1_unless_programmed(name):
    inputs = [1000] * 30
    assert outputs_of(run(name, MS, **{FREQUENCY[name]: 50.0}), inputs) == outputs_of(filter_of(name, 1, 50.0), inputs)
    assert outputs_of(filter_of(name, 2, 50.0), inputs) != outputs_of(filter_of(name, 1, 50.0), inputs)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("value", [32767, -32768, 1, -1, 4095])
@pytest.mark.parametrize("turn", [0.1001, 0.5, 3.0])
def test_settles_exactly(order, value, turn):
    """A low-pass on its input, a high-pass at 0."""
    w = turn / 0.001
    assert outputs_of(filter_of(LOW, order, w), [value] * 1500)[-300:] == [value] * 300
    assert outputs_of(filter_of(HIGH, order, w), [value] * 1500)[-300:] == [0] * 300


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_first_scan_starts_at_rest(name, order):
    b, _ = coefficients(name, order, 300.0, 0.001)
    assert filter_of(name, order, 300.0).scan(input=30000)["output"] == round(30000 * b[0])


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_half_the_power_passes_at_the_cutoff(name, order):
    """An amplitude of 1 / sqrt 2 at the cutoff, which the mapping keeps in its place."""
    b, a = coefficients(name, order, 200.0, 0.001)
    _, response = signal.freqz(b, a, worN=[0.2])
    assert abs(response[0]) == pytest.approx(math.sqrt(0.5))
    block = filter_of(name, order, 200.0)
    n = np.arange(2000 + 3142)
    outputs = np.array(outputs_of(block, np.round(10000 * np.sin(0.2 * n)))[2000:])
    assert math.sqrt(2 * np.mean(outputs**2.0)) == pytest.approx(10000 * math.sqrt(0.5), rel=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_reset_holds_initial_value_and_the_output_moves_on_from_there(name, order):
    block = filter_of(name, order, 150.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, -700, -700, -700):
        assert block.scan(input=value, reset=True, initial_value=1000) == {"output": 1000}
    b, a = coefficients(name, order, 150.0, 0.001)
    inputs = [-700.0] * 10 + [2500.0] * 100
    state = signal.lfiltic(b, a, [1000.0] * order, [-700.0] * order)
    expected, _ = signal.lfilter(b, a, inputs, zi=state)
    assert abs(expected[0] - 1000) < 300
    outputs = outputs_of(block, inputs)
    assert np.max(np.abs(outputs - expected)) < ROUNDED


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_one_scan_of_reset_is_as_good_as_many(name, order):
    """The input jumps on that scan: the whole history of inputs follows it, so that the output does not step."""
    once, often = filter_of(name, order, 150.0), filter_of(name, order, 150.0)
    for block, scans in ((once, 1), (often, 5)):
        outputs_of(block, [-20000, 4000, 700])
        for _ in range(scans):
            block.scan(input=8000, reset=True, initial_value=-500)
    assert outputs_of(once, [100] * 100) == outputs_of(often, [100] * 100)


@pytest.mark.parametrize("name", [HIGH, LOW])
def test_first_scan_in_reset_shows_initial_value(name):
    assert filter_of(name, 3, 150.0).scan(input=500, reset=True, initial_value=-42) == {"output": -42}
    assert filter_of(name, 3, 150.0).scan(input=500, reset=True) == {"output": 0}


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("name", [HIGH, LOW])
def test_a_changed_frequency_acts_on_the_histories(name, order):
    """Direct form I, whatever the order."""
    block = run(name, MS, order=order)
    inputs = np.trunc(signals(3000, 400)["noise"])
    frequencies = [150.0 if n < 200 else 600.0 for n in range(400)]
    outputs = [
        block.scan(input=int(value), **{FREQUENCY[name]: w})["output"]
        for value, w in zip(inputs, frequencies, strict=True)
    ]
    before, after = (coefficients(name, order, w, 0.001) for w in (150.0, 600.0))
    assert np.max(np.abs(outputs - changed(before, after, inputs))) < ROUNDED


@repeatable
@given(
    st.sampled_from([HIGH, LOW]), st.integers(1, 3), st.lists(int16, min_size=1, max_size=40), st.floats(0.101, 3.13)
)
def test_any_signal_against_scipy(name, order, inputs, turn):
    w = turn / 0.001
    outputs = outputs_of(filter_of(name, order, w), inputs)
    assert np.max(np.abs(outputs - reference(name, order, w, 0.001, inputs))) < ROUNDED


@pytest.mark.parametrize("name", [HIGH, LOW])
def test_a_literal_beyond_its_limit_is_refused(name):
    """The low limit depends on the order: 15 rad/s at 1 ms is enough for the first alone."""
    filter_of(name, 1, 15.0)
    for order, w in ((2, 15.0), (3, 99.0), (1, 3139.0)):
        with pytest.raises(InstanceError):
            filter_of(name, order, w)


def test_a_constant_input_is_filtered_like_a_variable():
    assert [run(LOW, MS, wlg=100.0, input=1000).scan()["output"]] == outputs_of(filter_of(LOW, 1, 100.0), [1000])
