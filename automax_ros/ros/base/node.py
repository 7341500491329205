"""Base classes of a rack's nodes, and what these share: the rack and its message intake.

The nodes are in the rack's namespace and on its time, and no client's request ends them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from types import TracebackType
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
from automax_ros.messages.types.topics import SCAN, Take, Topic
from automax_ros.rack.rack import Rack
from automax_ros.ros.base.diagnostics import Diagnostics, Source, status_of
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import RequestGuard
from automax_ros.ros.intake.intake import MessageIntake
from automax_ros.ros.intake.rcl import library
from automax_ros.ros.intake.service_requests import ServiceRequests
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.parameter_files import RosArgumentsError
from automax_ros.runtime.health import Health
from automax_ros.runtime.time.pacer import Pace

_YIELD_S = 0.0001
"""Seconds that another thread waits before it checks again whether a scan is due."""


class RackLock:
    """The reentrant lock of a rack: ``with lock`` to access it, ``with lock.for_scan`` to scan.

    The scanning thread goes first. A plain lock is not handed over: a thread that takes message after message releases
    it and acquires it again before the scanning thread, which this wakes, has run.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._owner = 0
        self._depth = 0
        self._due = False
        self.for_scan = _Scanner(self)

    def __enter__(self) -> None:
        """Acquire the lock, but not while a scan waits for it."""
        if self._owner != threading.get_ident():
            while self._due:
                time.sleep(_YIELD_S)
        self._enter()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._leave()

    def _enter(self) -> None:
        self._lock.acquire()
        self._owner = threading.get_ident()
        self._depth += 1

    def _leave(self) -> None:
        self._depth -= 1
        if not self._depth:
            self._owner = 0
        self._lock.release()

    def _enter_first(self) -> None:
        self._due = True
        self._enter()
        self._due = False


class _Scanner:
    """The lock as the scanning thread uses it."""

    def __init__(self, turns: RackLock) -> None:
        self._turns = turns

    def __enter__(self) -> None:
        """Acquire the lock ahead of all waiting threads."""
        self._turns._enter_first()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._turns._leave()


MAIN_NODE = "rack"
"""The node that a rule ``__node`` without a node's name renames."""
SIM_TIME = "use_sim_time"
"""Parameter of every node: whether its time is that of ``/clock``."""
RECORDED_DEPTH = 10_000
"""Messages of a stream that a process keeps for its recorder while that is held up (decision: several seconds)."""
_OF_RCLPY = (SIM_TIME, "start_type_description_service")


class RackRosNode(Node):  # type: ignore[misc]
    """A node whose services created by rclpy are guarded."""

    _intake: MessageIntake | None = None

    def __init__(
        self, name: str, namespace: str, context: Context, health: Health, arguments: RosArguments = NO_ARGUMENTS
    ) -> None:
        self._adopted: set[Any] = set()
        follows = follows_clock(arguments, namespace)
        own_time = [Parameter(SIM_TIME, value=follows)]
        space = f"/{namespace}"  # the rack's
        self.own_name = name
        name = arguments.name_of(name, main=name == MAIN_NODE)
        # Rules of a foreign context for all nodes must not move the rack, or give all its nodes one name.
        own_place = ["--ros-args", "-r", f"__ns:={space}", "-r", f"__node:={name}"]
        super().__init__(name, namespace=space, context=context, cli_args=own_place, parameter_overrides=own_time)
        self.add_on_set_parameters_callback(partial(_keep_time, follows))
        self.guard = RequestGuard(health, self.get_logger().error)
        self.guard.services(self)

    def declare_facts(self, facts: Mapping[str, tuple[bool | int | float | str, str]]) -> None:
        """Declare read-only parameters: value and description by name."""
        for name, (value, text) in facts.items():
            descriptor = ParameterDescriptor(description=text, read_only=True)
            self.declare_parameter(name, value, descriptor, ignore_override=True)

    def set_parameters_atomically(self, parameter_list: list[Parameter[Any]]) -> SetParametersResult:
        """Set parameters; for an unknown name the reason suggests similar ones."""
        for parameter in parameter_list:
            if not self.has_parameter(parameter.name):
                known = [name for name in self.list_parameters([], 0).names if name not in _OF_RCLPY]
                hint = near_or_listed(parameter.name, known)
                reason = f"{self.get_name()} has no parameter {quoted(parameter.name)}"
                return SetParametersResult(successful=False, reason=f"{reason}: {hint}" if hint else reason)
        return super().set_parameters_atomically(parameter_list)

    def served_by(self, intake: MessageIntake) -> None:
        """Receive requests through a message intake, also for services created later.

        Call it before an executor has the node. Where rcl is not found the executor serves requests, as usual.
        """
        self._intake = intake
        self.adopt_services()

    def adopt_services(self) -> None:
        """Add the services that rclpy has created since to the message intake, if there is one."""
        rcl = library()
        if rcl is None or self._intake is None:
            return
        for service in self.services:
            self._adopted.add(service)
            self._intake.add(ServiceRequests(rcl, service, partial(self.guard.refusal, service.srv_name)))

    @property
    def services(self) -> Iterator[Any]:
        """The services for an executor: those that the message intake does not serve."""
        return iter([service for service in super().services if service not in self._adopted])

    def create_service(self, *arguments: Any, **options: Any) -> Any:
        """Create a service as rclpy does, and add it to the message intake."""
        made = super().create_service(*arguments, **options)
        self.adopt_services()
        return made


