"""NOTCHN (48): the notch of section 45, once (ORDER 2) or twice (ORDER 4), mapped at WN."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import changed, int16, mapping_constant, outputs_of, repeatable, run, signals

MS = 1_000_000
ROUNDED = 0.5 + 1e-4
LOWEST = {2: 0.02, 4: 0.3}
"""Low limit of WN T by the order (48.1)."""


def coefficients(order, q, wn, period_s=0.001):
    """Polynomials b and a of the z transfer function, one each for all sections together."""
    b, a = signal.bilinear([1.0, 0.0, wn**2], [1.0, wn / q, wn**2], fs=mapping_constant(period_s, wn) / 2)
    return (b, a) if order == 2 else (np.convolve(b, b), np.convolve(a, a))


def reference(order, q, wn, period_s, inputs):
    """Section by section."""
    values = np.asarray(inputs, dtype=float)
    for _ in range(order // 2):
        values = signal.lfilter(*coefficients(2, q, wn, period_s), values)
    return np.clip(values, -32768, 32767)


def notch(order, q, wn, period_ns=MS):
    return run("NOTCHN", period_ns, order=order, q_factor=q, wn=wn)


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(("q", "turn"), [(0.5, "lowest"), (100.0, "lowest"), (2.0, 0.5), (100.0, 0.4), (0.7, 3.0)])
@pytest.mark.parametrize("period_ns", [MS // 2, 10 * MS])
@pytest.mark.parametrize("order", [2, 4])
def test_against_scipy(order, period_ns, q, turn, name):
    """``turn`` is WN T in radians."""
    wn = (LOWEST[order] * 1.0001 if turn == "lowest" else turn) / (period_ns / 1e9)
    inputs = np.trunc(signals(32767 if q == 2.0 else 4095)[name])
    outputs = outputs_of(notch(order, q, wn, period_ns), inputs)
    assert np.max(np.abs(outputs - reference(order, q, wn, period_ns / 1e9, inputs))) < ROUNDED


@pytest.mark.parametrize("q", [0.5, 100.0])
@pytest.mark.parametrize("order", [2, 4])
def test_against_scipy_at_the_highest_frequency(order, q):
    """All four poles lie by z = -1, where double precision leaves some hundredths of a count."""
    wn = 0.9989 * math.pi / 0.002
    inputs = np.trunc(signals(4095)["noise"])
    outputs = outputs_of(notch(order, q, wn, 2 * MS), inputs)
    assert np.max(np.abs(outputs - reference(order, q, wn, 0.002, inputs))) < 0.55


def test_order_is_2_unless_programmed():
    inputs = np.trunc(signals(4095, 100)["noise"])
    plain = outputs_of(run("NOTCHN", MS, q_factor=1.0, wn=400.0), inputs)
    assert plain == outputs_of(notch(2, 1.0, 400.0), inputs)
    assert plain != outputs_of(notch(4, 1.0, 400.0), inputs)


def test_order_2_is_the_notch_of_section_45():
    inputs = np.trunc(signals(4095, 1000)["noise"])
    assert outputs_of(notch(2, 3.0, 400.0), inputs) == outputs_of(run("NOTCH", MS, q_factor=3.0, wn=400.0), inputs)


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("q", [0.5, 3.0, 100.0])
@pytest.mark.parametrize("scans", [4, 10, 20])
def test_nothing_passes_at_wn(order, q, scans):
    """WN of a whole number of scans a period: rounding of the input leaves its harmonics alone."""
    block = notch(order, q, 2 * math.pi / (scans * 0.001))
    n = np.arange(200 * scans + int(30 * q) * scans)
    inputs = np.round(4095 * np.sin(2 * math.pi * n / scans))
    assert np.max(np.abs(outputs_of(block, inputs)[-100:])) <= 2


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("value", [32767, -32768, 1, -1, 4095])
@pytest.mark.parametrize("q", [0.5, 10.0])
def test_settles_on_its_input_exactly(order, q, value):
    outputs = outputs_of(notch(order, q, 400.0), [value] * 2000)
    assert outputs[-1000:] == [value] * 1000


@pytest.mark.parametrize("order", [2, 4])
def test_first_scan_starts_at_rest(order):
    b, _ = coefficients(order, 1.0, 400.0)
    assert notch(order, 1.0, 400.0).scan(input=20000)["output"] == round(20000 * b[0])


@pytest.mark.parametrize("order", [2, 4])
def test_reset_holds_initial_value_and_the_output_moves_on_from_there(order):
    block = notch(order, 1.0, 350.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, -700, -700, -700, -700):
        assert block.scan(input=value, reset=True, initial_value=1000) == {"output": 1000}
    b, a = coefficients(order, 1.0, 350.0)
    inputs = [-700.0] * 10 + [2500.0] * 300
    state = signal.lfiltic(b, a, [1000.0] * order, [-700.0] * order)
    expected, _ = signal.lfilter(b, a, inputs, zi=state)
    assert abs(expected[0] - 1000) < 300
    assert np.max(np.abs(outputs_of(block, inputs) - expected)) < ROUNDED


@pytest.mark.parametrize("order", [2, 4])
def test_one_scan_of_reset_is_as_good_as_many(order):
    """The input jumps on that scan: the whole history of inputs follows it, so that the output does not step."""
    once, often = notch(order, 1.0, 350.0), notch(order, 1.0, 350.0)
    for block, scans in ((once, 1), (often, 6)):
        outputs_of(block, [-20000, 4000, 700, 90])
        for _ in range(scans):
            block.scan(input=8000, reset=True, initial_value=8000)
    assert outputs_of(once, [8000] * 100) == [8000] * 100
    assert outputs_of(often, [8000] * 100) == [8000] * 100
    assert outputs_of(once, [100] * 100) == outputs_of(often, [100] * 100)


def test_first_scan_in_reset_shows_initial_value():
    assert notch(4, 1.0, 350.0).scan(input=500, reset=True, initial_value=-42) == {"output": -42}
    assert notch(2, 1.0, 350.0).scan(input=500, reset=True) == {"output": 0}


@pytest.mark.parametrize("order", [2, 4])
def test_changed_coefficients_act_on_the_histories(order):
    """Direct form I, whatever the order."""
    block = run("NOTCHN", MS, order=order)
    inputs = np.trunc(signals(3000, 400)["noise"])
    outputs = [
        block.scan(input=int(value), q_factor=1.0 if n < 200 else 2.0, wn=350.0 if n < 200 else 600.0)["output"]
        for n, value in enumerate(inputs)
    ]
    expected = changed(coefficients(order, 1.0, 350.0), coefficients(order, 2.0, 600.0), inputs)
    assert np.max(np.abs(outputs - expected)) < ROUNDED


@repeatable
@given(
    st.sampled_from([2, 4]),
    st.lists(int16, min_size=1, max_size=40),
    st.floats(0.5, 100.0),
    st.floats(0.301, 3.13),
)
def test_any_signal_against_scipy(order, inputs, q, turn):
    outputs = outputs_of(notch(order, q, turn / 0.001), inputs)
    assert np.max(np.abs(outputs - reference(order, q, turn / 0.001, 0.001, inputs))) < ROUNDED


@pytest.mark.parametrize(
    ("order", "q", "wn"), [(2, 0.49, 200.0), (2, 101.0, 200.0), (2, 1.0, 19.9), (4, 1.0, 299.0), (2, 1.0, 3139.0)]
)
def test_a_literal_beyond_its_limit_is_refused(order, q, wn):
    """The low limit depends on the order: 0.02/T and 0.3/T, at 1 ms."""
    with pytest.raises(InstanceError):
        notch(order, q, wn)
