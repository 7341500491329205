"""LEAD_LAG (44): (1 + s/WLD) / (1 + s/WLG) with WLD and WLG 2 to 20 times apart."""

import math

import numpy as np
import pytest
from language.check_support import errors_of, one, task
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import TICK, changed, filtered, mapping_constant, outputs_of, run, signals

C = mapping_constant(0.0055)
HIGH = 2 * math.pi / (4.5 * 0.0055)
ROUNDED = 0.5 + 1e-6
LIMITED = 7004


def reference(wld, wlg, inputs, c=C):
    return np.clip(filtered([1 / wld, 1.0], [1 / wlg, 1.0], c, inputs), -32768, 32767)


def in_force(block, pair, **variables):
    """Whether the block, held in RESET before, then filters a step as with this pair of WLD and WLG."""
    block.scan(input=0, reset=True, **variables)
    outputs = [block.scan(input=3000, **variables)["output"] for _ in range(40)]
    return bool(np.max(np.abs(outputs - reference(*pair, [0] + [3000] * 40)[1:])) < ROUNDED)


@pytest.mark.parametrize("name", ["steps", "sine", "noise"])
@pytest.mark.parametrize(
    ("share", "ratio", "amplitude"),
    [
        (0.001, 2, 30000),
        (0.01, 1 / 20, 30000),
        (0.05, 1 / 2, 32767),
        (0.3, 20, 32767),
        (0.7, 2.0001, 32767),
        (0.7, 5, 20),
    ],
)
@pytest.mark.parametrize("period_ns", [500_000, TICK, 22_000_000, 55_000_000])
def test_against_scipy(period_ns, share, ratio, amplitude, name):
    """``share`` is WLD / C, ``ratio`` WLD : WLG. A gain above 1 clamps the output of a full input, not the state."""
    c = mapping_constant(period_ns / 1e9)
    wld = share * c
    inputs = np.trunc(signals(amplitude)[name])
    expected = reference(wld, wld / ratio, inputs, c)
    outputs = outputs_of(run("LEAD_LAG", period_ns, wld=wld, wlg=wld / ratio), inputs)
    assert np.max(np.abs(outputs - expected)) < ROUNDED


@pytest.mark.parametrize("wm", [0.001, 20.0, 253.0])
def test_against_scipy_with_a_mapping_frequency(wm):
    c = mapping_constant(0.0055, wm)
    inputs = np.trunc(signals(8000)["sine"])
    outputs = outputs_of(run("LEAD_LAG", wld=8.0, wlg=30.0, wm=wm), inputs)
    assert np.max(np.abs(outputs - reference(8.0, 30.0, inputs, c))) < ROUNDED


@pytest.mark.parametrize(("wld", "wlg"), [(0.001, 0.002), (0.002, 0.001), (HIGH, HIGH / 2), (HIGH / 2, HIGH)])
@pytest.mark.parametrize("name", ["steps", "noise"])
def test_against_scipy_at_the_limits(wld, wlg, name):
    inputs = np.trunc(signals(10000)[name])
    outputs = outputs_of(run("LEAD_LAG", wld=wld, wlg=wlg), inputs)
    assert np.max(np.abs(outputs - reference(wld, wlg, inputs))) < ROUNDED


@pytest.mark.parametrize(("wld", "wlg"), [(20.0, 5.0), (5.0, 20.0), (100.0, 5.0), (5.0, 100.0)])
@pytest.mark.parametrize("value", [32767, -32768, 1, -1, 4095])
def test_settles_on_its_input_exactly(wld, wlg, value):
    outputs = outputs_of(run("LEAD_LAG", wld=wld, wlg=wlg), [value] * 2000)
    assert outputs[-500:] == [value] * 500


def test_first_scan_starts_at_rest():
    """b0 = (1 + C/WLD) / (1 + C/WLG)."""
    b0 = (1 + C / 5.0) / (1 + C / 20.0)
    assert run("LEAD_LAG", wld=5.0, wlg=20.0).scan(input=1000)["output"] == round(1000 * b0)


def test_the_clamp_of_the_output_leaves_the_state():
    """A lead of 20 kicks far beyond 16 bits; what follows is the filter's own decay, not that from the clamp."""
    outputs = outputs_of(run("LEAD_LAG", wld=1.0, wlg=20.0), [20000] * 60)
    expected = filtered([1.0, 1.0], [1 / 20.0, 1.0], C, [20000] * 60)
    assert expected[0] > 300_000
    assert outputs[0] == outputs[10] == 32767
    assert np.max(np.abs(outputs - np.clip(expected, -32768, 32767))) < ROUNDED


def test_reset_holds_initial_value_and_the_output_moves_on_from_there():
    block = run("LEAD_LAG", wld=20.0, wlg=5.0)
    outputs_of(block, [3000] * 50)
    for value in (0, 5000, -700):
        assert block.scan(input=value, reset=True, initial_value=1000) == {"output": 1000}
    b, a = signal.bilinear([1 / 20.0, 1.0], [1 / 5.0, 1.0], fs=C / 2)
    state = signal.lfiltic(b, a, [1000.0], [-700.0])
    expected, _ = signal.lfilter(b, a, [-700.0] * 10 + [2500.0] * 200, zi=state)
    assert abs(expected[0] - 1000) < 100
    outputs = outputs_of(block, [-700] * 10 + [2500] * 200)
    assert np.max(np.abs(outputs - expected)) < ROUNDED