def follows_clock(arguments: RosArguments, namespace: str) -> bool:
    """Return whether a rack is to follow ``/clock``: ``use_sim_time`` is set for all nodes, or for the node ``rack``.

    Raises:
        RosArgumentsError: ``use_sim_time`` is neither true nor false.
    """
    item = arguments.given_to(MAIN_NODE, namespace, main=True).get(SIM_TIME)
    if item is not None and not isinstance(item.value, bool):
        raise RosArgumentsError(f"{SIM_TIME} is true or false", place=item.place)
    return item is not None and bool(item.value)


def _keep_time(follows: bool, parameters: list[Parameter[Any]]) -> SetParametersResult:
    """Refuse to change ``use_sim_time`` after the start: messages are stamped with the rack's time."""
    if all(parameter.name != SIM_TIME or parameter.value is follows for parameter in parameters):
        return SetParametersResult(successful=True)
    own = "the rack follows /clock" if follows else "the rack does not follow /clock"
    cure = f"start it with --ros-args -p use_sim_time:={'false' if follows else 'true'}"
    reason = f"{own}; use_sim_time cannot be set on its nodes: {cure}"
    return SetParametersResult(successful=False, reason=reason)


@dataclass(frozen=True)
class RackContext:
    """One rack in this process, and what its nodes share: ``context`` is rclpy's, of all of them.

    The thread that accesses the rack holds ``lock``, one at a time, between scans. ``is_recorded``: a recorder that was
    started with it must receive every message of a stream.
    """

    rack: Rack
    stream: RackStream
    pacer: Pace
    context: Context
    health: Health
    intake: MessageIntake
    arguments: RosArguments = NO_ARGUMENTS
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    lock: RackLock = field(default_factory=RackLock)
    is_recorded: bool = False

    @property
    def holds_common_memory(self) -> bool:
        """Whether common memory is in this process."""
        return self.rack.part.holds_common_memory

    @contextmanager
    def between_scans(self) -> Iterator[None]:
        """Access the rack between two scans; rack time catches up first, so stamps are those of the present."""
        with self.lock:
            self.pacer.catch_up()
            yield


class ModuleNode(RackRosNode):
    """A module's node: in the rack's namespace, on its time, and guarded against bad parameter requests."""

    def __init__(self, rack_context: RackContext, name: str) -> None:
        super().__init__(
            name, rack_context.rack.config.namespace, rack_context.context, rack_context.health, rack_context.arguments
        )
        self.rack_context = rack_context
        self.served_by(rack_context.intake)

    @property
    def subscriptions(self) -> Iterator[Any]:
        """The subscriptions for an executor: those that the message intake does not read."""
        return (item for item in super().subscriptions if item.callback is not _no_callback)

    def own_subscription(
        self, kind: Any, topic: str, qos: QoSProfile, events: SubscriptionEventCallbacks | None = None
    ) -> Any:
        """Return a subscription for the message intake, which no executor serves; ``kind`` is the message's class."""
        return self.create_subscription(kind, topic, _no_callback, qos, event_callbacks=events, raw=True)

    def outlet(self, topic: Topic, joined: Callable[[], None] | None = None) -> Take:
        """Return a function that publishes messages of a topic. ``joined`` is called for each new subscriber."""

        def matched(info: QoSPublisherMatchedInfo) -> None:
            if joined is not None and info.total_count_change > 0:
                joined()

        def incompatible(info: QoSOfferedIncompatibleQoSInfo) -> None:
            self.report_qos_conflict(f"a reader of {topic.name} gets nothing", info)

        events = PublisherEventCallbacks(
            matched=self.guarded_callback(topic.name, matched) if joined is not None else None,
            incompatible_qos=self.guarded_callback(topic.name, incompatible),
        )
        kind = message_class(topic.type_name)
        qos = ros_qos(topic.qos)
        if self.rack_context.is_recorded and topic.qos is SCAN:
            qos.depth = RECORDED_DEPTH
        publish = self.create_publisher(kind, topic.name, qos, event_callbacks=events).publish
        return lambda _, payload: publish(payload)

    def diagnose(self, statuses: Source) -> None:
        """Publish on ``/diagnostics`` what ``statuses`` returns for a rack time (ns)."""
        rack_context = self.rack_context
        if not rack_context.diagnostics.begun:
            rack_context.diagnostics.begin(rack_context.rack, rack_context.stream, rack_context.pacer, self)
        rack_context.diagnostics.add(statuses)

    def status(self, part: str, level: bytes, text: str, slot: int, values: Mapping[str, str]) -> DiagnosticStatus:
        """Return the health of a part of the module in a slot."""
        config = self.rack_context.rack.config
        name = f"{config.namespace}/{self.get_name()}: {part}"
        return status_of(name, f"{config.name} slot {slot}", level, text, values)

    def report_qos_conflict(
        self, what: str, info: QoSOfferedIncompatibleQoSInfo | QoSRequestedIncompatibleQoSInfo
    ) -> None:
        """Report a subscriber or publisher with an incompatible quality of service; ``what`` says what is lost."""
        policy = str(qos_policy_name_from_kind(info.last_policy_kind)).lower()
        text = f"{what}: its quality of service does not fit ({policy})"
        self.rack_context.health.note("QoS conflict", what, lambda: text, times=info.total_count_change)
        self.get_logger().warning(text)

    def guarded_callback(self, what: str, action: Callable[..., None]) -> Callable[..., None]:
        """Wrap a function as a callback that runs between two scans and reports its exceptions."""

        def entered(*arguments: Any) -> None:
            with self.rack_context.between_scans():
                try:
                    action(*arguments)
                except Exception as error:
                    self.guard.report(what, error)

        return entered


def _no_callback(_: Any) -> None:
    """Do nothing: the message intake reads the subscription."""
