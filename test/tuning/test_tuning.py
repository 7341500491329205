"""What coefficients mean at a scan period: limits as numbers, closeness, corners, section 51, the KI of 42.3."""

import math

import pytest
from blocks.support import mapping_constant, repeatable, run
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize, signal

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.tuning.integrate_rate import RATE_FACTOR, Rate, RateFault, rate_gain, rate_limits
from automax_ros.tuning.tuning import (
    LimitVerdict,
    range_of,
    tuning,
    verdict_of,
)

TICK_S = 0.0055


def limits_of(name, period_s, **given):
    found = tuning(CATALOGUE[name], period_s, given).limits
    return {item.parameter: item for item in found}


@pytest.mark.parametrize("ticks", [1, 4, 10])
@pytest.mark.parametrize("name", ["LAG", "DIFF_LAG"])
def test_limits_are_the_manuals_numbers(name, ticks):
    """41.1, 41.2, 43.1, 43.2: the constants are printed for a tick of 5.5 ms."""
    found = limits_of(name, ticks * TICK_S, WLG=10.0)
    assert found["WM"].low == pytest.approx(0.0013872 / ticks, rel=2e-4)
    assert found["WM"].high == pytest.approx(253.866 / ticks, rel=1e-5)
    assert found["WLG"].low == pytest.approx(0.00137573 / ticks, rel=1e-4)
    assert found["WLG"].high == pytest.approx(256.055 / ticks, rel=1e-4)


def test_limits_of_the_other_blocks():
    period = 0.022
    integrate = limits_of("INTEGRATE", period, KI=1.0)
    assert (integrate["WM"].low, integrate["WM"].high) == (0.01, pytest.approx(0.9 * math.pi / period))
    assert integrate["KI"].low == pytest.approx(0.00137573 / 4, rel=1e-4)
    lead_lag = limits_of("LEAD_LAG", period, WLD=1.0, WLG=5.0)
    assert [item.high for item in lead_lag.values()] == [pytest.approx(2 * math.pi / 4.5 / period)] * 3
    prop_int = limits_of("PROP_INT", period, KP=4.0, WLD=1.0)
    assert prop_int["WLD"].low == pytest.approx(2**-18 / 4.0 * 1.9835 / period, rel=1e-4)
    assert (prop_int["KP"].low, prop_int["KP"].high) == (0.001, 128.0)
    notch = limits_of("NOTCH", period, WN=10.0, Q_FACTOR=2.0)
    assert notch["WN"].high == pytest.approx(2 * math.pi / 10 / period)
    for order, factor in ((1, 0.000004), (2, 0.02), (3, 0.1)):
        for name, frequency in (("HIGH_PASS_FILTER", "WLD"), ("LOW_PASS_FILTER", "WLG")):
            found = limits_of(name, 0.01, **{frequency: 50.0, "ORDER": order})[frequency]
            assert (found.low, found.high) == (pytest.approx(factor / 0.01), pytest.approx(0.999 * math.pi / 0.01))


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (0.9999, LimitVerdict.BELOW),
        (1.0, LimitVerdict.NEAR_LOW),
        (1.0999, LimitVerdict.NEAR_LOW),
        (1.11, LimitVerdict.WITHIN),
        (50.0, LimitVerdict.WITHIN),
        (89.9, LimitVerdict.WITHIN),
        (90.2, LimitVerdict.NEAR_HIGH),
        (100.0, LimitVerdict.NEAR_HIGH),
        (100.1, LimitVerdict.ABOVE),
    ],
)
def test_near_is_within_a_tenth_of_the_limit(value, verdict):
    assert verdict_of(value, 1.0, 100.0) is verdict


def test_near_between_close_limits_is_a_tenth_of_the_room_and_zero_has_no_scale():
    assert [verdict_of(value, 110.0, 124.0) for value in (111.0, 114.0, 123.0)] == [
        LimitVerdict.NEAR_LOW,
        LimitVerdict.WITHIN,
        LimitVerdict.NEAR_HIGH,
    ]
    assert verdict_of(0.0, 0.0, 1e18) is LimitVerdict.WITHIN


@pytest.mark.parametrize(
    ("value", "low", "high", "verdict"),
    [
        (1.0, None, 2.0, LimitVerdict.UNKNOWN),
        (1.9, None, 2.0, LimitVerdict.NEAR_HIGH),
        (2.1, None, 2.0, LimitVerdict.ABOVE),
        (5.0, 2.0, None, LimitVerdict.UNKNOWN),
        (2.1, 2.0, None, LimitVerdict.NEAR_LOW),
        (1.9, 2.0, None, LimitVerdict.BELOW),
        (1.9, None, None, LimitVerdict.UNKNOWN),
    ],
)
def test_each_side_that_is_known_is_judged(value, low, high, verdict):
    assert verdict_of(value, low, high) is verdict


