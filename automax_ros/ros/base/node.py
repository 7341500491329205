"""What the nodes of all kinds of module share: the rack they serve, and the door through which ROS enters it.

A node in a rack's namespace, on the rack's time, that no client's request ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.context import Context
from rclpy.event_handler import (
    PublisherEventCallbacks,
    QoSOfferedIncompatibleQoSInfo,
    QoSPublisherMatchedInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, qos_policy_name_from_kind

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.topics import Take, Topic
from automax_ros.rack.rack import Rack
from automax_ros.ros.base.diagnostics import Diagnostics, Source, status_of
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import RequestGuard
from automax_ros.ros.intake.intake import MessageIntake
from automax_ros.ros.intake.rack_lock import RackLock
from automax_ros.ros.intake.rcl import library
from automax_ros.ros.intake.service_requests import ServiceRequests
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.parameter_files import RosArgumentsError
from automax_ros.runtime.health import Health
from automax_ros.runtime.time.pacer import Pace

MAIN_NODE = "rack"
"""The node that ``__node`` without a name means."""
SIM_TIME = "use_sim_time"
"""The parameter of every node that says whether its time is that of ``/clock``."""
_OF_RCLPY = (SIM_TIME, "start_type_description_service")


class RackRosNode(Node):  # type: ignore[misc]
    """A node with a guard for the services that rclpy gives it."""

    _door: MessageIntake | None = None

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
        self.guard = RequestGuard(health, self.get_logger().error)
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

    def served_by(self, door: MessageIntake) -> None:
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
            self._door.add(ServiceRequests(rcl, service, partial(self.guard.refusal, service.srv_name)))

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


@dataclass(frozen=True)
class RackContext:
    """One rack that lives in this process, as its nodes see it.

    Attributes:
        rack: the rack.
        stream: the messages that it sends.
        pacer: what keeps its time.
        context: of all its nodes.
        health: where they report trouble.
        door: where messages and requests come in.
        arguments: what they were told by the command line.
        diagnostics: what they tell of their health.
        lock: held by whoever touches the rack; one thread at a time, between scans.
    """

    rack: Rack
    stream: RackStream
    pacer: Pace
    context: Context
    health: Health
    door: MessageIntake
    arguments: RosArguments = NO_ARGUMENTS
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    lock: RackLock = field(default_factory=RackLock)

    @property
    def holds_common_memory(self) -> bool:
        """Whether common memory is in this process."""
        return self.rack.part.holds_common_memory

    @contextmanager
    def between_scans(self) -> Iterator[None]:
        """Enter the rack from outside: between two scans, and what happens is stamped with its own instant."""
        with self.lock:
            self.pacer.catch_up()
            yield


class ModuleNode(RackRosNode):
    """A module's node: in the rack's namespace, on its time, and safe from what clients ask of its parameters."""

    def __init__(self, site: RackContext, name: str) -> None:
        """Join the graph."""
        super().__init__(name, site.rack.config.namespace, site.context, site.health, site.arguments)
        self.site = site
        self.served_by(site.door)

    @property
    def subscriptions(self) -> Iterator[Any]:
        """What an executor serves: not what is taken at the rack's door."""
        return (item for item in super().subscriptions if item.callback is not _no_callback)

    def own_subscription(
        self, kind: Any, topic: str, qos: QoSProfile, events: SubscriptionEventCallbacks | None = None
    ) -> Any:
        """Return a subscription that no executor serves, for the rack's door; ``kind`` is the message's class."""
        return self.create_subscription(kind, topic, _no_callback, qos, event_callbacks=events, raw=True)

    def outlet(self, topic: Topic, joined: Callable[[], None] | None = None) -> Take:
        """Return what publishes the messages of a topic. ``joined`` is called for each reader that comes."""

        def matched(info: QoSPublisherMatchedInfo) -> None:
            if joined is not None and info.total_count_change > 0:
                joined()

        def incompatible(info: QoSOfferedIncompatibleQoSInfo) -> None:
            self.misfit(f"a reader of {topic.name} gets nothing", info)

        events = PublisherEventCallbacks(
            matched=self.guarded_callback(topic.name, matched) if joined is not None else None,
            incompatible_qos=self.guarded_callback(topic.name, incompatible),
        )
        kind = message_class(topic.type_name)
        publish = self.create_publisher(kind, topic.name, ros_qos(topic.qos), event_callbacks=events).publish
        return lambda _, payload: publish(payload)

    def diagnose(self, statuses: Source) -> None:
        """Let ``/diagnostics`` have what ``statuses`` returns for a rack time (ns)."""
        site = self.site
        if not site.diagnostics.begun:
            site.diagnostics.begin(site.rack, site.stream, site.pacer, self)
        site.diagnostics.add(statuses)

    def status(self, part: str, level: bytes, text: str, slot: int, values: Mapping[str, str]) -> DiagnosticStatus:
        """Return the health of a part of the module in a slot."""
        config = self.site.rack.config
        name = f"{config.namespace}/{self.get_name()}: {part}"
        return status_of(name, f"{config.name} slot {slot}", level, text, values)

    def misfit(self, what: str, info: QoSOfferedIncompatibleQoSInfo | QoSRequestedIncompatibleQoSInfo) -> None:
        """Report a reader or writer with an incompatible quality of service; ``what`` says what is lost."""
        policy = str(qos_policy_name_from_kind(info.last_policy_kind)).lower()
        text = f"{what}: its quality of service does not fit ({policy})"
        self.site.health.note("QoS conflict", what, lambda: text, times=info.total_count_change)
        self.get_logger().warning(text)

    def guarded_callback(self, what: str, action: Callable[..., None]) -> Callable[..., None]:
        """Return an action as a callback: in the rack's present, between two scans, its exceptions reported."""

        def entered(*arguments: Any) -> None:
            with self.site.between_scans():
                try:
                    action(*arguments)
                except Exception as error:
                    self.guard.report(what, error)

        return entered


def _no_callback(_: Any) -> None:
    """Stand in for the callback of a subscription that is taken from at the rack's door."""
