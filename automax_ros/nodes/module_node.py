"""What the nodes of all kinds of module share: the rack they serve, and the door through which ROS enters it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.event_handler import (
    PublisherEventCallbacks,
    QoSOfferedIncompatibleQoSInfo,
    QoSPublisherMatchedInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
from rclpy.qos import QoSProfile, qos_policy_name_from_kind

from automax_ros.nodes.diagnostics import Diagnostics, Source, status_of
from automax_ros.nodes.door import Door
from automax_ros.nodes.guarded_node import GuardedNode
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.nodes.topics import message_class, ros_qos
from automax_ros.nodes.turns import Turns
from automax_ros.rack.rack import Rack
from automax_ros.running.health import Health
from automax_ros.running.pace import Pace
from automax_ros.wire.stream import RackStream
from automax_ros.wire.topics import Take, Topic


@dataclass(frozen=True)
class Site:
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
    door: Door
    arguments: RosArguments = NO_ARGUMENTS
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    lock: Turns = field(default_factory=Turns)

    @property
    def is_home(self) -> bool:
        """Whether common memory is in this process."""
        return self.rack.part.is_home

    @contextmanager
    def present(self) -> Iterator[None]:
        """Enter the rack from outside: between two scans, and what happens is stamped with its own instant."""
        with self.lock:
            self.pacer.catch_up()
            yield


class ModuleNode(GuardedNode):
    """A module's node: in the rack's namespace, on its time, and safe from what clients ask of its parameters."""

    def __init__(self, site: Site, name: str) -> None:
        """Join the graph."""
        super().__init__(name, site.rack.config.namespace, site.context, site.health, site.arguments)
        self.site = site
        self.served_by(site.door)

    @property
    def subscriptions(self) -> Iterator[Any]:
        """What an executor serves: not what is taken at the rack's door."""
        return (item for item in super().subscriptions if item.callback is not _at_the_door)

    def own_subscription(
        self, kind: Any, topic: str, qos: QoSProfile, events: SubscriptionEventCallbacks | None = None
    ) -> Any:
        """Return a subscription that no executor serves, for the rack's door; ``kind`` is the message's class."""
        return self.create_subscription(kind, topic, _at_the_door, qos, event_callbacks=events, raw=True)

    def outlet(self, topic: Topic, joined: Callable[[], None] | None = None) -> Take:
        """Return what publishes the messages of a topic. ``joined`` is called for each reader that comes."""

        def matched(info: QoSPublisherMatchedInfo) -> None:
            if joined is not None and info.total_count_change > 0:
                joined()

        def incompatible(info: QoSOfferedIncompatibleQoSInfo) -> None:
            self.misfit(f"a reader of {topic.name} gets nothing", info)

        events = PublisherEventCallbacks(
            matched=self.inside(topic.name, matched) if joined is not None else None,
            incompatible_qos=self.inside(topic.name, incompatible),
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

    def inside(self, what: str, action: Callable[..., None]) -> Callable[..., None]:
        """Return an action as a callback: in the rack's present, between two scans, its exceptions reported."""

        def entered(*arguments: Any) -> None:
            with self.site.present():
                try:
                    action(*arguments)
                except Exception as error:
                    self.guard.report(what, error)

        return entered


def _at_the_door(_: Any) -> None:
    """Stand in for the callback of a subscription that is taken from at the rack's door."""
