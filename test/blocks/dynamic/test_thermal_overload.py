"""THERMAL_OVERLOAD (section 36): the model of the motor's temperature, its trip time, its limits."""

from itertools import product
from math import ceil, log

import numpy as np
import pytest

from blocks.support import filtered, run

MS = 1_000_000
LIMITED = 7004
FULL = 4095
"""Counts of I_FDBK at LIM_BAR percent."""


def counts(percent, lim_bar):
    """I_FDBK at a percentage of motor current, the nearest count."""
    return round(FULL * percent / lim_bar)


def frequency(lim_bar, threshold, trip_time):
    """Wlg of section 36.1 in rad/s."""
    return log((lim_bar**2 - 100**2) / (lim_bar**2 - threshold**2)) / trip_time


def expected_rise(currents, period_s, lim_bar=150, threshold=114, trip_time=60):
    """CALC_RISE before it is rounded, by scipy: I_FDBK**2 / SCALE through a bilinear low pass with C = 2 / T."""
    wlg = frequency(lim_bar, threshold, trip_time)
    scale = (FULL / lim_bar) ** 2 * 10
    return filtered([1.0], [1.0 / wlg, 1.0], 2 / period_s, np.asarray(currents, dtype=float) ** 2 / scale)


def settled(block, percent, lim_bar=150):
    """Let a block run at a percentage of motor current until its rise stands; return the rise."""
    before = None
    while before != block.state:
        before = dict(block.state)
        for _ in range(1000):
            block.scan(i_fdbk=counts(percent, lim_bar))
    return block.outputs["calc_rise"]


def seconds_to_trip(period_ns, lim_bar, threshold, trip_time):
    """Time from steady 100 % and a step to LIM_BAR until OVERLOAD."""
    block = run("THERMAL_OVERLOAD", period_ns, lim_bar=lim_bar, threshold=threshold, trip_time=trip_time)
    while block.outputs["calc_rise"] < 1000:
        block.scan(i_fdbk=FULL)
    for _ in range(5):
        block.scan(i_fdbk=counts(100, lim_bar))
    assert block.outputs["calc_rise"] in (1000, 1001, 1002)
    assert not block.outputs["overload"]
    scans = 0
    while not block.outputs["overload"]:
        block.scan(i_fdbk=FULL)
        scans += 1
        assert scans * period_ns < 2e9 * trip_time
    return scans * period_ns / 1e9


CORNERS = [
    (trip, bar, threshold)
    for trip, bar, threshold in product((10, 60, 120), (115, 150, 200, 400), (110, 114, 124))
    if bar > threshold
]


@pytest.mark.parametrize(
    ("trip_time", "lim_bar", "threshold"),
    [(60, 150, 114), (10, 115, 114), (10, 400, 110), (120, 400, 124), (60, 200, 110)],
)
def test_trips_in_trip_time(trip_time, lim_bar, threshold):
    """TICKS = 20 of 0.5 ms."""
    assert seconds_to_trip(10 * MS, lim_bar, threshold, trip_time) == pytest.approx(trip_time, rel=0.01)