@pytest.mark.parametrize(
    ("wld", "verdict"),
    [
        (1e6, LimitVerdict.ABOVE),
        (125.0, LimitVerdict.NEAR_HIGH),
        (-5.0, LimitVerdict.BELOW),
        (1e-6, LimitVerdict.BELOW),
        (1e-5, LimitVerdict.UNKNOWN),
    ],
)
def test_value_beside_one_that_is_not_known_is_judged_as_far_as_that_goes(wld, verdict):
    """KP reaches 128 at most: WLD's low limit is 2.7E-6 at least, whatever KP is."""
    found = tuning(CATALOGUE["PROP_INT"], 0.022, {"KP": None, "WLD": wld})
    assert {item.parameter: item.verdict for item in found.limits}["WLD"] is verdict


def test_limits_that_cross_leave_the_high_one():
    found = limits_of("INTEGRATE", 300.0, KI=0.005, WM=0.02)["WM"]
    assert (found.low, found.high, found.crossed) == (found.high, pytest.approx(0.9 * math.pi / 300), True)
    assert not limits_of("INTEGRATE", 200.0, KI=0.005, WM=0.01)["WM"].crossed


def test_a_real_nearest_to_a_limit_is_the_limit():
    """WLG = 0.71 C of 24 bits may lie above 0.71 C, and is taken."""
    high = limits_of("LAG", 0.022, WLG=1.0)["WLG"].high
    assert limits_of("LAG", 0.022, WLG=float(f"{high:.9g}"))["WLG"].verdict in (
        LimitVerdict.NEAR_HIGH,
        LimitVerdict.ABOVE,
    )
    assert limits_of("LAG", 0.022, WLG=high)["WLG"].verdict is LimitVerdict.NEAR_HIGH


def test_value_that_is_not_known_leaves_the_limits():
    found = tuning(CATALOGUE["PROP_INT"], 0.022, {"KP": 2.0, "WLD": None})
    assert (found.missing, found.transfer, found.corners, found.integrator) == (("WLD",), None, (), None)
    by_name = {item.parameter: item for item in found.limits}
    assert by_name["WLD"].verdict is LimitVerdict.UNKNOWN
    assert by_name["WLD"].low == pytest.approx(2**-18 / 2.0 * mapping_constant(0.022))
    found = tuning(CATALOGUE["PROP_INT"], 0.022, {"KP": None, "WLD": 1.0})
    by_name = {item.parameter: item for item in found.limits}
    assert by_name["WLD"].low is None
    assert by_name["WLD"].high == pytest.approx(0.9 * math.pi / 0.022)


def test_variable_beyond_its_limits_is_shown_with_the_limit_in_force():
    found = tuning(CATALOGUE["LAG"], 0.022, {"WLG": 500.0})
    assert found.moved == ("WLG",)
    assert found.values["WLG"] == pytest.approx(256.055 / 4, rel=1e-4)
    assert [item.verdict for item in found.limits] == [LimitVerdict.WITHIN, LimitVerdict.ABOVE]
    block = run("LAG", 22_000_000)
    block.scan(input=0, wlg=500.0)
    assert found.coefficients == block.coefficients


@pytest.mark.parametrize(
    ("wld", "wlg", "verdict"),
    [
        (1.0, 2.1, LimitVerdict.NEAR_LOW),
        (2.1, 1.0, LimitVerdict.NEAR_LOW),
        (1.0, 5.0, LimitVerdict.WITHIN),
        (19.0, 1.0, LimitVerdict.NEAR_HIGH),
        (1.0, 21.0, LimitVerdict.ABOVE),
        (1.0, 1.5, LimitVerdict.BELOW),
    ],
)
def test_ratio_of_lead_lag(wld, wlg, verdict):
    """44.1: 2:1 to 20:1, either way."""
    found = tuning(CATALOGUE["LEAD_LAG"], 0.0055, {"WLD": wld, "WLG": wlg})
    assert found.ratio.value == pytest.approx(max(wld, wlg) / min(wld, wlg))
    assert found.ratio.verdict is verdict
    assert (found.moved == ()) is (verdict not in (LimitVerdict.ABOVE, LimitVerdict.BELOW))


