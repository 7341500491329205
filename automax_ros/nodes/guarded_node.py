"""A node in a rack's namespace, on the rack's time, that no client's request ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.nodes.door import Door
from automax_ros.nodes.guard import Guard
from automax_ros.nodes.rcl import library
from automax_ros.nodes.requests import ServiceWay
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.nodes.ros_parameters import RosArgumentsError
from automax_ros.running.health import Health

MAIN_NODE = "rack"
"""The node that ``__node`` without a name means."""
SIM_TIME = "use_sim_time"
"""The parameter of every node that says whether its time is that of ``/clock``."""
_OF_RCLPY = (SIM_TIME, "start_type_description_service")


class GuardedNode(Node):  # type: ignore[misc]
    """A node with a guard for the services that rclpy gives it."""

    _door: Door | None = None

    def __init__(
        self, name: str, namespace: str, context: Context, health: Health, arguments: RosArguments = NO_ARGUMENTS
    ) -> None:
        """Join the graph; ``namespace`` is the rack's, without a slash at its head."""
        self._adopted: set[Any] = set()
        follows = follows_clock(arguments, namespace)
        own_time = [Parameter(SIM_TIME, value=follows)]
        space = f"/{namespace}"
        self.own_name = name
        name = arguments.name_of(name, main=name == MAIN_NODE)
        # Rules of a foreign context that are for all nodes must not put the rack elsewhere, or give all one name.
        own_place = ["--ros-args", "-r", f"__ns:={space}", "-r", f"__node:={name}"]
        super().__init__(name, namespace=space, context=context, cli_args=own_place, parameter_overrides=own_time)
        self.add_on_set_parameters_callback(partial(_keep_time, follows))
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

    def served_by(self, door: Door) -> None:
        """Let requests come in at a door, to services that are created later too; before an executor has the node.

        Where rcl is not found an executor serves them, as ever.
        """
        self._door = door
        self.adopt_services()

    def adopt_services(self) -> None:
        """Let requests to services that rclpy has made since come in at the door, if there is one."""
        rcl = library()
        if rcl is None or self._door is None:
            return
        for service in self.services:
            self._adopted.add(service)
            self._door.add(ServiceWay(rcl, service, partial(self.guard.refusal, service.srv_name)))

    @property
    def services(self) -> Iterator[Any]:
        """What an executor serves: not the services whose requests come in at a door."""
        return iter([service for service in super().services if service not in self._adopted])

    def create_service(self, *arguments: Any, **options: Any) -> Any:
        """Create a service as rclpy does."""
        made = super().create_service(*arguments, **options)
        self.adopt_services()
        return made


def follows_clock(arguments: RosArguments, namespace: str) -> bool:
    """Return whether a rack is told to follow ``/clock``: by ``use_sim_time`` for all nodes, or for the node ``rack``.

    Raises:
        RosArgumentsError: it is neither true nor false.
    """
    item = arguments.given_to(MAIN_NODE, namespace, main=True).get(SIM_TIME)
    if item is not None and not isinstance(item.value, bool):
        raise RosArgumentsError(f"{SIM_TIME} is true or false", place=item.place)
    return item is not None and bool(item.value)


def _keep_time(follows: bool, parameters: list[Parameter[Any]]) -> SetParametersResult:
    """Refuse another ``use_sim_time`` than at the start: the rack's time is what its messages are stamped with."""
    if all(parameter.name != SIM_TIME or parameter.value is follows for parameter in parameters):
        return SetParametersResult(successful=True)
    own = "the rack follows /clock" if follows else "the rack keeps its own time"
    cure = f"start it with --ros-args -p use_sim_time:={'false' if follows else 'true'}"
    reason = f"{own}; use_sim_time cannot be set on its nodes: {cure}"
    return SetParametersResult(successful=False, reason=reason)
