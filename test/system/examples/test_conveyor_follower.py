"""examples/conveyor_follower: the loop alone, and the conveyor with the live rack."""

import json
import signal

import pytest

from system.robots import EXAMPLES, Robot, module_of, published, shown_in_vain
from system.support import ROOT, Automax, Client

FOLDER = EXAMPLES / "conveyor_follower"
CONFIG = ROOT / "config" / "section_drive" / "rack.yaml"


@pytest.fixture
def loop():
    return module_of(FOLDER / "follower.py").Loop(2.0, 0.1, 1.5)


@pytest.mark.parametrize("line_m_s", [0.5, 5.0, 12.0])
def test_the_draw_becomes_what_the_belt_takes(loop, line_m_s):
    """A press that follows its draw with 4 rad/s, as the section's regulator does; the loop gets its length."""
    press_m_s, draw = line_m_s, 1.0
    for _ in range(2400):
        press_m_s += (line_m_s * draw - press_m_s) * 4.0 * 0.05
        draw = loop.step(press_m_s, 1.02 * line_m_s, line_m_s, 0.05)
    assert draw == pytest.approx(1.02, abs=1e-4)
    assert loop.length_m == pytest.approx(2.0, abs=1e-3)


def test_a_belt_out_of_reach_takes_the_loop_and_no_more(loop):
    draws = [loop.step(1.05, 1.2, 1.0, 0.05) for _ in range(1000)]
    assert set(draws) == {1.05}
    assert loop.length_m == 0.0


def test_a_line_that_stands_has_no_draw(loop):
    assert loop.step(0.0, 0.0, 0.0, 0.05) == 1.0


def test_the_section_follows_the_conveyor(ros_domain_id):
    """At 240 fpm, 393 counts, the belt is 2 % faster: so is the press, after a while, and the loop grows again.

    The later the host hears of speeds, the more of the loop is gone by then, and the more draw brings it back at first.
    """
    from std_msgs.msg import Float64, Int16

    with (
        Automax("run", CONFIG, "--set", "LINE_SPEED_SP%=240") as rack,
        Robot(FOLDER / "follower.py", "-r", "__ns:=/pm1") as robot,
        Client() as client,
    ):
        line = client.listen(Int16, "/pm1/common/LINE_REF", latched=True)
        press = client.listen(Int16, "/pm1/common/SPEED_FDBK", latched=True)
        draws = client.listen(Int16, "/pm1/common/DRAW", latched=True)
        loop = client.listen(Float64, "/pm1/follower/loop")

        def follows() -> bool:
            if not (line and press and draws) or len(loop) <= 40:
                return False
            as_fast = line[-1].data == 393 and 401 <= press[-1].data < 410 and 10200 < draws[-1].data < 10400
            return as_fast and 1.5 < loop[-1].data < 2.0 and loop[-1].data > loop[-40].data

        client.until(follows, "a press that is as fast as the belt")

        types = dict(client.node.get_topic_names_and_types())
        assert not shown_in_vain(FOLDER, types)
        for topic, (kind, value) in published(FOLDER).items():
            assert types[topic] == [kind]
            assert {*json.loads(value)} == {"data"}
        assert robot.end() == (0, "")
        ended = rack.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