@pytest.mark.parametrize(
    ("kx", "counts", "edge"),
    [
        (2**-18, 8191, None),
        (0.112, 8191, None),
        (0.1126, 8191, 0.125),
        (0.124996, 8191, 0.125),
        (0.125, 16383, 0.125),
        (0.138, 16383, None),
        (0.226, 16383, 0.25),
        (0.25, 32767, 0.25),
        (0.3, 32767, None),
    ],
)
def test_ranges_of_section_51(kx, counts, edge):
    found = range_of(kx, "WLG / C")
    assert (found.counts, found.near_edge) == (counts, edge)


@pytest.mark.parametrize(
    ("name", "given", "kx"),
    [
        ("LAG", {"WLG": 10.0}, 10.0),
        ("DIFF_LAG", {"WLG": 60.0}, 60.0),
        ("INTEGRATE", {"KI": 7.0}, 7.0),
        ("PROP_INT", {"KP": 3.0, "WLD": 5.0}, 15.0),
        ("INTEGRATE", {"KI": 7.0, "WM": 3.0}, 7.0),
    ],
)
def test_integrator_coefficient_is_what_the_block_runs_with(name, given, kx):
    period = 0.022
    found = tuning(CATALOGUE[name], period, given)
    assert found.integrator.kx == pytest.approx(kx / mapping_constant(period, given.get("WM")))
    assert found.integrator.counts == found.coefficients["span"]
    if name in ("INTEGRATE", "PROP_INT"):
        assert found.integrator.kx == found.coefficients["gain" if name == "INTEGRATE" else "integral"]


def test_corners_bend():
    """At a corner Laplace's gain is 1/sqrt 2 (or sqrt 2 for a lead); the mapping moves it to 2/T atan(w/C)."""
    (corner,) = tuning(CATALOGUE["LAG"], 0.022, {"WLG": 60.0}).corners
    assert abs(corner.laplace) == pytest.approx(math.sqrt(0.5))
    assert corner.hz == pytest.approx(60.0 / 2 / math.pi)
    assert corner.time_constant_s == pytest.approx(1 / 60)
    found = tuning(CATALOGUE["LAG"], 0.022, {"WLG": 60.0})
    assert abs(found.transfer.discrete_response(corner.mapped_rad_s)) == pytest.approx(math.sqrt(0.5))
    assert corner.warping == pytest.approx(corner.mapped_rad_s / 60.0 - 1)
    (corner,) = tuning(CATALOGUE["INTEGRATE"], 0.022, {"KI": 3.0}).corners
    assert corner.rad_s == 3.0
    assert abs(corner.laplace) == pytest.approx(1.0)


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("q", [0.5, 3.0, 100.0])
def test_notch_takes_3_db_at_its_edges(order, q):
    found = tuning(CATALOGUE["NOTCHN"], 0.0005, {"WN": 700.0, "Q_FACTOR": q, "ORDER": order})
    low, middle, high = found.corners
    assert [abs(edge.laplace) for edge in (low, high)] == [pytest.approx(math.sqrt(0.5))] * 2
    assert low.rad_s < middle.rad_s == 700.0 < high.rad_s
    assert abs(middle.laplace) == pytest.approx(0.0, abs=1e-9)
    assert middle.warping == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("given", "corners"),
    [
        ({"KP": 2.0, "KI": 1.0, "KD": 0.05}, {"KI/KP": 0.5, "KP/KD": 40.0}),
        ({"KP": 2.0, "KI": 1.0, "KD": 0.05, "ISA": 1.0}, {"KI": 1.0, "1/KD": 20.0}),
        ({"KP": 0.0, "KI": 3.0}, {"unity gain, KI": 3.0}),
        ({"KP": 2.0, "KI": 0.0}, {}),
        ({"KP": 0.0, "KI": 0.0}, {}),
    ],
)
def test_corners_of_pid(given, corners):
    found = tuning(CATALOGUE["PID"], 0.022, {**given, "LOOP_TIME": 0.044})
    assert {item.name: pytest.approx(item.rad_s) for item in found.corners} == corners
    assert all(item.mapped_rad_s is None for item in found.corners)
    assert found.period_s == 0.044
    assert found.nyquist_rad_s == pytest.approx(math.pi / 0.044)


def test_corner_above_nyquist_has_no_discrete_gain():
    found = tuning(CATALOGUE["PID"], 0.022, {"KP": 10.0, "KI": 0.0, "KD": 0.01, "LOOP_TIME": 0.022})
    assert [item.discrete for item in found.corners] == [None]


