"""Limits of the coefficients (sections 41 to 51), at their edges from both sides."""

import math

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.coefficients import evaluate, integrator_range, limited
from automax_ros.blocks.declare.coefficients import mapping_constant as mapped
from automax_ros.core.numbers import stored_real
from blocks.support import mapping_constant, run

PERIODS = (0.0005, 0.0055, 0.010, 0.110, 5.5)


def inside(period):
    """Values within the limits at any WM and KP."""
    frequencies = {"WLG": 0.1 / period, "WLD": 1.4 / period, "WN": 0.5 / period}
    return {**frequencies, "KI": 0.1 / period, "KP": 1.0, "Q_FACTOR": 1.0, "LOOP_TIME": 1.0}


def edges():
    for block in CATALOGUE.values():
        if block.coefficients:
            for limit in block.coefficients.limits:
                for period in PERIODS:
                    yield pytest.param(block, limit, period, id=f"{block.name}-{limit.parameter}-{period}")


def parameters(block, limit, period, value):
    values = inside(period)
    if block.name == "LEAD_LAG":
        near = value if limit.parameter != "WM" else 0.1 / period
        partner = math.sqrt(10.0) if near < 0.3 / period else 1.0 / math.sqrt(10.0)
        other = min(max(near * partner, 0.001 * math.sqrt(10.0)), 0.4 / period)
        values.update({"WLD": other, "WLG": near if limit.parameter == "WM" else other})
    others = {name: values[name] for name in block.coefficients.parameters if name in values}
    return {**others, limit.parameter: value}


@pytest.mark.parametrize(("block", "limit", "period"), list(edges()))
def test_each_limit_at_its_edges_from_both_sides(block, limit, period):
    known = {**block.coefficients.defaults(period), **inside(period)}
    low, high = limit.low(period, known), limit.high(period, known)
    assert low < high
    for edge, outward in ((low, -math.inf), (high, math.inf)):
        outside = math.nextafter(edge, outward)
        at_edge, moved = evaluate(block, period, parameters(block, limit, period, edge))
        assert not moved
        assert evaluate(block, period, parameters(block, limit, period, outside)) == (at_edge, True)
        far = edge - 1e6 if outward < 0 else edge * 1e6
        assert limited(block.coefficients, period, parameters(block, limit, period, far))[0][limit.parameter] == edge
    assert evaluate(block, period, parameters(block, limit, period, (low + high) / 2))[1] is False


def test_the_real_nearest_to_a_limit_counts_as_the_limit():
    """0.01 as a REAL is 0.0099999998: neither a CALL that writes WM=0.01 nor one with a variable KI is at fault."""
    stored = stored_real(0.01)[0]
    assert stored < 0.01
    assert evaluate(CATALOGUE["INTEGRATE"], 0.0055, {"KI": 1.0, "WM": stored})[1] is False
    beyond = stored_real(stored - 1e-9)[0]
    assert beyond < stored
    assert evaluate(CATALOGUE["INTEGRATE"], 0.0055, {"KI": 1.0, "WM": beyond})[1] is True


TICKS = 4
T = TICKS * 0.0055


@pytest.mark.parametrize(
    ("name", "parameter", "low", "high"),
    [
        ("LAG", "WM", 0.0013872 / TICKS, 253.866 / TICKS),
        ("LAG", "WLG", 0.00137573 / TICKS, 256.055 / TICKS),
        ("INTEGRATE", "WM", 0.01, 0.9 * math.pi / T),
        ("INTEGRATE", "KI", 0.00137573 / TICKS, 0.9 * math.pi / T),
        ("PROP_INT", "WM", 2**-17 / T, 0.9 * math.pi / T),
        ("PROP_INT", "KP", 0.001, 128.0),
        ("PROP_INT", "WLD", 0.00137573 / TICKS / 2.0, 0.9 * math.pi / T),
    ],
)
def test_limits_are_the_numbers_that_the_manual_prints(name, parameter, low, high):
    """At a 5.5 ms tick, WM defaulted; KP = 2.0 for WLD."""
    block = CATALOGUE[name]
    limit = next(item for item in block.coefficients.limits if item.parameter == parameter)
    known = {**block.coefficients.defaults(T), "KP": 2.0}
    assert limit.low(T, known) == pytest.approx(low, rel=5e-5)
    assert limit.high(T, known) == pytest.approx(high, rel=2e-5)


def test_limits_follow_wm():
    known = {"WM": 100.0}
    limit = CATALOGUE["LAG"].coefficients.limits[1]
    assert limit.high(0.0055, known) == pytest.approx(0.71 * mapping_constant(0.0055, 100.0))
    assert limit.low(0.0055, known) == pytest.approx(2**-18 * mapping_constant(0.0055, 100.0))


def test_wld_is_limited_by_the_kp_in_force():
    """KP 0.0001 counts as 0.001, and the low limit of WLD is taken at that."""
    values, moved = limited(CATALOGUE["PROP_INT"].coefficients, 0.0055, {"KP": 0.0001, "WLD": 1e-9})
    assert moved == ["KP", "WLD"]
    assert values["WLD"] == pytest.approx(2**-18 * mapping_constant(0.0055) / 0.001)


def test_the_defaulted_wm_is_never_out_of_limits():
    """At 40 s a scan it lies below the 0.01 that 42.1 asks of a programmed one."""
    values, moved = limited(CATALOGUE["INTEGRATE"].coefficients, 40.0, {"KI": 0.01})
    assert values["WM"] < 0.01
    assert moved == []


@pytest.mark.parametrize(
    ("coefficient", "span"),
    [(2**-18, 8191), (0.124996, 8191), (0.125, 16383), (0.249992, 16383), (0.25, 32767), (5.0, 32767)],
)
def test_table_of_section_51(coefficient, span):
    assert integrator_range(coefficient) == span


def test_mapping_constant_maps_wm_onto_itself():
    """Warping is nil at WM: C tan(WM T / 2) = WM."""
    for wm in (0.1, 10.0, 400.0):
        assert mapped(wm, 0.0055) * math.tan(wm * 0.0055 / 2) == pytest.approx(wm)


@pytest.mark.parametrize("parameter", ["WLG", "KI", "WLD"])
@pytest.mark.parametrize("value", [0.0, -1.0, -1e18, 9.2e18])
def test_absurd_values_are_limited_not_carried(parameter, value):
    block = next(item for item in CATALOGUE.values() if item.coefficients and parameter in item.coefficients.parameters)
    limit = next(item for item in block.coefficients.limits if item.parameter == parameter)
    results, moved = evaluate(block, 0.0055, parameters(block, limit, 0.0055, value))
    assert moved
    assert all(math.isfinite(result) for result in results)


def test_a_variable_coefficient_is_logged_once_when_it_leaves_its_limits():
    block = run("LAG")
    errors = []
    for wlg in (5.0, 1e6, 1e6, 2e6, 5.0, 0.0, 5.0):
        block.scan(input=100, wlg=wlg)
        errors.append(block.error)
    assert errors == [0, 7004, 0, 0, 0, 7004, 0]


def test_a_limited_coefficient_acts_like_its_limit():
    limit = 0.71 * mapping_constant(0.0055)
    outside, at_limit = run("LAG"), run("LAG")
    for value in (1000, -2000, 3000):
        assert outside.scan(input=value, wlg=1e5) == at_limit.scan(input=value, wlg=limit)
