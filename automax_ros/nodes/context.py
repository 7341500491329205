"""A program's own part in the ROS graph."""

from __future__ import annotations

import os

from rclpy.context import Context
from rclpy.node import Node

from automax_ros.nodes.environment import RosUnavailable
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments

_SECURITY = "ROS_SECURITY_ENABLE"
_MOST_TOLD = 400


def joined_context(arguments: RosArguments = NO_ARGUMENTS) -> Context:
    """Return a context that has joined the graph; whoever asks shuts it down.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """
    context = Context()
    try:
        context.init(args=arguments.words)
        if os.environ.get(_SECURITY, "").lower() == "true":
            _try_security(context)
    except RuntimeError as error:
        context.try_shutdown()
        raise RosUnavailable(f"ROS 2 does not start: {str(error).strip()[:_MOST_TOLD]}") from error
    return context


def _try_security(context: Context) -> None:
    """Make a node, which is when DDS reads keys, and refuses to where it was built without security.

    Raises:
        RuntimeError: it refuses.
    """
    Node("security_check", context=context, enable_rosout=False, start_parameter_services=False).destroy_node()
