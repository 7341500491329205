"""Data of webs outside their ranges, lines that cannot be, and what nothing may change: length and balance."""

from dataclasses import asdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.plant import LoadData
from automax_ros.drive.web.chain import build_chains
from automax_ros.drive.web.data import Dancer, Roll, Roller, SurfaceData, WebData
from automax_ros.drive.web.signals import (
    END_KINDS,
    END_SIGNALS,
    END_UNITS,
    WEB_KINDS,
    WEB_SIGNALS,
    WEB_UNITS,
    end_signals_of,
    web_signals_of,
)
from drive.plants import MS, plant_of
from drive.support import repeatable
from drive.web.lines import line_of, roll, roller


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Roll(0.1, 0.15, 2.5, 90.0, 780.0), "core"),
        (lambda: Roll(1.0, 0.15, 2.5, 0.0, 780.0), "caliper"),
        (lambda: Roll(1.0, 0.15, float("nan"), 90.0, 780.0), "width"),
        (lambda: Roll(1.0, 0.15, 2.5, 90.0, 780.0, "left"), "top or bottom"),
        (lambda: Roller(0.0), "diameter"),
        (lambda: Roller(0.5, wrap_deg=90.0), "both or neither"),
        (lambda: SurfaceData(Roller(0.5), 0.001), "gear"),
        (lambda: SurfaceData(Roller(0.5), 1001.0), "gear"),
        (lambda: WebData(0.05, 2e5), "length"),
        (lambda: WebData(4.0, 2e10), "stiffness"),
        (lambda: WebData(4.0, 2e5, breaks_above_n=0.0), "breaks"),
        (lambda: WebData(1.0, 2e5, dancer=Dancer(600.0, 40.0, 400.0, 1.0)), "takes up"),
        (lambda: Dancer(600.0, 0.0, 400.0, 0.5), "mass"),
    ],
)
def test_values_outside_their_ranges(make, told):
    with pytest.raises(ParameterError, match=told):
        make()


@pytest.mark.parametrize(
    ("webs", "told"),
    [
        ({"W1": ("U", "X")}, "neither roll nor roller"),
        ({"W1": ("U", "Y")}, "neither roll nor roller"),
        ({"W1": ("U", "P"), "W2": ("U", "Q")}, "room for one"),
        ({"W1": ("P", "U"), "W2": ("U", "Q")}, "roll of U"),
        ({"W1": ("U", "P"), "W2": ("Q", "P")}, "come to P"),
        ({"W1": ("P", "Q"), "W2": ("Q", "P")}, "ring"),
        ({"W1": ("P", "P")}, "ring"),
    ],
)
def test_lines_that_cannot_be(webs, told):
    plants = {name: plant_of() for name in "UPQX"}
    surfaces = {"U": roll(), "P": roller(), "Q": roller()}
    with pytest.raises(ParameterError, match=told):
        build_chains(plants, surfaces, {name: (*ends, WebData(4.0, 2e5)) for name, ends in webs.items()}, {})


def test_webs_that_do_not_hang_together_are_chains_of_their_own():
    surfaces = {"U": roll(), "P": roller(), "Q": roller(), "W": roll(0.3), "R": roller()}
    web = WebData(4.0, 2e5)
    plants = {name: plant_of() for name in "UPQWRX"}
    line = build_chains(plants, surfaces, {"W2": ("Q", "W", web), "W1": ("U", "P", web)}, {})
    assert [list(chain.ends) for chain in line.chains] == [["U", "P"], ["Q", "W"], ["R"]]
    assert [list(chain.webs) for chain in line.chains] == [["W1"], ["W2"], []]
    plants["U"].advance(10 * MS)
    assert (plants["P"].now_ns > 5 * MS, plants["Q"].now_ns) == (True, 0)
    line.chains[1].advance(10 * MS)
    assert plants["Q"].now_ns == plants["W"].now_ns == 10 * MS


def test_signals_have_units_and_types_and_snapshots():
    _, line = line_of({"U": (roll(), None), "P": (roller(), None)}, {"W": ("U", "P", WebData(4.0, 2e5))})
    span, end = line.spans["W"], line.ends["U"]
    snapshot = web_signals_of(span)
    assert {name: read(span) for name, read in WEB_SIGNALS.items()} == asdict(snapshot)
    assert {name: read(end) for name, read in END_SIGNALS.items()} == asdict(end_signals_of(end))
    assert set(WEB_SIGNALS) == set(WEB_KINDS) == {*WEB_UNITS, "broken"}
    assert set(END_SIGNALS) == set(END_KINDS) == set(END_UNITS)
    assert end_signals_of(end).diameter_m == 1.25


@repeatable
@given(
    speeds=st.lists(st.floats(-8.0, 8.0), min_size=4, max_size=4),
    torques=st.lists(st.floats(-200.0, 200.0), min_size=4, max_size=4),
    stiffness=st.sampled_from([2e4, 2e5, 5e6]),
    grip=st.booleans(),
    cut_ns=st.integers(1_000_000, 40_000_000),
)
def test_no_web_is_lost_and_the_pulls_of_a_web_cancel(speeds, torques, stiffness, grip, cut_ns):
    """Wound on both rolls and spanned is always the same; the power that webs give shafts is that of their pulls."""
    middle = {"wrap_deg": 120.0, "friction": 0.3} if grip else {}
    surfaces = {"U": roll(), "P": roller(**middle), "Q": roller(0.4, 2.0), "W": roll(0.5, runs_from="bottom")}
    dancer = Dancer(300.0, 40.0, 400.0, 1.0)
    webs = {"W1": ("U", "P", WebData(4.0, stiffness)), "W2": ("P", "Q", WebData(3.0, stiffness, dancer=dancer))}
    webs["W3"] = ("Q", "W", WebData(6.0, stiffness))
    loads = [LoadData(torque_nm=torque) for torque in torques]
    plants, line = line_of({name: (surfaces[name], load) for name, load in zip(surfaces, loads, strict=True)}, webs)
    for (name, plant), speed in zip(plants.items(), speeds, strict=True):
        plant.motor.speed_rad_s = speed * 2 * surfaces[name].gear / surfaces[name].surface.diameter_m
    line.chains[0].begin()
    ends, spans = list(line.ends.values()), list(line.spans.values())

    def whole():
        return ends[0].wound_m + ends[3].wound_m + sum(span.m for span in spans)

    began = whole()
    for step in range(1, 15):
        plants["UPQW"[step % 4]].advance(step * cut_ns)
        if any(span.broken for span in spans):
            break
        assert whole() == pytest.approx(began, rel=1e-12)
        pulls = [0.0, *(span.pull_n for span in spans), 0.0]
        for end, before, after in zip(ends, pulls[:-1], pulls[1:], strict=True):
            assert end.torque_n_m == pytest.approx(end.arm_m * (after - before), rel=1e-9, abs=1e-9)
            assert end.motor.web_n_m == end.torque_n_m
