"""examples/tension_arm: the web alone, and the arm with the live drive."""

import json
import math
import signal

import pytest

from system.robots import EXAMPLES, Robot, module_of, published, shown_in_vain
from system.support import ROOT, Automax, Client

FOLDER = EXAMPLES / "tension_arm"
CONFIG = ROOT / "config" / "dc_drive" / "rack.yaml"


@pytest.fixture
def web():
    return module_of(FOLDER / "arm.py").Web(20_000.0, 0.05)


def test_the_pull_becomes_what_is_wanted_at_any_speed(web):
    for speed_m_s in (0.0, 3.0, 6.0, -1.0):
        for _ in range(1000):
            web.step(speed_m_s, 2000.0, 0.01)
        assert web.tension_n == pytest.approx(2000.0, rel=1e-3)
        assert web.feed_m_s == pytest.approx(speed_m_s, abs=1e-3)


def test_a_slack_web_pulls_nothing(web):
    for _ in range(1000):
        web.step(0.0, 0.0, 0.01)
    assert web.tension_n == 0.0


def test_a_long_period_is_as_many_short_ones(web):
    other = module_of(FOLDER / "arm.py").Web(20_000.0, 0.05)
    web.step(1.0, 500.0, 0.08)
    for _ in range(8):
        other.step(1.0, 500.0, 0.01)
    assert web.stretch_m == pytest.approx(other.stretch_m, abs=1e-9)


def test_the_arm_brakes_the_motor_that_ros_commands(ros_domain_id):
    """2000 N on a roll of 0.5 m over a gear of 10 are 100 N m; the drive turns as a velocity controller says."""
    from automax_msgs.msg import PlantState
    from geometry_msgs.msg import WrenchStamped
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray

    with (
        Automax("run", CONFIG, "--set", "SPEED_SP%=100") as rack,
        Robot(FOLDER / "arm.py", "-r", "__ns:=/drive1") as robot,
        Client() as client,
    ):
        joints = client.listen(JointState, "/drive1/joint_states")
        pulls = client.listen(WrenchStamped, "/drive1/arm/wrench")
        states = client.listen(PlantState, "/drive1/plants/MOTOR")

        def is_steady(pull_n: float, speed_rad_s: float) -> bool:
            """The last quarter of a second: pull, and the speed that was commanded."""
            last = pulls[-25:], joints[-25:]
            return all(map(len, last)) and (
                all(abs(item.wrench.force.x - pull_n) < 0.02 * pull_n for item in last[0])
                and all(abs(item.velocity[0] - speed_rad_s) < 2.0 for item in last[1])
            )

        client.until(lambda: bool(states) and is_steady(2000.0, 100 * math.pi / 30), "100 rpm against 2000 N")
        # The rack's own load is a fan: 150 N m at 1750 rpm, straight through 0.
        fan_nm = 150.0 * states[-1].speed_rpm / 1750.0
        assert states[-1].load_nm - fan_nm == pytest.approx(100.0, rel=0.05)
        client.send(Float64MultiArray, "/drive1/MOTOR_velocity_controller/commands", Float64MultiArray(data=[30.0]))
        client.send(Float64, "/drive1/arm/tension/set", Float64(data=3000.0))
        client.until(lambda: is_steady(3000.0, 30.0), "30 rad/s against 3000 N")

        types = dict(client.node.get_topic_names_and_types())
        assert not shown_in_vain(FOLDER, types)
        for topic, (kind, value) in published(FOLDER).items():
            assert types[topic] == [kind]
            assert "data" in json.loads(value)
        assert robot.end() == (0, "")
        ended = rack.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
