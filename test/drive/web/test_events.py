"""What happens to webs and rollers: break, thread, too much tension, lost traction, dancers between stops."""

from math import cos, exp, radians, sin, sqrt

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import active_faults, execute_verb, values_of
from automax_ros.drive.plant.plant import LoadData
from automax_ros.drive.web.data import Dancer, WebData
from automax_ros.drive.web.signals import web_signals_of
from automax_ros.drive.web.verbs import break_web, set_stiffness, slip, thread_web
from drive.plants import MS, S
from drive.web.lines import held, line_of, roll, roller


def three(speeds, *, middle=None, webs=None, load=None):
    """Two held shafts and a roller between them, with two webs."""
    middle = middle or roller()
    ends = {"A": (roller(), held(speeds[0], roller())), "B": (middle, load or held(speeds[1], middle))}
    ends["C"] = (roller(), held(speeds[2], roller()))
    web = WebData(4.0, 2e5)
    return line_of(ends, webs or {"W1": ("A", "B", web), "W2": ("B", "C", web)})


def test_break_and_thread():
    plants, line = three((5.0, 5.01, 5.02))
    first, second = line.spans["W1"], line.spans["W2"]
    plants["A"].advance(4 * S)
    assert first.tension_n > 300.0
    break_web(first)
    assert (first.tension_n, first.slack_m, first.strain, first.broken) == (0.0, 0.0, 0.0, True)
    assert plants["A"].motor.web_n_m == 0.0
    assert plants["B"].motor.web_n_m > 0.0
    plants["B"].advance(9 * S)
    # What comes over B is without strain now.
    assert second.tension_n == pytest.approx(2e5 * 0.01 / 5.01, rel=1e-2)
    with pytest.raises(ParameterError, match=r"0\.5 m/s"):
        thread_web(first)
    assert first.broken


def test_a_web_that_is_not_broken_keeps_its_tension_when_it_is_threaded():
    plants, line = three((0.2, 0.201, 0.202))
    span = line.spans["W1"]
    plants["A"].advance(4 * S)
    before = span.tension_n
    assert before > 50.0
    with pytest.raises(ParameterError, match="web W1 is not broken"):
        thread_web(span, "web W1")
    assert span.tension_n == before
    break_web(span)
    thread_web(span)
    assert (span.tension_n, span.broken) == (0.0, False)


@pytest.mark.parametrize(("speed", "draw"), [(0.011, 100 / 11), (-0.011, -300 / 11), (0.009, 0.0), (-1e-6, 0.0)])
def test_there_is_no_draw_near_standstill(speed, draw):
    _, line = three((speed, 0.012 if speed > 0 else -0.008, 0.0))
    assert web_signals_of(line.spans["W1"]).draw_percent == pytest.approx(draw)


def test_thread_at_rest_begins_without_tension():
    plants, line = three((0.0, 0.01, 0.01), webs={"W1": ("A", "B", WebData(4.0, 2e5, threaded=False))})
    span = line.spans["W1"]
    plants["A"].advance(2 * S)
    assert web_signals_of(span).broken
    plants["C"].advance(2 * S)  # not of the chain
    thread_web(span)
    assert (span.tension_n, span.slack_m, span.broken) == (0.0, 0.0, False)
    plants["B"].advance(3 * S)
    assert span.tension_n == pytest.approx(2e5 * (exp(0.01 / 4.0) - 1), rel=1e-3)


def test_too_much_tension_breaks_a_web():
    plants, line = three((5.0, 5.01, 5.01), webs={"W1": ("A", "B", WebData(4.0, 2e5, breaks_above_n=250.0))})
    span = line.spans["W1"]
    time = 0
    highest = 0.0
    while not span.broken:
        time += MS
        highest = max(highest, span.tension_n)
        plants["A"].advance(time)
        assert time < 2 * S
    assert highest == pytest.approx(250.0, rel=5e-3)
    assert span.tension_n == 0.0


@pytest.mark.parametrize("faster", [True, False])
def test_a_roller_slips_at_eytelweins_ratio(faster):
    """B turns 2 % faster (or slower) than the web: it pulls up W1 (or W2) until the ratio is exp(friction wrap)."""
    middle = roller(0.5, wrap_deg=90.0, friction=0.25)
    plants, line = three((5.0, 5.1 if faster else 4.95, 5.02), middle=middle)
    plants["B"].advance(10 * S)
    one, two = line.spans["W1"].tension_n, line.spans["W2"].tension_n
    ratio = exp(0.25 * radians(90.0))
    assert (one / two if faster else two / one) == pytest.approx(ratio, rel=1e-3)
    assert (line.ends["B"].slipped_m < -0.1) if faster else (line.ends["B"].slipped_m > 0.1)
    # What the web as a whole is drawn by: strains add up to the draw of C over A.
    assert two == pytest.approx(2e5 * 0.02 / 5.0, rel=1e-2)
    assert plants["B"].motor.web_n_m == pytest.approx((two - one) * 0.25 / 5.25, rel=1e-3)


def test_a_roller_within_its_traction_does_not_slip():
    speeds = (5.0, 5.01, 5.02)
    found = []
    for middle in (roller(), roller(0.5, wrap_deg=180.0, friction=0.5)):
        plants, line = three(speeds, middle=middle)
        plants["B"].advance(10 * S)
        found.append([span.tension_n for span in line.spans.values()])
        assert abs(line.ends["B"].slipped_m) < 1e-3
    assert found[0] == pytest.approx(found[1], rel=1e-2)


