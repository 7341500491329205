"""ROS 2 nodes: the only room, with the command line, that knows rclpy.

``prepare`` comes before the first ``import rclpy`` where ROS 2 is installed in a virtual environment.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from automax_ros.nodes.environment import RosUnavailable, prepare

if TYPE_CHECKING:
    from automax_ros.nodes.rack_nodes import RackNodes

__all__ = ["RackNodes", "RosUnavailable", "prepare"]


def __getattr__(name: str) -> Any:
    """Import what needs rclpy when it is asked for: ``prepare`` must be there before."""
    if name == "RackNodes":
        return import_module(f"{__name__}.rack_nodes").RackNodes
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
