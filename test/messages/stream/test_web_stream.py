"""The messages of webs, rolls and rollers: which there are, when they are sent, and that they say what the webs do."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.ticks import NS_PER_S
from automax_ros.drive.web.signals import END_SIGNALS, WEB_SIGNALS
from automax_ros.messages.cdr.cdr import decode, encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import NAMES, RollState, WebState
from automax_ros.messages.types.topics import PLANT
from messages.stream.test_plant_stream import YAML as WITHOUT_WEBS
from messages.stream.test_plant_stream import Heard as HeardPlants
from messages.stream.test_plant_stream import rack_of as rack_without_webs
from messages.stream.webs import SPEED, WIND, YAML, Heard, web_rack

W1, W2 = "/line1/webs/W1 UNWIND", "/line1/webs/W2 PRESS"
UNWIND, PRESS, PULL = "/line1/rolls/UNWIND UNWIND", "/line1/rolls/PRESS PRESS", "/line1/rolls/PULL"


def test_fields_are_the_signals():
    assert RollState._fields == ("stamp", "plant", *END_SIGNALS)
    assert WebState._fields == ("stamp", "web", "from_plant", "to_plant", *WEB_SIGNALS)


@pytest.mark.parametrize(
    "message",
    [
        WebState(5_000_000_007, "W1", "UNWIND", "PRESS", 432.5, 0.21625, 0.22, 0.0, -0.125, False),
        WebState(0, "W31", "A", "B", 0.0, 0.0, -100.0, 1e6, 0.0, True),
        RollState(123_456_789_012, "UNWIND", -12.5, -2460.6, 1.25, 1e5, -4321.0625),
    ],
)
def test_messages_come_out_of_cdr_as_they_went_in(message):
    assert decode(NAMES[type(message)], encode(message)) == message


def test_each_roll_roller_and_web_has_a_topic_of_the_node_that_sends_it(tmp_path: Path):
    stream = RackStream(web_rack(tmp_path), 77)
    found = [(topic.name, topic.type_name, topic.slot, topic.plant) for topic in stream.webs.topics]
    assert found == [
        ("/line1/rolls/UNWIND", "automax_msgs/msg/RollState", 7, "UNWIND"),
        ("/line1/rolls/PRESS", "automax_msgs/msg/RollState", 10, "PRESS"),
        ("/line1/rolls/PULL", "automax_msgs/msg/RollState", None, ""),
        ("/line1/webs/W1", "automax_msgs/msg/WebState", 7, "UNWIND"),
        ("/line1/webs/W2", "automax_msgs/msg/WebState", 10, "PRESS"),
    ]
    assert {topic.qos for topic in stream.webs.topics} == {PLANT}
    assert set(stream.webs.topics) < set(stream.topics)


def test_a_rack_without_webs_has_none_of_these_topics(tmp_path: Path):
    assert not RackStream(rack_without_webs(tmp_path), 77).webs.topics
    assert "webs" not in WITHOUT_WEBS


def test_messages_come_with_those_of_plants(tmp_path: Path):
    heard = Heard(web_rack(tmp_path), epoch_ns=5 * NS_PER_S)
    heard.rack.start()
    heard.rack.run(0.035)
    plants = [stamp for stamp, _ in heard.messages["/line1/plants/UNWIND UNWIND"]]
    assert plants == [5 * NS_PER_S + number * 10_000_000 for number in range(4)]
    for name in (W1, W2, UNWIND, PRESS, PULL):
        assert [stamp for stamp, _ in heard.messages[name]] == plants
        assert all(state.stamp == stamp for stamp, state in heard.messages[name])


def test_messages_tell_what_webs_do_between_held_shafts(tmp_path: Path):
    """After many time constants (0.5 m at 3.3 m/s) a span has the strain of its ends' speeds, and what came with it."""
    heard = Heard(web_rack(tmp_path))
    heard.rack.start()
    heard.rack.run(3.0 + 1e-9)
    last = {name: heard.messages[name][-1][1] for name in (W1, W2, UNWIND, PRESS, PULL)}
    first, second = last[W1], last[W2]
    speeds = {name: last[name].web_mps for name in (UNWIND, PRESS, PULL)}
    assert speeds[UNWIND] == pytest.approx(pi * last[UNWIND].diameter_m * 200 / 60 / 4)
    assert speeds[PRESS] == pytest.approx(pi * 0.5 * 627 / 60 / 5)
    assert speeds[PULL] == pytest.approx(pi * 0.25 * 251 / 60)
    assert last[PULL].web_fpm == pytest.approx(speeds[PULL] / 0.3048 * 60)
    assert first.draw_percent == pytest.approx(100 * (speeds[PRESS] / speeds[UNWIND] - 1))
    assert second.draw_percent == pytest.approx(100 * (speeds[PULL] / speeds[PRESS] - 1))
    # The roll gets smaller, so the draw grows; each strain follows it by the time constant of its span.
    lag = 100 * 2 * 90e-6 * (200 / 60 / 4) / last[UNWIND].diameter_m * 0.5 / speeds[PRESS]
    assert first.strain_percent == pytest.approx(first.draw_percent - lag, rel=2e-4)
    whole = (1 + first.strain_percent / 100) * (1 + second.draw_percent / 100)
    assert second.strain_percent == pytest.approx(100 * (whole - 1) - lag, rel=2e-4)
    assert first.tension_n == pytest.approx(2.0e5 * first.strain_percent / 100)
    assert second.tension_n == pytest.approx(1.0e5 * second.strain_percent / 100)
    assert (first.slack_m, first.dancer_m, first.broken) == (0.0, 0.0, False)
    assert (first.from_plant, first.to_plant) == ("UNWIND", "PRESS")
    assert (second.from_plant, second.to_plant) == ("PRESS", "PULL")
    assert last[PULL].web_m == pytest.approx(3 * speeds[PULL], rel=1e-6)
    assert last[PULL].roll_turns == pytest.approx(3 * 251 / 60, rel=1e-6)
    # A roll gives its caliper for each turn, twice that of its diameter.
    assert last[UNWIND].diameter_m == pytest.approx(1.25 - 2 * 90e-6 * last[UNWIND].roll_turns, rel=1e-6)


