#!/usr/bin/env python3
"""An arm holds back the web that the motor of DRIVE1 winds up, with the tension it is told to keep.

The arm feeds the web at the speed at which the roll takes it, less what tension asks for; its own drive follows with a
lag. The web is a spring between arm and roll, and its pull brakes the motor: the arm sends it as the plant's load.

Subscribes (rack DRIVE1, config/dc_drive):
    joint_states                           sensor_msgs/JointState, the motor's shaft
    ~/tension/set                          std_msgs/Float64, N
Publishes:
    plants/MOTOR/load_torque/set           std_msgs/Float64, N m at the motor's shaft
    ~/wrench                               geometry_msgs/WrenchStamped, pull on the arm, N
Parameters: joint, tension_n, roll_radius_m, gear_ratio, stiffness_n_per_m, lag_s.
"""

from contextlib import suppress
from dataclasses import dataclass

from automax_ros.ros.setup.environment import prepare

prepare()  # only of use where ROS 2 is installed in a virtual environment

import rclpy  # noqa: E402
from geometry_msgs.msg import WrenchStamped  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402

LONGEST_STEP_S = 0.01
"""The web's spring is stepped at least this finely."""


@dataclass
class Web:
    """Web between arm and roll, and the arm's tension regulator.

    ``stretch_m`` is how much longer the web is than without pull, ``feed_m_s`` the arm's own speed.
    """

    stiffness_n_per_m: float
    lag_s: float
    stretch_m: float = 0.0
    feed_m_s: float = 0.0
    trim_m_s: float = 0.0

    @property
    def tension_n(self) -> float:
        """The pull: a slack web has none."""
        return max(0.0, self.stiffness_n_per_m * self.stretch_m)

    def step(self, roll_m_s: float, wanted_n: float, period_s: float) -> None:
        """Let a period pass; the roll takes the web at ``roll_m_s``, the arm feeds it."""
        while period_s > 0.0:
            part_s = min(period_s, LONGEST_STEP_S)
            self._step(roll_m_s, wanted_n, part_s)
            period_s -= part_s

    def _step(self, roll_m_s: float, wanted_n: float, period_s: float) -> None:
        # In metres of stretch; a bandwidth of 6 rad/s leaves the arm's lag of 0.05 s room enough.
        missing_m = (wanted_n - self.tension_n) / self.stiffness_n_per_m
        self.trim_m_s = min(0.2, max(-0.2, self.trim_m_s + 9.0 * missing_m * period_s))
        asked_m_s = roll_m_s - 6.0 * missing_m - self.trim_m_s
        self.feed_m_s += (asked_m_s - self.feed_m_s) * min(1.0, period_s / self.lag_s)
        self.stretch_m = max(-0.05, self.stretch_m + (roll_m_s - self.feed_m_s) * period_s)


class TensionArm(Node):
    """The arm."""

    def __init__(self) -> None:
        """Begin with a slack web."""
        super().__init__("arm")
        number = self.declare_parameter
        self._joint = str(number("joint", "MOTOR").value)
        self._wanted_n = float(number("tension_n", 2000.0).value)
        self._m_per_rad = float(number("roll_radius_m", 0.5).value) / float(number("gear_ratio", 10.0).value)
        self.web = Web(float(number("stiffness_n_per_m", 20_000.0).value), float(number("lag_s", 0.05).value))
        self._last_s: float | None = None
        self.create_subscription(JointState, "joint_states", self._moved, 10)
        self.create_subscription(Float64, "~/tension/set", self._told, 10)
        self._load = self.create_publisher(Float64, f"plants/{self._joint}/load_torque/set", 10)
        self._wrench = self.create_publisher(WrenchStamped, "~/wrench", 10)

    def _told(self, message: Float64) -> None:
        self._wanted_n = min(10_000.0, max(0.0, message.data))

    def _moved(self, message: JointState) -> None:
        """The shaft tells where it is 100 times in a second: the arm acts as often, on the rack's own time."""
        if self._joint not in message.name:
            return
        speed_rad_s = message.velocity[message.name.index(self._joint)]
        now_s = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        passed_s = 0.0 if self._last_s is None else min(0.1, max(0.0, now_s - self._last_s))
        self._last_s = now_s
        self.web.step(speed_rad_s * self._m_per_rad, self._wanted_n, passed_s)
        pull = self.web.tension_n
        self._load.publish(Float64(data=pull * self._m_per_rad))
        wrench = WrenchStamped()
        wrench.header.stamp = message.header.stamp
        wrench.wrench.force.x = pull
        self._wrench.publish(wrench)


def main() -> None:
    """Hold the web until Ctrl-C, then let it go."""
    rclpy.init()
    # Ctrl-C shuts ROS down: a second shutdown at the same time would raise an RCLError.
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(TensionArm())


if __name__ == "__main__":
    main()
