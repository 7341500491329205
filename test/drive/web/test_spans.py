"""Two held shafts with a web between them: the closed form, taut, slack, and from slack to taut."""

from math import exp

import pytest

from automax_ros.drive.web.data import WebData
from automax_ros.drive.web.signals import web_signals_of
from automax_ros.drive.web.verbs import set_stiffness
from drive.plants import MS, S
from drive.web.lines import held, line_of, roll, roller

LENGTH, STIFFNESS = 4.0, 2e5


def pair(first_mps, second_mps, *, first=None, second=None, **web):
    first, second = first or roller(), second or roller(0.4)
    plants, line = line_of(
        {"A": (first, held(first_mps, first)), "B": (second, held(second_mps, second))},
        {"W": ("A", "B", WebData(LENGTH, STIFFNESS, **web))},
    )
    return plants, line.spans["W"], line


@pytest.mark.parametrize(("first", "second"), [(5.0, 5.01), (20.0, 20.2), (0.0, 0.01), (3.0, 3.0003), (30.0, 30.03)])
@pytest.mark.parametrize("cut_ns", [MS // 3, 37 * MS, 250 * MS])
def test_a_taut_web_follows_the_closed_form(first, second, cut_ns):
    """M goes to L v1 / v2 with the time constant L / v2."""
    plants, span, _ = pair(first, second)
    for step in range(1, 2 * S // cut_ns + 1 if cut_ns > MS else 300):
        plants["AB"[step % 2]].advance(step * cut_ns)
        rest = LENGTH * first / second
        m = rest + (LENGTH - rest) * exp(-second / LENGTH * step * cut_ns * 1e-9)
        assert span.tension_n == pytest.approx(STIFFNESS * (LENGTH / m - 1), rel=1e-4)
        assert span.slack_m == 0.0
    assert web_signals_of(span).draw_percent == pytest.approx(100 * (second / first - 1) if first else 0.0)


def test_in_the_long_run_the_tension_is_stiffness_times_draw():
    plants, span, _ = pair(20.0, 20.05)
    plants["A"].advance(5 * S)
    assert span.tension_n == pytest.approx(STIFFNESS * 0.05 / 20.0, rel=1e-6)
    assert 100 * span.strain == pytest.approx(0.25)


def test_a_slack_web_hangs_by_what_has_come_too_much():
    plants, span, _ = pair(5.0, 4.9)
    plants["B"].advance(3 * S)
    assert (span.tension_n, span.strain) == (0.0, 0.0)
    assert span.slack_m == pytest.approx(0.1 * 3.0, rel=1e-9)


def test_from_slack_to_taut():
    """Slack is taken up at the difference of speeds; from then on the closed form counts."""
    plants, span, _ = pair(5.0, 5.02)
    span.m = LENGTH + 0.0105
    span.source.time.begin()
    plants["A"].advance(S // 2)
    assert span.slack_m == pytest.approx(0.0105 - 0.02 * 0.5, rel=1e-6)
    for milliseconds in (530, 600, 1000, 3000):
        plants["A"].advance(milliseconds * MS)
        rest = LENGTH * 5.0 / 5.02
        m = rest + (LENGTH - rest) * exp(-5.02 / LENGTH * (milliseconds * 1e-3 - 0.0105 / 0.02))
        assert span.tension_n == pytest.approx(STIFFNESS * (LENGTH / m - 1), rel=1e-3)


def test_backwards_the_web_comes_from_the_other_side():
    """B feeds and A pulls: mirrored, with the time constant L / v1."""
    plants, span, _ = pair(-5.01, -5.0)
    plants["A"].advance(S)
    rest = LENGTH * 5.0 / 5.01
    m = rest + (LENGTH - rest) * exp(-5.01 / LENGTH)
    assert span.tension_n == pytest.approx(STIFFNESS * (LENGTH / m - 1), rel=1e-4)


def test_a_roll_gives_web_with_the_strain_that_it_was_wound_with():
    plants, span, line = pair(5.0, 5.0, first=roll(1.25, wound_at_n=300.0, caliper_um=0.1))
    plants["A"].advance(8 * S)
    assert span.tension_n == pytest.approx(300.0, rel=1e-3)
    assert line.ends["A"].wound_m < line.ends["A"].roll.wound_m(1.25)


def test_a_roll_that_runs_from_the_bottom_turns_the_other_way():
    first = roll(1.25, runs_from="bottom", caliper_um=0.1)
    plants, span, line = pair(-5.0, 5.01, first=first)
    assert line.ends["A"].speed_mps == pytest.approx(5.0)
    plants["A"].advance(10 * S)
    assert span.tension_n == pytest.approx(STIFFNESS * 0.01 / 5.0, rel=1e-3)
    assert plants["A"].motor.web_n_m < 0.0


def test_another_stiffness_keeps_the_strain():
    plants, span, _ = pair(5.0, 5.01)
    plants["A"].advance(4 * S)
    before = span.tension_n
    set_stiffness(span, 0.5 * STIFFNESS)
    assert span.tension_n == pytest.approx(0.5 * before, rel=1e-6)


def test_what_is_read_within_a_slice_is_what_the_slice_ends_with():
    plants, span, _ = pair(0.0, 0.5)
    plants["A"].advance(10 * MS - 1)
    before = span.tension_n
    plants["A"].advance(10 * MS + 1)
    assert span.tension_n == pytest.approx(before, rel=1e-5)
