"""A program's own part in the ROS graph."""

from __future__ import annotations

from rclpy.context import Context

from automax_ros.nodes.environment import RosUnavailable
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments


def joined_context(arguments: RosArguments = NO_ARGUMENTS) -> Context:
    """Return a context that has joined the graph; whoever asks shuts it down.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """
    context = Context()
    try:
        context.init(args=arguments.words)
    except RuntimeError as error:
        raise RosUnavailable(f"ROS 2 does not start: {error}") from error
    return context