def test_rolls_and_rollers_are_joints_behind_the_gear(tmp_path: Path):
    heard = Heard(web_rack(tmp_path))
    heard.rack.start()
    heard.rack.run(1.0 + 1e-9)
    joint = heard.messages["/line1/joint_states PRESS"][-1][1]
    assert joint.name == ("PRESS", "PRESS_roll")
    assert joint.velocity == pytest.approx((627 * pi / 30, 627 * pi / 150))
    assert joint.position[1] == pytest.approx((627 / 60 / 5 % 1) * 2 * pi, abs=1e-6)
    assert joint.effort == (0.0, 0.0)


def test_a_roll_from_the_bottom_turns_with_the_web(tmp_path: Path):
    bottom = YAML.replace("density_kg_m3: 780}", "density_kg_m3: 780, runs_from: bottom}")
    rack = build(tmp_path, bottom.replace("speed_rpm: 200", "speed_rpm: -200"), SPEED=SPEED, WIND=WIND)
    heard = Heard(rack)
    rack.start()
    rack.run(0.1 + 1e-9)
    joint = heard.messages["/line1/joint_states UNWIND"][-1][1]
    roll = heard.messages[UNWIND][-1][1]
    assert joint.velocity == pytest.approx((-200 * pi / 30, 200 * pi / 120))
    assert roll.web_mps == pytest.approx(pi * roll.diameter_m * 50 / 60)
    assert roll.roll_turns == pytest.approx(0.1 * 50 / 60)
    assert joint.position[1] == pytest.approx(roll.roll_turns * 2 * pi)


def test_a_run_is_the_same_whoever_looks(tmp_path: Path):
    for name in ("watched", "alone"):
        (tmp_path / name).mkdir()
    watched, alone = Heard(web_rack(tmp_path / "watched")).rack, web_rack(tmp_path / "alone")
    states = []
    for rack in (watched, alone):
        rack.start()
        rack.run(0.2345)
        found = dict(rack.state().plants)
        states.append({name: found[name] for name in found if name not in rack.plants})
    assert states[0] == states[1]


def test_plants_without_webs_have_their_shaft_alone(tmp_path: Path):
    heard = HeardPlants(rack_without_webs(tmp_path))
    heard.rack.start()
    heard.rack.run(0.005)
    assert heard.messages["/line1/joint_states UNWIND"][0][1].name == ("UNWIND",)