def test_corner_of_thermal_overload():
    """36.1: wlg = ln((LIM_BAR**2 - 100**2) / (LIM_BAR**2 - THRESHOLD**2)) / TRIP_TIME, mapped with C = 2 / T."""
    given = {"LIM_BAR": 150.0, "THRESHOLD": 114.0, "TRIP_TIME": 60.0}
    found = tuning(CATALOGUE["THERMAL_OVERLOAD"], 0.01, given)
    (corner,) = found.corners
    expected = math.log((150**2 - 100**2) / (150**2 - 114**2)) / 60.0
    assert corner.rad_s == pytest.approx(expected)
    assert found.transfer.mapping == pytest.approx(200.0)
    assert found.transfer.b[0] == pytest.approx(found.coefficients["gain"])
    assert -found.transfer.a[1] == pytest.approx(1.0 - 2.0 * found.coefficients["gain"])
    beyond = tuning(CATALOGUE["THERMAL_OVERLOAD"], 0.01, {**given, "LIM_BAR": 500.0})
    assert {item.parameter: item.verdict for item in beyond.limits}["LIM_BAR"] is LimitVerdict.ABOVE
    assert beyond.values["LIM_BAR"] == 400.0


@repeatable
@given(
    name=st.sampled_from(["LAG", "DIFF_LAG", "LEAD_LAG", "INTEGRATE", "PROP_INT"]),
    share=st.floats(0.01, 0.3),
    wm_share=st.none() | st.floats(0.01, 0.4),
    ticks=st.integers(1, 40),
)
def test_discrete_function_is_scipys_bilinear_one(name, share, wm_share, ticks):
    period = ticks * TICK_S
    wm = None if wm_share is None else wm_share * 2 * math.pi / period / 2
    c = mapping_constant(period, wm)
    w = share / period
    given, numerator, denominator = {
        "LAG": ({"WLG": w}, [1.0], [1 / w, 1.0]),
        "DIFF_LAG": ({"WLG": w}, [1 / w, 0.0], [1 / w, 1.0]),
        "LEAD_LAG": ({"WLD": w, "WLG": 3 * w}, [1 / w, 1.0], [1 / (3 * w), 1.0]),
        "INTEGRATE": ({"KI": w}, [w], [1.0, 0.0]),
        "PROP_INT": ({"KP": 2.0, "WLD": w}, [2.0, 2.0 * w], [1.0, 0.0]),
    }[name]
    if wm is not None:
        given["WM"] = wm
    found = tuning(CATALOGUE[name], period, given).transfer
    b, a = signal.bilinear(numerator, denominator, fs=c / 2)
    at = [share * math.pi / period for share in (0.001, 0.1, 0.5, 0.9)]
    _, expected = signal.freqz(b, a, worN=[w * period for w in at])
    assert [found.discrete_response(w) for w in at] == pytest.approx(list(expected), rel=1e-7)


def test_helper_of_42_3():
    """1200 counts/s at 2000: the manual's .59507, whose 0.99179 is 3 in 100,000 too large."""
    assert pytest.approx(1.9835 / 2, rel=2e-5) == RATE_FACTOR
    assert pytest.approx(0.99179, rel=5e-5) == RATE_FACTOR
    assert rate_gain(1200, 2000) == pytest.approx(0.59507, rel=5e-5)


@pytest.mark.parametrize("ticks", [1, 4, 20])
def test_integrate_with_that_ki_gains_so_many_counts_a_second(ticks):
    period_ns = ticks * 5_500_000
    block = run("INTEGRATE", period_ns, ki=rate_gain(1200, 2000))
    block.scan(input=2000)
    start = block.state["y1"]
    scans = round(3.0 * 1e9 / period_ns)
    for _ in range(scans):
        block.scan(input=2000)
    assert (block.state["y1"] - start) / (scans * period_ns / 1e9) == pytest.approx(1200, rel=1e-9)


def test_limits_of_that_ki():
    low, high = rate_limits(4 * TICK_S)
    found = limits_of("INTEGRATE", 4 * TICK_S, KI=1.0)["KI"]
    assert (low, high) == (pytest.approx(found.low), pytest.approx(found.high))


def test_notch_edges_by_search():
    """The edges again, found on the Laplace function by a root search."""
    found = tuning(CATALOGUE["NOTCH"], 0.0055, {"WN": 30.0, "Q_FACTOR": 4.0})

    def excess(w):
        return abs(found.transfer.laplace_response(w)) - math.sqrt(0.5)

    assert found.corners[0].rad_s == pytest.approx(optimize.brentq(excess, 10.0, 29.9))
    assert found.corners[2].rad_s == pytest.approx(optimize.brentq(excess, 30.1, 90.0))


@pytest.mark.parametrize(("y", "x"), [(math.nan, 10.0), (10.0, math.inf)])
def test_a_rate_is_made_of_numbers(y, x):
    with pytest.raises(RateFault, match="both must be numbers"):
        Rate.of(y, x, None)
