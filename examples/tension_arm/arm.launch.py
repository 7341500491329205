"""An arm that holds back the web that DRIVE1 winds: ros2 launch automax_ros arm.launch.py [record:=DIR] ...

The arguments are those of rack.launch.py. PushRosNamespace moves both, rack and robot.
"""

import sys

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare("automax_ros")
RACK = PathJoinSubstitution([SHARE, "config", "dc_drive", "rack.yaml"])


def generate_launch_description() -> LaunchDescription:
    """The rack, and the robot in its namespace."""
    return LaunchDescription(
        [
            IncludeLaunchDescription(
                PathJoinSubstitution([SHARE, "launch", "rack.launch.py"]), launch_arguments={"config": RACK}.items()
            ),
            Node(
                executable=sys.executable,
                arguments=[PathJoinSubstitution([SHARE, "examples", "tension_arm", "arm.py"])],
                namespace="drive1",
                name="arm",
                output="screen",
            ),
        ]
    )
