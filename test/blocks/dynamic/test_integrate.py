import math

import numpy as np
import pytest

from blocks.support import TICK, filtered, mapping_constant, outputs_of, run, signals

C = mapping_constant(0.0055)
ROUNDED = 0.5 + 1e-6


def kx(share):
    """KI for a Kx = KI / C of that size at one tick."""
    return share * C


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(("share", "amplitude"), [(4e-6, 32767), (0.002, 8000), (0.02, 500), (0.13, 100), (0.3, 50)])
@pytest.mark.parametrize("period_ns", [500_000, TICK, 22_000_000, 55_000_000])
def test_against_scipy(period_ns, share, amplitude, name):
    c = mapping_constant(period_ns / 1e9)
    inputs = np.trunc(signals(amplitude)[name])
    expected = filtered([share * c], [1.0, 0.0], c, inputs)
    assert np.max(np.abs(expected)) < 8191
    outputs = outputs_of(run("INTEGRATE", period_ns, ki=share * c), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


def test_against_scipy_with_a_mapping_frequency():
    c = mapping_constant(0.0055, 200.0)
    inputs = np.trunc(signals(2000)["sine"])
    expected = filtered([0.9], [1.0, 0.0], c, inputs)
    outputs = outputs_of(run("INTEGRATE", ki=0.9, wm=200.0), inputs)
    assert np.max(np.abs(np.array(outputs) - expected)) < ROUNDED


def test_1200_counts_a_second_of_section_42_3():
    block = run("INTEGRATE", ki=0.59507)
    outputs = outputs_of(block, [2000] * 1001)
    seconds = 800 * 0.0055
    assert (outputs[1000] - outputs[200]) / seconds == pytest.approx(1200, abs=0.3)
    assert outputs[200] == pytest.approx(200.5 * 0.0055 * 1200, abs=1)


def test_limits_hold_and_let_go_at_once():
    block = run("INTEGRATE", ki=10.0, limit_plus=500, limit_minus=-300)
    outputs_of(block, [4000] * 200)
    assert block.outputs == {"output": 500, "saturated_plus": True, "saturated_minus": False}
    assert block.state["y1"] == 500.0
    block.scan(input=-4000)
    back = block.scan(input=-4000)
    assert back["output"] == round(500 - 10.0 / C * 8000)
    assert not back["saturated_plus"]
    outputs_of(block, [-4000] * 200)
    assert block.outputs == {"output": -300, "saturated_plus": False, "saturated_minus": True}


def test_default_limits():
    block = run("INTEGRATE", ki=kx(0.3))
    outputs_of(block, [-32768] * 20)
    assert block.outputs == {"output": -32767, "saturated_plus": False, "saturated_minus": True}
    outputs_of(block, [32767] * 20)
    assert block.outputs == {"output": 32767, "saturated_plus": True, "saturated_minus": False}


def test_limit_plus_wins_where_it_lies_below_limit_minus():
    block = run("INTEGRATE", ki=1.0, limit_plus=-100, limit_minus=100)
    assert block.scan(input=0) == {"output": -100, "saturated_plus": True, "saturated_minus": True}


@pytest.mark.parametrize(("share", "span"), [(0.1249, 8191), (0.125, 16383), (0.2499, 16383), (0.25, 32767)])
@pytest.mark.parametrize("sign", [1, -1])
def test_range_of_section_51(share, span, sign):
    outputs = outputs_of(run("INTEGRATE", ki=kx(share)), [sign * 32767] * 50)
    assert outputs[-1] == sign * span
    assert max(abs(output) for output in outputs) == span


def test_saturated_compares_the_output_not_the_range():
    block = run("INTEGRATE", ki=1.0)
    outputs_of(block, [32767] * 2000)
    assert block.outputs == {"output": 8191, "saturated_plus": False, "saturated_minus": False}


@pytest.mark.parametrize(("limits", "output"), [((20000, 10000), 8191), ((-10000, -20000), -8191)])
def test_the_range_wins_over_limits_beyond_it(limits, output):
    block = run("INTEGRATE", ki=1.0, limit_plus=limits[0], limit_minus=limits[1])
    assert block.scan(input=0)["output"] == output


def test_holds_stop_one_direction():
    block = run("INTEGRATE", ki=10.0)
    up = outputs_of(block, [1000] * 20)
    assert block.scan(input=1000, hold_plus=True)["output"] == up[-1]
    assert block.scan(input=1000, hold_plus=True)["output"] == up[-1]
    assert block.scan(input=-3000, hold_plus=True)["output"] < up[-1]
    here = block.scan(input=-3000)["output"]
    assert block.scan(input=-3000, hold_minus=True)["output"] == here
    assert block.scan(input=9000, hold_minus=True)["output"] > here
    here = block.scan(input=0)["output"]
    assert block.scan(input=0, hold_plus=True, hold_minus=True)["output"] == here


def test_a_limit_wins_over_a_hold():
    block = run("INTEGRATE", ki=10.0)
    outputs_of(block, [1000] * 20)
    assert block.scan(input=0, hold_minus=True, limit_plus=-50)["output"] == -50
    assert block.scan(input=0, hold_plus=True, limit_minus=70)["output"] == 70


def test_reset_shows_initial_value_and_the_next_free_scan_limits_it():
    block = run("INTEGRATE", ki=10.0, limit_plus=500)
    shown = block.scan(input=400, reset=True, initial_value=900)
    assert shown == {"output": 900, "saturated_plus": True, "saturated_minus": False}
    assert block.scan(input=0)["output"] == 500


def test_reset_wins_over_hold():
    result = run("INTEGRATE", ki=10.0).scan(input=0, reset=True, hold_plus=True, hold_minus=True, initial_value=77)
    assert result["output"] == 77


def test_the_history_of_input_follows_while_reset():
    block = run("INTEGRATE", ki=10.0)
    outputs_of(block, [8000] * 5)
    block.scan(input=3000, reset=True, initial_value=100)
    assert block.scan(input=1000)["output"] == round(100 + 10.0 / C * (1000 + 3000))


def test_a_changed_gain_is_bumpless():
    block = run("INTEGRATE")
    for _ in range(100):
        block.scan(input=1000, ki=2.0)
    before = block.state["y1"]
    block.scan(input=1000, ki=20.0)
    assert block.state["y1"] - before == pytest.approx(20.0 / C * 2000)


def test_output_rounds_halves_away_from_zero():
    """Kx = 1/4 and inputs of 1 move by a quarter, then by halves: 0.25, 0.75, 1.25 ..."""
    assert outputs_of(run("INTEGRATE", ki=kx(0.25)), [1, 1, 1, 1]) == [0, 1, 1, 2]
    assert outputs_of(run("INTEGRATE", ki=kx(0.25)), [2, 0, 0, 2]) == [1, 1, 1, 2]
    assert outputs_of(run("INTEGRATE", ki=kx(0.25)), [-2, 0, 0, -2]) == [-1, -1, -1, -2]


def test_c_is_1_9835_over_t():
    assert pytest.approx(1.9835, abs=5e-5) == C * 0.0055
    assert pytest.approx(0.99179, rel=1e-4) == C * 0.0055 / 2
    assert math.isclose(C, mapping_constant(0.0055, math.pi / 0.055))


@pytest.mark.parametrize(
    ("ticks", "tick_ns"), [(1, TICK), (2, TICK), (4, TICK), (10, TICK), (1, 500_000), (20, 10_000_000)]
)
@pytest.mark.parametrize(("ki", "speed", "of"), [(0.59507, 2000, 1200.0), (0.99179, 1000, 1000.0), (0.99179, 0, 0.0)])
def test_counts_a_second_of_section_42_3_over_ten_seconds(ki, speed, of, ticks, tick_ns):
    """KI = 0.99179 y / x, whatever TICKS; from -6000 on, so that 12000 counts stay in the range of section 51."""
    block = run("INTEGRATE", ticks * tick_ns, ki=ki)
    block.scan(input=speed, reset=True, initial_value=-6000)
    scans = round(10e9 / (ticks * tick_ns))
    outputs = outputs_of(block, [speed] * scans)
    seconds = scans * ticks * tick_ns / 1e9
    assert (outputs[-1] + 6000) / seconds == pytest.approx(of, abs=1)
    middle = scans // 2
    assert (outputs[middle - 1] + 6000) / (middle * ticks * tick_ns / 1e9) == pytest.approx(of, abs=1)


@pytest.mark.parametrize(
    ("share", "span"), [(0.124996, 8191), (0.12500001, 16383), (0.249992, 16383), (0.25000001, 32767)]
)
def test_range_of_section_51_at_the_coefficients_printed(share, span):
    assert outputs_of(run("INTEGRATE", ki=kx(share)), [32767] * 50)[-1] == span


def test_first_scan_starts_at_rest():
    assert run("INTEGRATE", ki=10.0).scan(input=3000)["output"] == round(10.0 / C * 3000)


def test_a_smaller_gain_limits_the_output_on_the_next_scan():
    block = run("INTEGRATE")
    for _ in range(20):
        block.scan(input=32767, ki=kx(0.3))
    assert block.scan(input=0, ki=kx(0.2))["output"] == 16383
    assert block.scan(input=0, ki=kx(0.1))["output"] == 8191


def test_a_constant_input_integrates_like_a_variable():
    block = run("INTEGRATE", ki=0.59507, input=2000)
    assert [block.scan()["output"] for _ in range(50)] == outputs_of(run("INTEGRATE", ki=0.59507), [2000] * 50)
