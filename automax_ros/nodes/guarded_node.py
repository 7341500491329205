"""A node in a rack's namespace, on the rack's time, that no client's request ends."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.nodes.guard import Guard
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.running.health import Health

MAIN_NODE = "rack"
"""The node that ``__node`` without a name means."""
_SIM_TIME = "use_sim_time"


class GuardedNode(Node):  # type: ignore[misc]
    """A node with a guard for the services that rclpy gives it."""

    def __init__(
        self, name: str, namespace: str, context: Context, health: Health, arguments: RosArguments = NO_ARGUMENTS
    ) -> None:
        """Join the graph; ``namespace`` is the rack's, without a slash at its head."""
        # The rack is the clock: its stamps are the grid's, whatever a launch file says to all nodes.
        own_time = [Parameter(_SIM_TIME, value=False)]
        space = f"/{namespace}"
        self.own_name = name
        name = arguments.name_of(name, main=name == MAIN_NODE)
        # Rules of a foreign context that are for all nodes must not put the rack elsewhere, or give all one name.
        own_place = ["--ros-args", "-r", f"__ns:={space}", "-r", f"__node:={name}"]
        super().__init__(name, namespace=space, context=context, cli_args=own_place, parameter_overrides=own_time)
        self.add_on_set_parameters_callback(_refuse_simulated_time)
        self.guard = Guard(health, self.get_logger().error)
        self.guard.services(self)


def _refuse_simulated_time(parameters: list[Parameter[Any]]) -> SetParametersResult:
    """Refuse ``use_sim_time``: the rack's own time is what its messages are stamped with."""
    wanted = any(parameter.name == _SIM_TIME and parameter.value for parameter in parameters)
    reason = "the rack keeps its own time; use_sim_time cannot be set on its nodes" if wanted else ""
    return SetParametersResult(successful=not wanted, reason=reason)
