#!/usr/bin/env python3
"""A conveyor takes the web that the press section of PM1 delivers, and keeps the loop of web between the two.

The conveyor has a drive of its own: its belt runs a little faster than the line. It reads the speed of the press
section and commands the section's draw, so that the loop keeps its length.

Subscribes (rack PM1, config/section_drive):
    common/LINE_REF, common/SPEED_FDBK     std_msgs/Int16, counts: 4095 are 2500 fpm
Publishes:
    common/DRAW/set                        std_msgs/Int16, 1/10000: press speed over line speed
    ~/belt_speed, ~/loop                   std_msgs/Float64, m/s and m
Parameters: belt_ratio, loop_m, gain_per_s.
"""

from contextlib import suppress
from dataclasses import dataclass

from automax_ros.ros.setup.environment import prepare

prepare()  # only of use where ROS 2 is installed in a virtual environment

import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from std_msgs.msg import Float64, Int16  # noqa: E402

PERIOD_S = 0.05
M_PER_S = 2500 * 0.3048 / 60 / 4095
"""Speed of a count, m/s."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Values of commons wait for those who come late."""


@dataclass
class Loop:
    """The loop of web, and what trims the draw. It grows while the press delivers more than the belt takes."""

    wanted_m: float
    gain_per_s: float = 0.1
    length_m: float = 0.0

    def step(self, press_m_s: float, belt_m_s: float, line_m_s: float, period_s: float) -> float:
        """Let the web flow for a period and return the draw, 0.95 to 1.05 as the section's task limits it.

        The press shall deliver what the belt takes, and a little more or less while the loop is too short or too long.
        """
        self.length_m = max(0.0, self.length_m + (press_m_s - belt_m_s) * period_s)
        if line_m_s <= 0.0:
            return 1.0
        wanted_m_s = belt_m_s + self.gain_per_s * (self.wanted_m - self.length_m)
        return min(1.05, max(0.95, wanted_m_s / line_m_s))


class ConveyorFollower(Node):
    """The conveyor."""

    def __init__(self) -> None:
        """Begin with the loop as long as it shall be, and nothing moving."""
        super().__init__("follower")
        number = self.declare_parameter
        self._belt_ratio = float(number("belt_ratio", 1.02).value)
        wanted = float(number("loop_m", 2.0).value)
        self.loop = Loop(wanted, float(number("gain_per_s", 0.1).value), wanted)
        self._line_counts = self._press_counts = 0
        self.create_subscription(Int16, "common/LINE_REF", self._heard_line, LATCHED)
        self.create_subscription(Int16, "common/SPEED_FDBK", self._heard_press, LATCHED)
        self._draw = self.create_publisher(Int16, "common/DRAW/set", 10)
        self._belt = self.create_publisher(Float64, "~/belt_speed", 10)
        self._length = self.create_publisher(Float64, "~/loop", 10)
        self._last_ns = self.get_clock().now().nanoseconds
        self.create_timer(PERIOD_S, self._step)

    def _heard_line(self, message: Int16) -> None:
        self._line_counts = message.data

    def _heard_press(self, message: Int16) -> None:
        self._press_counts = message.data

    def _step(self) -> None:
        now_ns = self.get_clock().now().nanoseconds
        passed_s, self._last_ns = (now_ns - self._last_ns) * 1e-9, now_ns
        line_m_s = self._line_counts * M_PER_S
        belt_m_s = self._belt_ratio * line_m_s
        draw = self.loop.step(self._press_counts * M_PER_S, belt_m_s, line_m_s, passed_s)
        self._draw.publish(Int16(data=round(10_000 * draw)))
        self._belt.publish(Float64(data=belt_m_s))
        self._length.publish(Float64(data=self.loop.length_m))


def main() -> None:
    """Follow until Ctrl-C."""
    rclpy.init()
    # Ctrl-C shuts ROS down: a second shutdown at the same time would raise an RCLError.
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ConveyorFollower())


if __name__ == "__main__":
    main()