def test_trips_in_trip_time_at_the_shortest_udc_scan():
    assert seconds_to_trip(MS // 2, 150, 114, 10) == pytest.approx(10, rel=0.01)


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.parametrize("period_ns", [MS // 2, 2 * MS, 10 * MS, 20 * MS])
@pytest.mark.parametrize(("trip_time", "lim_bar", "threshold"), CORNERS)
def test_trips_in_trip_time_over_all_corners(trip_time, lim_bar, threshold, period_ns):
    assert seconds_to_trip(period_ns, lim_bar, threshold, trip_time) == pytest.approx(trip_time, rel=0.01)


@pytest.mark.parametrize(("percent", "rise"), [(50, 250), (100, 1000), (110, 1210)])
def test_the_rise_stands_at_a_tenth_of_the_square_of_the_percentage(percent, rise):
    """The manual's example: 110 % gives 1210."""
    block = run("THERMAL_OVERLOAD", 100 * MS, trip_time=10)
    assert settled(block, percent) == rise
    assert not block.outputs["overload"]


def test_a_step_from_100_to_110_percent_moves_the_rise_from_1000_to_1210():
    block = run("THERMAL_OVERLOAD", 100 * MS, trip_time=10)
    assert settled(block, 100) == 1000
    rises = [block.scan(i_fdbk=counts(110, 150))["calc_rise"] for _ in range(10_000)]
    assert rises == sorted(rises)
    assert (rises[0], rises[-1]) == (1000, 1210)


def test_the_sign_of_the_current_does_not_matter():
    one, other = run("THERMAL_OVERLOAD", 10 * MS), run("THERMAL_OVERLOAD", 10 * MS)
    for scan in range(500):
        assert one.scan(i_fdbk=scan * 60) == other.scan(i_fdbk=-scan * 60)
    assert one.outputs["calc_rise"] > 100


@pytest.mark.parametrize("lim_bar", [115, 127, 150, 200, 333, 400])
@pytest.mark.parametrize("threshold", [110, 114, 124])
def test_never_trips_below_the_threshold_and_always_above(lim_bar, threshold):
    """At the largest current below THRESHOLD % and at a percent above it; the scan is long so that it settles soon."""
    if lim_bar <= threshold + 1:
        return
    literals = {"lim_bar": lim_bar, "threshold": threshold, "trip_time": 10}
    block = run("THERMAL_OVERLOAD", 1000 * MS, **literals)
    below = ceil(FULL * threshold / lim_bar) - 1
    for _ in range(20_000):
        block.scan(i_fdbk=below)
        assert not block.outputs["overload"]
    # The rise shown is rounded, so it may be a half count above what the current gives.
    assert abs(block.outputs["calc_rise"] - (below * lim_bar / FULL) ** 2 / 10) <= 0.5
    for _ in range(20_000):
        if block.scan(i_fdbk=counts(threshold + 1, lim_bar))["overload"]:
            return
    pytest.fail("no overload at a percent above the threshold")


def test_trips_above_the_threshold_and_ends_at_1000_not_above():
    """It trips on the rise before it is rounded: 1299.6 shows as 1300."""
    block = run("THERMAL_OVERLOAD", 10 * MS, trip_time=10)
    rows = [(block.scan(i_fdbk=10_000), block.state["y1"]) for _ in range(800)]
    assert all(row["overload"] == (rise > 1299.6) for row, rise in rows)
    assert any(row["overload"] for row, _ in rows)
    while block.outputs["calc_rise"] > 900:
        result = block.scan(i_fdbk=2000)
        assert result["overload"] == (result["calc_rise"] > 1000)
    rows = [(block.scan(i_fdbk=3200), block.state["y1"]) for _ in range(8000)]
    assert all(row["overload"] == (rise > 1299.6) for row, rise in rows)
    assert any(row == {"overload": False, "calc_rise": 1300} for row, _ in rows)


@pytest.mark.parametrize(("threshold", "limit"), [(110, 1210.0), (114, 1299.6), (123, 1512.9), (124, 1537.6)])
def test_the_rise_that_trips(threshold, limit):
    """More than the real THRESHOLD**2 / 10, before rounding."""
    block = run("THERMAL_OVERLOAD", 10 * MS, threshold=threshold, trip_time=120)
    rows = [(block.scan(i_fdbk=12_000)["overload"], block.state["y1"]) for _ in range(6000)]
    assert all(overload == (rise > limit) for overload, rise in rows)
    assert {overload for overload, _ in rows} == {False, True}


@pytest.mark.parametrize(
    ("current", "lim_bar", "threshold"),
    [(3591, 130, 114), (2457, 190, 114), (1155, 390, 110), (1287, 350, 110), (3003, 150, 110)],
)
@pytest.mark.parametrize("trip_time", [10, 120])
def test_exactly_the_threshold_never_trips(current, lim_bar, threshold, trip_time):
    """At THRESHOLD % itself there is no overload (36), however long it lasts; a count more is one."""
    assert current * lim_bar == threshold * FULL
    block = run("THERMAL_OVERLOAD", 2000 * trip_time * MS, lim_bar=lim_bar, threshold=threshold, trip_time=trip_time)
    for _ in range(3000):
        block.scan(i_fdbk=current)
    assert block.state["y1"] == pytest.approx(threshold**2 / 10, abs=1e-6)
    assert not block.outputs["overload"]
    for _ in range(3000):
        block.scan(i_fdbk=current + 1)
    assert block.outputs["overload"]


@pytest.mark.parametrize("period_ns", [MS // 2, 10 * MS])
def test_a_rise_just_below_its_end_does_not_creep_over_it(period_ns):
    """The rounding of each scan must not add up: the slowest filter there is, with its rise at the last bit below."""
    block = run("THERMAL_OVERLOAD", period_ns, lim_bar=390, threshold=110, trip_time=120)
    block.scan(i_fdbk=1155)
    steady = block.state["x1"]
    block.state["y1"] = steady
    for _ in range(5000):
        block.scan(i_fdbk=1155)
        assert block.state["y1"] <= steady
    assert not block.outputs["overload"]


def test_reset_clears_rise_and_overload():
    block = run("THERMAL_OVERLOAD", 10 * MS, trip_time=10)
    for _ in range(800):
        block.scan(i_fdbk=9000)
    assert block.outputs["overload"]
    for _ in range(3):
        assert block.scan(i_fdbk=3000, reset=True) == {"overload": False, "calc_rise": 0}
    fresh = run("THERMAL_OVERLOAD", 10 * MS, trip_time=10)
    for _ in range(300):
        assert abs(block.scan(i_fdbk=3000)["calc_rise"] - fresh.scan(i_fdbk=3000)["calc_rise"]) <= 1
    assert block.outputs["calc_rise"] > 50


@pytest.mark.parametrize("period_ns", [MS // 2, 10 * MS, 20 * MS])
@pytest.mark.parametrize("parameters", [{}, {"lim_bar": 115, "threshold": 110, "trip_time": 10}, {"lim_bar": 400}])
def test_against_scipy(period_ns, parameters):
    """A load that changes, with currents far beyond what the PMI gives so that the rise moves."""
    steps = np.random.default_rng(36).integers(-6000, 6000, 40)
    currents = [int(value) for value in np.repeat(steps, 150)]
    expected = expected_rise(currents, period_ns / 1e9, **parameters)
    block = run("THERMAL_OVERLOAD", period_ns, **parameters)
    for current, rise in zip(currents, expected, strict=True):
        assert abs(block.scan(i_fdbk=current)["calc_rise"] - rise) <= 0.5 + 1e-6


@pytest.mark.parametrize("current", [32767, -32768])
def test_the_largest_currents_do_not_overflow(current):
    block = run("THERMAL_OVERLOAD", 10 * MS, lim_bar=400, threshold=110, trip_time=10)
    rises = [block.scan(i_fdbk=current) for _ in range(20_000)]
    assert [row["calc_rise"] for row in rises] == sorted(row["calc_rise"] for row in rises)
    assert rises[-1] == {"overload": True, "calc_rise": 32767}


def logged_by(block, rows):
    """The problem that each scan logs."""
    numbers = []
    for row in rows:
        block.scan(i_fdbk=3000, **row)
        numbers.append(block.error)
    return numbers


OUT_OF_RANGE = [
    ("lim_bar", 114, 115, {"threshold": 110}),
    ("lim_bar", -32768, 115, {"threshold": 112}),
    ("lim_bar", 401, 400, {}),
    ("lim_bar", 32767, 400, {}),
    ("threshold", 109, 110, {}),
    ("threshold", 0, 110, {}),
    ("threshold", 125, 124, {}),
    ("trip_time", 9, 10, {}),
    ("trip_time", 0, 10, {}),
    ("trip_time", 121, 120, {}),
    ("trip_time", 32767, 120, {}),
]


@pytest.mark.parametrize(("name", "given", "limit", "others"), OUT_OF_RANGE)
@pytest.mark.parametrize("literal", [True, False])
def test_parameters_out_of_range_are_limited_and_logged_once(name, given, limit, others, literal):
    limited = run("THERMAL_OVERLOAD", 10 * MS, **others, **({name: given} if literal else {}))
    right = run("THERMAL_OVERLOAD", 10 * MS, **others, **{name: limit})
    errors = []
    for _ in range(400):
        shown = limited.scan(i_fdbk=9000, **({} if literal else {name: given}))
        errors.append(limited.error)
        assert shown == right.scan(i_fdbk=9000)
        assert right.error == 0
    assert errors == [LIMITED] + [0] * 399


@pytest.mark.parametrize(
    ("name", "low", "high"), [("lim_bar", 115, 400), ("threshold", 110, 124), ("trip_time", 10, 120)]
)
def test_both_ends_of_a_range_are_legal(name, low, high):
    others = {"threshold": 110} if name == "lim_bar" else {}
    assert logged_by(run("THERMAL_OVERLOAD", 10 * MS, **others), [{name: low}, {name: high}]) == [0, 0]


def test_leaving_the_range_again_is_logged_again():
    times = (60, 121, 121, 500, 120, 121, 60, 9, 8, 10, 9)
    expected = [0, LIMITED, 0, 0, 0, LIMITED, 0, LIMITED, 0, 0, LIMITED]
    assert logged_by(run("THERMAL_OVERLOAD", 10 * MS), [{"trip_time": time} for time in times]) == expected


def test_each_parameter_that_leaves_its_range_is_logged():
    rows = [{"trip_time": 60, "threshold": 114}, {"trip_time": 5, "threshold": 114}, {"trip_time": 5, "threshold": 5}]
    assert logged_by(run("THERMAL_OVERLOAD", 10 * MS), rows) == [0, LIMITED, LIMITED]


def same_heating(block, rows, **parameters):
    """Whether a block heats up as one with these parameters does."""
    right = run("THERMAL_OVERLOAD", 10 * MS, **parameters)
    return all(block.scan(i_fdbk=9000, **rows) == right.scan(i_fdbk=9000) for _ in range(200))


@pytest.mark.parametrize(
    ("pair", "in_force"),
    [((115, 115), (115, 114)), ((116, 120), (116, 115)), ((124, 124), (124, 123)), ((100, 115), (115, 114))],
)
def test_a_threshold_not_below_lim_bar_becomes_one_less(pair, in_force):
    """LIM_BAR is the scale of the current and always stays in force, limited (decision)."""
    given = {"lim_bar": pair[0], "threshold": pair[1]}
    right = {"lim_bar": in_force[0], "threshold": in_force[1]}
    assert same_heating(run("THERMAL_OVERLOAD", 10 * MS), given, **right)
    assert same_heating(run("THERMAL_OVERLOAD", 10 * MS, **given), {}, **right)
    assert logged_by(run("THERMAL_OVERLOAD", 10 * MS, **given), [{}, {}, {}]) == [LIMITED, 0, 0]
    assert logged_by(run("THERMAL_OVERLOAD", 10 * MS), [given] * 3) == [LIMITED, 0, 0]


def test_a_lim_bar_that_comes_down_to_the_threshold_moves_it():
    block = run("THERMAL_OVERLOAD", 10 * MS)
    good, bad = {"lim_bar": 130, "threshold": 124}, {"lim_bar": 120, "threshold": 124}
    assert logged_by(block, [good, bad, bad, good, bad]) == [0, LIMITED, 0, 0, LIMITED]
    block.scan(i_fdbk=0, reset=True, **bad)
    assert same_heating(block, {**bad, "trip_time": 60}, lim_bar=120, threshold=119)
