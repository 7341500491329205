"""A node in a rack's namespace, on the rack's time, that no client's request ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.nodes.guard import Guard
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.running.health import Health

MAIN_NODE = "rack"
"""The node that ``__node`` without a name means."""
_SIM_TIME = "use_sim_time"
_OF_RCLPY = (_SIM_TIME, "start_type_description_service")


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

    def declare_facts(self, facts: Mapping[str, tuple[bool | int | float | str, str]]) -> None:
        """Declare parameters that nobody can set: value and description by name."""
        for name, (value, text) in facts.items():
            descriptor = ParameterDescriptor(description=text, read_only=True)
            self.declare_parameter(name, value, descriptor, ignore_override=True)

    def set_parameters_atomically(self, parameter_list: list[Parameter[Any]]) -> SetParametersResult:
        """Set parameters; the reason names what is near where the node has none of the name."""
        for parameter in parameter_list:
            if not self.has_parameter(parameter.name):
                known = [name for name in self.list_parameters([], 0).names if name not in _OF_RCLPY]
                hint = near_or_listed(parameter.name, known)
                reason = f"{self.get_name()} has no parameter {quoted(parameter.name)}"
                return SetParametersResult(successful=False, reason=f"{reason}: {hint}" if hint else reason)
        return super().set_parameters_atomically(parameter_list)


def _refuse_simulated_time(parameters: list[Parameter[Any]]) -> SetParametersResult:
    """Refuse ``use_sim_time``: the rack's own time is what its messages are stamped with."""
    wanted = any(parameter.name == _SIM_TIME and parameter.value for parameter in parameters)
    reason = "the rack keeps its own time; use_sim_time cannot be set on its nodes" if wanted else ""
    return SetParametersResult(successful=not wanted, reason=reason)
