"""ROS 2 nodes: the only room, with the command line, that knows rclpy.

``prepare`` comes before the first ``import rclpy`` where ROS 2 is installed in a virtual environment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.nodes.environment import RosUnavailable, prepare
    from automax_ros.nodes.rack_nodes import RackNodes

__all__ = ["RackNodes", "RosUnavailable", "prepare"]

__getattr__ = face(__name__, "environment", "rack_nodes")
