"""DIFF_LAG (41, 51): (s/WLG) / (1 + s/WLG), the input less the output of an integrator in the feedback path."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import TICK, changed, filtered, int16, mapping_constant, outputs_of, repeatable, run, signals

C = mapping_constant(0.0055)
ROUNDED = 0.5 + 1e-6
"""The output is the rounded filter: no more than half a count from it."""


def shown(values):
    """Rounded half away from zero and clamped to 16 bits."""
    values = np.asarray(values, dtype=float)
    return np.clip(np.sign(values) * np.floor(np.abs(values) + 0.5), -32768, 32767)


def modeled(kx, rows, span):
    """Scan by scan from the diagram in section 51: y = x - i, i the integral of y limited to ``span``."""
    x1 = y1 = 0.0
    outputs = []
    for x in rows:
        before = x1 - y1
        free = (x - before - kx * y1) / (1 + kx)
        integrator = min(max(x - free, -span), span)
        x1, y1 = x, x - integrator
        outputs.append(y1)
    return shown(outputs)


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(
    ("share", "amplitude"), [(4e-6, 8191), (0.01, 4095), (0.126, 16383), (0.251, 32767), (0.7, 32767)]
)
@pytest.mark.parametrize("period_ns", [500_000, TICK, 22_000_000, 55_000_000])
def test_against_scipy(period_ns, share, amplitude, name):
    """Up to the range of the integrator for each coefficient (51); a full step clamps the output, not the state."""
    c = mapping_constant(period_ns / 1e9)
    inputs = np.trunc(signals(amplitude)[name])
    expected = filtered([1.0 / (share * c), 0.0], [1.0 / (share * c), 1.0], c, inputs)
    outputs = outputs_of(run("DIFF_LAG", period_ns, wlg=share * c), inputs)
    assert np.max(np.abs(np.array(outputs) - np.clip(expected, -32768, 32767))) < ROUNDED


@pytest.mark.parametrize("wm", [0.5, 57.0, 253.0])
def test_against_scipy_with_a_mapping_frequency(wm):
    c = mapping_constant(0.0055, wm)
    inputs = np.trunc(signals(8000)["sine"])
    expected = filtered([1.0 / (0.05 * c), 0.0], [1.0 / (0.05 * c), 1.0], c, inputs)
    assert np.max(np.abs(outputs_of(run("DIFF_LAG", wlg=0.05 * c, wm=wm), inputs) - expected)) < ROUNDED


def test_first_scan_starts_at_rest():
    kx = 10.0 / C
    assert run("DIFF_LAG", wlg=10.0).scan(input=8000)["output"] == round(8000 / (1 + kx))


@pytest.mark.parametrize("value", [8191, -8191, 1, -1, 4095])
def test_settles_at_zero_exactly(value):
    outputs = outputs_of(run("DIFF_LAG", wlg=10.0), [value] * 1000)
    assert outputs[0] == shown(value / (1 + 10.0 / C))
    assert outputs[-200:] == [0] * 200


def test_time_constant():
    """After 1/WLG seconds 37 % of a step are left."""
    outputs = outputs_of(run("DIFF_LAG", wlg=1.0), [8000] * 182)
    assert outputs[-1] == pytest.approx(8000 * np.exp(-1), rel=0.01)


def test_output_of_24576_of_section_51():
    """The integrator stops at 8191: an input of 32767 settles at 32767 - 8191."""
    outputs = outputs_of(run("DIFF_LAG", wlg=10.0), [32767] * 2000)
    assert outputs[-1000:] == [24576] * 1000
    outputs = outputs_of(run("DIFF_LAG", wlg=10.0), [-32767] * 2000)
    assert outputs[-1000:] == [-24576] * 1000


@pytest.mark.parametrize(
    ("share", "span"), [(0.124996, 8191), (0.12500001, 16383), (0.249992, 16383), (0.25000001, 32767)]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_range_of_section_51(share, span, sign):
    outputs = outputs_of(run("DIFF_LAG", wlg=share * C), [sign * 32767] * 500)
    assert outputs[-1] == sign * (32767 - span)


def test_the_integrator_does_not_wind_up():
    """Back from beyond its range the output goes on as from the range's edge."""
    kx = 10.0 / C
    inputs = [32767] * 1000 + [0] * 300 + [-20000] * 1000 + [8000] * 400
    assert outputs_of(run("DIFF_LAG", wlg=10.0), inputs) == list(modeled(kx, inputs, 8191))


@repeatable
@given(st.lists(st.tuples(int16, st.integers(1, 40)), min_size=1, max_size=8), st.floats(0.01, 255.0))
def test_follows_the_diagram_of_section_51(pieces, wlg):
    kx = wlg / C
    span = 8191 if kx < 0.125 else 16383 if kx < 0.25 else 32767
    inputs = [value for value, length in pieces for _ in range(length)]
    outputs = outputs_of(run("DIFF_LAG", wlg=wlg), inputs)
    assert np.max(np.abs(np.array(outputs) - modeled(kx, inputs, span))) <= 1
    assert np.mean(np.array(outputs) == modeled(kx, inputs, span)) >= 0.9


def test_reset_holds_initial_value_and_the_output_moves_on_from_there():
    """The integrator stands at INPUT - INITIAL_VALUE after it."""
    block = run("DIFF_LAG", wlg=10.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, -700):
        assert block.scan(input=value, reset=True, initial_value=1000) == {"output": 1000}
    kx = 10.0 / C
    assert block.scan(input=-700)["output"] == round((1 - kx) / (1 + kx) * 1000)
    last = (1 - kx) / (1 + kx) * 1000
    assert block.scan(input=2000)["output"] == round((2000 + 700 + (1 - kx) * last) / (1 + kx))


def test_reset_may_show_an_initial_value_whose_integrator_lies_beyond_the_range():
    """INPUT - INITIAL_VALUE = -30000 shows; the next free scan limits the integrator to -8191."""
    block = run("DIFF_LAG", wlg=10.0)
    assert block.scan(input=0, reset=True, initial_value=30000) == {"output": 30000}
    assert block.scan(input=0) == {"output": 8191}


def test_first_scan_in_reset_shows_initial_value():
    assert run("DIFF_LAG", wlg=10.0).scan(input=500, reset=True, initial_value=-42) == {"output": -42}
    assert run("DIFF_LAG", wlg=10.0).scan(input=500, reset=True) == {"output": 0}


def test_a_changed_frequency_acts_on_the_histories():
    block = run("DIFF_LAG")
    inputs = np.trunc(signals(4000, 400)["sine"])
    outputs = [block.scan(input=int(value), wlg=5.0 if n < 200 else 40.0)["output"] for n, value in enumerate(inputs)]
    before, after = (signal.bilinear([1 / wlg, 0.0], [1 / wlg, 1.0], fs=C / 2) for wlg in (5.0, 40.0))
    assert np.max(np.abs(outputs - changed(before, after, inputs))) < ROUNDED


def test_a_smaller_coefficient_limits_the_integrator_on_the_next_scan():
    block = run("DIFF_LAG")
    for _ in range(300):
        block.scan(input=20000, wlg=0.3 * C)
    assert block.outputs == {"output": 0}
    assert block.scan(input=20000, wlg=0.1 * C) == {"output": 20000 - 8191}


def test_a_literal_frequency_beyond_its_limit_is_refused():
    with pytest.raises(InstanceError, match="WLG"):
        run("DIFF_LAG", wlg=0.72 * C)
