import math

import numpy as np
import pytest
from scipy import signal

from blocks.support import TICK, filtered, mapping_constant, outputs_of, run, signals

C = mapping_constant(0.0055)
ROUNDED = 0.5 + 1e-6


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(
    ("kp", "share", "amplitude"),
    [(0.001, 0.005, 30000), (0.5, 0.002, 8000), (2.0, 0.01, 500), (4.0, 0.05, 40), (128.0, 0.002, 25)],
)
@pytest.mark.parametrize("period_ns", [500_000, TICK, 22_000_000, 55_000_000])
def test_against_scipy(period_ns, kp, share, amplitude, name):
    """``share`` is WLD / C."""
    c = mapping_constant(period_ns / 1e9)
    wld = share * c
    inputs = np.trunc(signals(amplitude)[name])
    expected = filtered([kp, kp * wld], [1.0, 0.0], c, inputs)
    assert np.max(np.abs(expected - kp * inputs)) < 8191
    assert np.max(np.abs(expected)) < 32767
    outputs = outputs_of(run("PROP_INT", period_ns, kp=kp, wld=wld), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


def test_against_scipy_with_a_mapping_frequency():
    c = mapping_constant(0.0055, 200.0)
    inputs = np.trunc(signals(1000)["sine"])
    expected = filtered([1.5, 1.5 * 2.0], [1.0, 0.0], c, inputs)
    outputs = outputs_of(run("PROP_INT", kp=1.5, wld=2.0, wm=200.0), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


def test_neither_integrator_nor_output_winds_up():
    block = run("PROP_INT", kp=2.0, wld=5.0, limit_plus=1000, limit_minus=-1000)
    outputs_of(block, [600] * 2000)
    assert block.outputs == {"output": 1000, "saturated_plus": True, "saturated_minus": False}
    assert block.state["integrator"] == 1000.0
    kx = 2.0 * 5.0 / C
    integrator = 1000 + kx * (600 - 700)
    assert round(integrator) == 997
    assert block.scan(input=-700) == {
        "output": round(integrator - 1400),
        "saturated_plus": False,
        "saturated_minus": False,
    }
    assert block.state["integrator"] == pytest.approx(integrator)


def test_a_saturated_output_lets_go_in_one_scan_when_the_error_turns():
    block = run("PROP_INT", kp=1.0, wld=1.0, limit_plus=500, limit_minus=-500)
    outputs_of(block, [-400] * 5000)
    assert block.outputs["saturated_minus"]
    outputs_of(block, [0] * 2)
    assert block.scan(input=1)["output"] > -500


def test_the_integrator_is_limited_before_kp_times_input_is_added():
    """Integrator at its upper limit, input negative: the output lies below by KP times INPUT."""
    block = run("PROP_INT", kp=1.0, wld=20.0, limit_plus=300)
    outputs_of(block, [3000] * 200)
    assert block.scan(input=-3000)["output"] < 300 - 2900


def test_default_limits_are_those_printed_in_49():
    block = run("PROP_INT", kp=128.0, wld=1.0)
    assert block.scan(input=-32768) == {"output": -32768, "saturated_plus": False, "saturated_minus": True}
    assert block.scan(input=32767) == {"output": 32767, "saturated_plus": True, "saturated_minus": False}


def test_limit_plus_wins_where_it_lies_below_limit_minus():
    block = run("PROP_INT", kp=1.0, wld=1.0, limit_plus=-100, limit_minus=100)
    assert block.scan(input=0) == {"output": -100, "saturated_plus": True, "saturated_minus": True}
    assert block.scan(input=5000)["output"] == -100


@pytest.mark.parametrize(("share", "span"), [(0.1249, 8191), (0.125, 16383), (0.2499, 16383), (0.25, 32767)])
@pytest.mark.parametrize("sign", [1, -1])
def test_range_of_section_51_limits_the_integrator_alone(share, span, sign):
    """With KP = 0.5: Kx = KP WLD / C, and 0.5 x 2000 comes on top of the integrator."""
    block = run("PROP_INT", kp=0.5, wld=share * C / 0.5)
    outputs_of(block, [sign * 32767] * 100)
    assert block.state["integrator"] == sign * span
    held = block.scan(input=sign * 2000)
    assert held["output"] == sorted((-32768, sign * (span + 1000), 32767))[1]


@pytest.mark.parametrize(("limits", "span"), [((20000, 10000), 8191), ((-10000, -20000), -8191)])
def test_the_integrator_keeps_its_range_where_the_limits_lie_beyond_it(limits, span):
    """The output is limited as programmed all the same."""
    block = run("PROP_INT", kp=1.0, wld=1.0, limit_plus=limits[0], limit_minus=limits[1])
    assert block.scan(input=0)["output"] == min(limits, key=abs)
    assert block.state["integrator"] == span


def test_holds_stop_the_integrator_but_not_kp_times_input():
    block = run("PROP_INT", wld=5.0)
    for _ in range(20):
        block.scan(input=100, kp=1.0)
    here = block.state["integrator"]
    assert block.scan(input=300, kp=1.0, hold_plus=True)["output"] == round(here + 300)
    assert block.scan(input=300, kp=2.0, hold_plus=True)["output"] == round(here + 600)
    assert block.state["integrator"] == here
    block.scan(input=-900, kp=1.0, hold_plus=True)
    lower = block.state["integrator"]
    assert lower < here
    block.scan(input=-900, kp=1.0, hold_minus=True)
    assert block.state["integrator"] == lower


def test_a_limit_wins_over_a_hold():
    block = run("PROP_INT", kp=1.0, wld=5.0)
    outputs_of(block, [1000] * 20)
    block.scan(input=0, hold_minus=True, limit_plus=-50)
    assert block.state["integrator"] == -50.0
    block.scan(input=0, hold_plus=True, limit_minus=70)
    assert block.state["integrator"] == 70.0


def test_reset_sets_output_and_integrator_and_both_move_on_from_there():
    block = run("PROP_INT", kp=2.0, wld=5.0)
    outputs_of(block, [500] * 50)
    assert block.scan(input=300, reset=True, hold_plus=True, initial_value=1000)["output"] == 1000
    assert block.state["integrator"] == 1000.0
    kx = 2.0 * 5.0 / C
    assert block.scan(input=200)["output"] == round(1000 + kx * (200 + 300) + 2.0 * 200)


def test_reset_shows_initial_value_beyond_a_limit_until_the_next_free_scan():
    block = run("PROP_INT", kp=2.0, wld=5.0, limit_plus=400)
    shown = block.scan(input=0, reset=True, initial_value=900)
    assert shown == {"output": 900, "saturated_plus": True, "saturated_minus": False}
    assert block.scan(input=0)["output"] == 400


def test_a_changed_coefficient_leaves_the_integrator_where_it_is():
    block = run("PROP_INT")
    for _ in range(100):
        block.scan(input=100, kp=1.0, wld=5.0)
    here = block.state["integrator"]
    block.scan(input=-100, kp=3.0, wld=9.0)
    assert block.state["integrator"] == here
    assert block.outputs["output"] == round(here - 300)


@pytest.mark.parametrize(
    ("share", "span"), [(0.124996, 8191), (0.12500001, 16383), (0.249992, 16383), (0.25000001, 32767)]
)
@pytest.mark.parametrize("kp", [0.25, 8.0])
def test_range_of_section_51_goes_by_wld_times_kp(kp, share, span):
    block = run("PROP_INT", kp=kp, wld=share * C / kp)
    outputs_of(block, [30000] * 200)
    assert block.scan(input=0)["output"] == span


def test_first_scan_starts_at_rest():
    kx = 2.0 * 5.0 / C
    assert run("PROP_INT", kp=2.0, wld=5.0).scan(input=3000)["output"] == round(6000 + kx * 3000)


def closed_loop(block, set_point, seconds, *, gain, tau):
    """A plant gain / (1 + tau s), sampled in whole counts every 5.5 ms, the block's output held over each scan."""
    pole = math.exp(-0.0055 / tau)
    plant, shown = 0.0, []
    for _ in range(round(seconds / 0.0055)):
        shown.append(plant)
        u = block.scan(input=set_point - math.floor(plant + 0.5))["output"]
        plant = pole * plant + (1 - pole) * gain * u
    return np.array(shown)


@pytest.mark.parametrize(
    ("kp", "wld", "gain", "tau"), [(1.0, 4.0, 1.0, 1.0), (0.5, 2.0, 2.0, 0.5), (4.0, 0.5, 1.0, 2.0)]
)
def test_closed_loop_against_scipy(kp, wld, gain, tau):
    """Feedback and output are whole counts: the plant stays within some counts of the loop without rounding."""
    shown = closed_loop(run("PROP_INT", kp=kp, wld=wld), 1500, 12.0, gain=gain, tau=tau)
    b, a = signal.bilinear([kp, kp * wld], [1.0, 0.0], fs=C / 2)
    pole = math.exp(-0.0055 / tau)
    forward = np.convolve(b, [0.0, (1 - pole) * gain])
    closed = forward + np.convolve(a, [1.0, -pole])
    expected = 1500 * signal.lfilter(forward, closed, np.ones(len(shown)))
    assert np.max(np.abs(shown - expected)) < 4
    assert np.max(np.abs(shown[-200:] - 1500)) <= 2


@pytest.mark.parametrize(("ki", "gain", "tau"), [(1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (1.0, 0.5, 4.0)])
def test_a_small_gain_overshoots_as_the_second_order_formula_says(ki, gain, tau):
    """KP = 0.01 and WLD = KI / KP put the zero far off: wn**2 = K KI / tau, zeta = (1 + K KP) / (2 sqrt(K KI tau))."""
    wn = math.sqrt(gain * ki / tau)
    zeta = (1 + gain * 0.01) / (2 * math.sqrt(gain * ki * tau))
    block = run("PROP_INT", kp=0.01, wld=ki / 0.01)
    shown = closed_loop(block, 2000, 9 / (zeta * wn), gain=gain, tau=tau) / 2000
    root = math.sqrt(1 - zeta**2)
    assert np.max(shown) - 1 == pytest.approx(math.exp(-math.pi * zeta / root), abs=0.012)
    assert np.argmax(shown) * 0.0055 == pytest.approx(math.pi / (wn * root), rel=0.03)
    assert np.max(np.abs(shown[int(4 / (zeta * wn) / 0.0055) :] - 1)) < math.exp(-4) / root + 0.012


def test_a_lead_on_the_plants_pole_makes_the_loop_first_order():
    """WLD = 1 / tau: the loop is 1 / (1 + s tau / (K KP))."""
    shown = closed_loop(run("PROP_INT", kp=4.0, wld=0.5), 1500, 3.0, gain=1.0, tau=2.0)
    t = np.arange(len(shown)) * 0.0055
    assert np.max(np.abs(shown - 1500 * (1 - np.exp(-t / 0.5)))) < 12
    assert np.max(shown) < 1500 + 3