def test_changed_frequencies_act_on_the_histories():
    block = run("LEAD_LAG")
    inputs = np.trunc(signals(3000, 400)["sine"])
    outputs = [
        block.scan(input=int(value), wld=5.0 if n < 200 else 60.0, wlg=20.0)["output"] for n, value in enumerate(inputs)
    ]
    before, after = (signal.bilinear([1 / wld, 1.0], [1 / 20.0, 1.0], fs=C / 2) for wld in (5.0, 60.0))
    assert np.max(np.abs(outputs - changed(before, after, inputs))) < ROUNDED


def test_a_settled_output_stays_when_the_frequencies_change():
    block = run("LEAD_LAG")
    for _ in range(3000):
        block.scan(input=5000, wld=2.0, wlg=10.0)
    assert block.outputs == {"output": 5000}
    assert block.scan(input=5000, wld=100.0, wlg=10.0) == {"output": 5000}


@pytest.mark.parametrize(
    ("wld", "wlg", "good"),
    [
        ("10.0", "20.0", True),
        ("20.0", "10.0", True),
        ("1.0", "20.0", True),
        ("20.0", "1.0", True),
        ("10.0", "19.99998", False),
        ("19.99998", "10.0", False),
        ("1.0", "20.00002", False),
        ("20.00002", "1.0", False),
        ("10.0", "10.0", False),
        ("0.002", "200.0", False),
    ],
)
def test_ratio_of_literals(wld, wlg, good):
    text = task(f"CALL LEAD_LAG(INPUT=A%, WLD={wld}, WLG={wlg}, OUTPUT=B%)", declare="LOCAL A%, B%")
    if good:
        assert errors_of(text, tick_ns=1_000_000) == []
        run("LEAD_LAG", wld=float(wld), wlg=float(wlg))
        return
    found = one(text, tick_ns=1_000_000)
    assert found.code == "AMX4084"
    assert "20" in found.message
    assert "2:1" in found.message or "2 to" in found.message
    with pytest.raises(InstanceError):
        run("LEAD_LAG", wld=float(wld), wlg=float(wlg))


def test_a_refused_pair_leaves_the_last_acceptable_one_in_force_and_is_logged_once():
    block = run("LEAD_LAG")
    errors = []
    for wld, wlg in ((10.0, 40.0), (10.0, 10.0), (10.0, 10.0), (10.0, 11.0), (9.0, 27.0), (1.0, 27.0), (1.0, 27.0)):
        block.scan(input=0, wld=wld, wlg=wlg)
        errors.append(block.error)
    assert errors == [0, LIMITED, 0, 0, 0, LIMITED, 0]


@pytest.mark.parametrize("bad", [(10.0, 10.0), (10.0, 15.0), (1.0, 30.0), (90.0, 4.0), (39.0, 40.0)])
def test_the_last_acceptable_pair_filters_on(bad):
    block = run("LEAD_LAG")
    block.scan(input=0, wld=10.0, wlg=40.0)
    assert in_force(block, (10.0, 40.0), wld=bad[0], wlg=bad[1])
    assert in_force(block, (40.0, 10.0), wld=40.0, wlg=10.0)
    assert in_force(block, (40.0, 10.0), wld=bad[0], wlg=bad[1])


@pytest.mark.parametrize(
    ("given", "pair"),
    [
        ((18.0, 10.0), (20.0, 10.0)),
        ((6.0, 10.0), (5.0, 10.0)),
        ((250.0, 10.0), (200.0, 10.0)),
        ((0.3, 10.0), (0.5, 10.0)),
    ],
)
def test_a_first_pair_out_of_ratio_is_moved_to_the_nearest_acceptable_ratio(given, pair):
    """By way of WLD."""
    block = run("LEAD_LAG")
    block.scan(input=0, wld=given[0], wlg=given[1])
    assert block.error == LIMITED
    assert in_force(block, pair, wld=given[0], wlg=given[1])
    assert block.error == 0


@pytest.mark.parametrize(
    ("given", "ratio"), [((253.0, 140.0), 2.0), ((0.001, 0.0015), 0.5), ((0.0015, 0.001), 2.0), ((140.0, 253.0), 0.5)]
)
def test_a_first_pair_moved_stays_within_the_limits_of_each(given, ratio):
    """Where WLD would leave its limits WLG is moved."""
    block = run("LEAD_LAG")
    block.scan(input=0, wld=given[0], wlg=given[1])
    assert block.error == LIMITED
    pairs = [(ratio * given[1], given[1]), (given[0], given[0] / ratio)]
    inside = [pair for pair in pairs if all(0.001 <= value <= HIGH for value in pair)]
    assert in_force(block, inside[0], wld=given[0], wlg=given[1])


def test_a_first_pair_moved_is_no_acceptable_pair_to_stay_with():
    """The next acceptable pair takes over."""
    block = run("LEAD_LAG")
    block.scan(input=0, wld=18.0, wlg=10.0)
    assert in_force(block, (50.0, 10.0), wld=50.0, wlg=10.0)


def test_a_variable_frequency_is_limited_before_the_ratio_is_taken():
    """WLD 0 counts as 0.001: 0.001 : 0.01 is acceptable."""
    block = run("LEAD_LAG")
    block.scan(input=0, wld=0.0, wlg=0.01)
    assert block.error == LIMITED
    assert in_force(block, (0.001, 0.01), wld=0.0, wlg=0.01)