def test_lost_traction_and_repair():
    """A locked roller carries 0.4 of what arrives; a repaired one holds the web."""
    plants, line = three((5.0, 5.05, 5.03))
    plants["A"].advance(6 * S)
    one, two = line.spans.values()
    before = [one.tension_n, two.tension_n]
    assert before[0] > 1500.0
    assert before[1] < 0.7 * before[0]
    slip(line.ends["B"], 0.4)
    assert active_faults(plants["B"]) == ("slip 0.4",)
    plants["A"].advance(14 * S)
    assert two.tension_n == pytest.approx(0.6 * one.tension_n, rel=1e-3)
    execute_verb(plants["B"], "repair", values_of("repair", "all"))
    plants["A"].advance(22 * S)
    assert [one.tension_n, two.tension_n] == pytest.approx(before, rel=2e-2)
    assert line.ends["B"].slip is None
    for end, fraction, told in ((line.ends["B"], 1.5, "0 to 1"), (line.ends["B"], -0.1, "0 to 1")):
        with pytest.raises(ParameterError, match=told):
            slip(end, fraction)


def test_only_rollers_slip_and_stiffness_has_its_range():
    _, line = line_of({"U": (roll(), None), "P": (roller(), None)}, {"W": ("U", "P", WebData(4.0, 2e5))})
    with pytest.raises(ParameterError, match="roller"):
        slip(line.ends["U"], 0.4)
    with pytest.raises(ParameterError, match="stiffness"):
        set_stiffness(line.spans["W"], 1.0)


def hung(dancer, *, speeds=(0.0, 0.0), stiffness=2e5):
    plants, line = line_of(
        {name: (roller(), held(speed, roller())) for name, speed in zip("AB", speeds, strict=True)},
        {"W": ("A", "B", WebData(4.0, stiffness, dancer=dancer))},
    )
    return plants["A"], line.spans["W"]


def test_a_dancers_period_and_rest():
    """Between locked shafts: mass x'' = force - 2 tension - damping x', and tension = stiffness 2 x / length."""
    plant, span = hung(Dancer(force_n=600.0, mass_kg=40.0, damping_ns_m=100.0, range_m=0.5))
    swing, decay = sqrt(4 * 2e5 / 4.0 / 40.0), 100.0 / 80.0
    damped = sqrt(swing**2 - decay**2)
    rest = 300.0 * 4.0 / 2e5 / 2
    for step in range(1, 200):
        time = step * 3.7e-3
        plant.advance(step * 3_700_000)
        expected = rest * (1 - exp(-decay * time) * (1.0 if damped == 0 else _cosine(damped, decay, time)))
        assert span.dancer_m == pytest.approx(expected, rel=1e-3, abs=1e-3 * rest)
        assert span.tension_n == pytest.approx(2e5 * 2 * expected / 4.0, rel=1e-3, abs=0.3)
    plant.advance(12 * S)
    assert span.tension_n == pytest.approx(300.0, rel=1e-6)
    assert span.dancer_m == pytest.approx(rest, rel=1e-6)


def _cosine(damped, decay, time):
    return cos(damped * time) + decay / damped * sin(damped * time)


def test_a_dancer_takes_up_what_comes_too_much_until_its_stop():
    """B is 10 mm/s slower: the dancer grows by 5 mm/s at a tension of half its force, and stops without a bounce."""
    plant, span = hung(Dancer(600.0, 40.0, 2000.0, 0.2), speeds=(1.0, 0.99))
    plant.advance(10 * S)
    assert span.tension_n == pytest.approx(300.0 - 0.5 * 2000.0 * 0.005, rel=2e-2)
    before = span.dancer_m
    plant.advance(12 * S)
    grown = 1.0 - 0.99 / (1.0 + span.strain)
    assert span.dancer_m - before == pytest.approx(grown, rel=3e-3)
    plant.advance(40 * S)
    assert span.dancer_m == 0.1
    assert span.v_mps == 0.0
    assert span.tension_n == 0.0
    assert span.slack_m > 0.1


def test_a_dancer_without_web_rests():
    plant, span = hung(Dancer(600.0, 40.0, 400.0, 0.5))
    plant.advance(S)
    break_web(span)
    way = span.dancer_m
    plant.advance(2 * S)
    assert span.dancer_m == way
    thread_web(span)
    assert span.tension_n == 0.0
    plant.advance(8 * S)
    assert span.tension_n == pytest.approx(300.0, rel=1e-3)


def test_friction_of_the_load_holds_a_roller():
    """A roller with 30 N m of friction stands until the web pulls more."""
    middle = roller(0.5, 1.0)
    plants, line = three((0.0, 0.0, 0.001), middle=middle, load=LoadData(friction_nm=30.0))
    plants["A"].advance(S)
    motor = plants["B"].motor
    assert motor.speed_rad_s == 0.0
    assert line.spans["W1"].tension_n == 0.0
    assert line.spans["W2"].tension_n == pytest.approx(2e5 * 0.001 / 4.0, rel=1e-2)
    plants["A"].advance(30 * S)
    difference = line.spans["W2"].tension_n - line.spans["W1"].tension_n
    assert line.spans["W1"].tension_n > 100.0
    assert difference * 0.25 <= 1.05 * (30.0 + motor.data.coulomb_n_m) * (1 + 1e-3)
