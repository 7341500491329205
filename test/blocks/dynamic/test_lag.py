import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from blocks.support import TICK, changed, filtered, int16, mapping_constant, outputs_of, repeatable, run, signals

PERIODS = (500_000, TICK, 22_000_000, 55_000_000)
ROUNDED = 0.5 + 1e-6


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(
    ("share", "amplitude"), [(4e-6, 8191), (2e-5, 8000), (0.01, 8191), (0.13, 16383), (0.26, 32767), (0.7, 32767)]
)
@pytest.mark.parametrize("period_ns", PERIODS)
def test_against_scipy(period_ns, share, amplitude, name):
    c = mapping_constant(period_ns / 1e9)
    wlg = share * c
    inputs = np.trunc(signals(amplitude)[name])
    expected = filtered([1.0], [1.0 / wlg, 1.0], c, inputs)
    outputs = outputs_of(run("LAG", period_ns, wlg=wlg), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


@pytest.mark.parametrize("share", [0.001, 0.05, 0.3])
def test_against_scipy_with_a_mapping_frequency(share):
    wm = 100.0
    c = mapping_constant(0.0055, wm)
    inputs = np.trunc(signals(8000)["sine"])
    expected = filtered([1.0], [1.0 / (share * c), 1.0], c, inputs)
    outputs = outputs_of(run("LAG", wlg=share * c, wm=wm), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


@pytest.mark.parametrize("value", [8191, -8191, 1, -1, 4095])
def test_settles_on_its_input_exactly(value):
    outputs = outputs_of(run("LAG", wlg=10.0), [value] * 1000)
    assert outputs[-200:] == [value] * 200


def test_time_constant():
    """After 1/WLG seconds a step has reached 63 %."""
    outputs = outputs_of(run("LAG", wlg=1.0), [8000] * 182)
    assert outputs[-1] == pytest.approx(8000 * (1 - np.exp(-1)), rel=0.01)


@pytest.mark.parametrize(("share", "span"), [(0.1249, 8191), (0.125, 16383), (0.2499, 16383), (0.25, 32767)])
@pytest.mark.parametrize("sign", [1, -1])
def test_range_of_section_51(share, span, sign):
    block = run("LAG", wlg=share * mapping_constant(0.0055))
    outputs = outputs_of(block, [sign * 32767] * 400)
    assert outputs[-1] == sign * span
    assert max(abs(output) for output in outputs) == span


def test_the_range_does_not_wind_up():
    """From beyond the range the output comes back as from the range's edge."""
    block = run("LAG", wlg=10.0)
    c = mapping_constant(0.0055)
    outputs_of(block, [32767] * 2000)
    kx = 10.0 / c
    expected = kx / (1 + kx) * 32767 + (1 - kx) / (1 + kx) * 8191
    assert block.scan(input=0)["output"] == min(8191, round(expected))
    assert block.scan(input=0)["output"] == pytest.approx((1 - kx) / (1 + kx) * 8191, abs=1)


def test_reset_holds_initial_value_and_the_output_moves_on_from_there():
    block = run("LAG", wlg=10.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, -700):
        assert block.scan(input=value, reset=True, initial_value=1000) == {"output": 1000}
    kx = 10.0 / mapping_constant(0.0055)
    expected = (1 - kx) / (1 + kx) * 1000 + kx / (1 + kx) * (2000 - 700)
    assert block.scan(input=2000)["output"] == round(expected)


def test_an_initial_value_beyond_the_range_shows_until_the_next_free_scan():
    block = run("LAG", wlg=10.0)
    assert block.scan(input=32767, reset=True, initial_value=30000) == {"output": 30000}
    assert block.scan(input=32767) == {"output": 8191}


def test_first_scan_starts_at_rest():
    kx = 10.0 / mapping_constant(0.0055)
    assert run("LAG", wlg=10.0).scan(input=8000)["output"] == round(kx / (1 + kx) * 8000)


def test_a_changed_frequency_acts_without_a_step():
    block = run("LAG")
    for _ in range(1000):
        block.scan(input=5000, wlg=10.0)
    assert block.scan(input=5000, wlg=50.0) == {"output": 5000}


@repeatable
@given(st.lists(int16, min_size=1, max_size=50), st.floats(0.01, 200.0))
def test_never_leaves_the_range_of_what_went_in(inputs, wlg):
    outputs = outputs_of(run("LAG", wlg=wlg), inputs)
    assert min([0, *inputs]) <= min(outputs)
    assert max(outputs) <= max([0, *inputs])


def test_a_changed_frequency_acts_on_the_histories():
    block, c = run("LAG"), mapping_constant(0.0055)
    inputs = np.trunc(signals(4000, 400)["noise"])
    outputs = [block.scan(input=int(value), wlg=5.0 if n < 200 else 90.0)["output"] for n, value in enumerate(inputs)]
    before, after = (signal.bilinear([1.0], [1 / wlg, 1.0], fs=c / 2) for wlg in (5.0, 90.0))
    assert np.max(np.abs(outputs - changed(before, after, inputs))) < ROUNDED


def test_a_smaller_coefficient_limits_the_output_on_the_next_scan():
    block, c = run("LAG"), mapping_constant(0.0055)
    for _ in range(300):
        block.scan(input=20000, wlg=0.3 * c)
    assert block.outputs == {"output": 20000}
    assert block.scan(input=20000, wlg=0.2 * c) == {"output": 16383}
    assert block.scan(input=20000, wlg=0.1 * c) == {"output": 8191}


def test_first_scan_in_reset_shows_initial_value():
    assert run("LAG", wlg=10.0).scan(input=500, reset=True, initial_value=-42) == {"output": -42}
    assert run("LAG", wlg=10.0).scan(input=500, reset=True) == {"output": 0}
