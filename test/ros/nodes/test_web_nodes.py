"""Webs, rolls and rollers over real DDS: their topics, who sends them, joints, and what is done to them by services."""

from math import pi

import pytest
from messages.stream.webs import SPEED, WIND, YAML

from ros.support import until

RACK = YAML
SOURCES = {"SPEED": SPEED, "WIND": WIND}


@pytest.fixture
def heard(live, client):
    """Returns the messages of a topic until one is as wanted; one topic at a time, which the client can follow."""

    def hear(kind, topic, wanted=lambda _: True):
        found = []
        subscription = client.node.create_subscription(kind, f"/line1/{topic}", found.append, 10)
        until(live, client, lambda: any(map(wanted, found)))
        client.node.destroy_subscription(subscription)
        return next(filter(wanted, found))

    return hear


def test_webs_and_rolls_are_heard(heard, client):
    from automax_msgs.msg import RollState, WebState
    from rclpy.qos import ReliabilityPolicy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float32

    state = heard(WebState, "webs/W1", lambda item: item.tension_n > 0.0)
    assert (state.web, state.from_plant, state.to_plant, state.broken) == ("W1", "UNWIND", "PRESS", False)
    assert state.tension_n == pytest.approx(2.0e5 * state.strain_percent / 100)
    # The strain becomes the draw; the tension alone and the instrument's common tell it in N.
    settled = pytest.approx(2.0e5 * state.draw_percent / 100, rel=0.05)
    assert heard(Float32, "webs/W1/tension", lambda item: item.data == settled)
    assert heard(Float32, "common/TENSION", lambda item: item.data == settled)
    assert heard(RollState, "rolls/PULL").web_mps == pytest.approx(pi * 0.25 * 251 / 60)
    roll = heard(RollState, "rolls/UNWIND", lambda item: item.roll_turns > 1.0)
    assert roll.diameter_m == pytest.approx(1.25 - 2 * 90e-6 * roll.roll_turns, rel=1e-6)
    joint = heard(JointState, "joint_states", lambda item: item.name[0] == "PRESS")
    assert list(joint.name) == ["PRESS", "PRESS_roll"]
    assert joint.velocity[1] == pytest.approx(joint.velocity[0] / 5.0)

    senders = {"webs/W1": "drive_plant_7", "webs/W1/tension": "drive_plant_7", "webs/W2": "drive_plant_10_B"}
    senders |= {"rolls/UNWIND": "drive_plant_7", "rolls/PRESS": "drive_plant_10_B", "rolls/PULL": "common_memory"}
    for topic, node in senders.items():
        (publisher,) = client.node.get_publishers_info_by_topic(f"/line1/{topic}")
        assert (publisher.node_name, publisher.qos_profile.reliability) == (node, ReliabilityPolicy.RELIABLE)


def test_webs_are_operated_by_services(live, client, ask, heard):
    from automax_msgs.msg import Operation, PlantState, RollState, WebState
    from automax_msgs.srv import OperateControl

    told = client.listen(Operation, "/line1/operations", latched=True)

    def asked(service: str, name: str, control: str, value: str = ""):
        response = ask(service, OperateControl, name=name, control=control, value=value)
        return response.ok, response.reason

    assert asked("web", " w1 ", "break") == (True, "")
    assert heard(WebState, "webs/W1", lambda item: item.broken).tension_n == 0.0
    ok, reason = asked("web", "W1", "thread")
    assert not ok
    assert "slow both down" in reason
    assert asked("web", "W1", "stiffness_n", "1.5e5") == (True, "")
    assert asked("web", "W9", "break") == (False, "the rack has no web 'W9': it has W1, W2")
    assert asked("plant", "UNWIND", "splice", "0.9") == (True, "")
    assert heard(RollState, "rolls/UNWIND").diameter_m == pytest.approx(0.9)
    assert asked("plant", "PRESS", "slip", "0.4") == (True, "")
    heard(PlantState, "plants/PRESS", lambda item: list(item.faults) == ["slip 0.4"])
    assert asked("plant", "PRESS", "repair", "all") == (True, "")
    heard(PlantState, "plants/PRESS", lambda item: not item.faults)
    until(live, client, lambda: len(told) == 7)
    assert [(item.what, item.ok, item.detail) for item in told] == [
        ("web", True, "W1 break"),
        ("web", False, "W1 thread"),
        ("web", True, "W1 stiffness_n 1.5e5"),
        ("web", False, "W9 break"),
        ("plant", True, "UNWIND splice 0.9"),
        ("plant", True, "PRESS slip 0.4"),
        ("plant", True, "PRESS repair all"),
    ]
