"""A program's own part in the ROS graph."""

from __future__ import annotations

from rclpy.context import Context

from automax_ros.nodes.environment import RosUnavailable

_NO_CONSOLE = ["--ros-args", "--disable-stdout-logs"]
"""The console belongs to the command; what nodes log goes to /rosout and to the log files."""


def joined_context() -> Context:
    """Return a context that has joined the graph; whoever asks shuts it down.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """
    context = Context()
    try:
        context.init(args=_NO_CONSOLE)
    except RuntimeError as error:
        raise RosUnavailable(f"ROS 2 does not start: {error}") from error
    return context
