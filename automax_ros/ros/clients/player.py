"""The node ``player``: publishes the messages of a recording again, at absolute deadlines on the wall clock.

Publishes: each topic of the recording, with its recorded quality of service; ``/clock`` (rosgraph_msgs/Clock) with the
time of the recording, 100 times per second of the wall clock.

Services: ``~/pause`` and ``~/resume`` (std_srvs/Trigger).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ament_index_python import get_resources
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.cdr.cdr import CdrError, decoder, encoder
from automax_ros.messages.types.definitions import message_types
from automax_ros.messages.types.messages import Clock
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import RawMessage
from automax_ros.recordings.read.playback import PlayableRecording, PlayTopic, Renaming
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import RequestGuard
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.process import joined_context, make_executor
from automax_ros.runtime.health import Health

CLOCK_PERIOD_NS = 10 * NS_PER_MS
"""Period of ``/clock``."""
DISCOVERY_NS = 3500 * NS_PER_MS
"""Time between the creation of the topics and the first message: DDS announces itself each 3 s, so by then subscribers
have found them, and a rack that is live has been seen (decision)."""
LEAD_NS = 20 * NS_PER_MS
"""Time before the first message in which earlier latched messages are published."""
ACKNOWLEDGE_NS = 2 * NS_PER_S
"""How long subscribers may take at the end to acknowledge the last messages."""
_LONGEST_WAIT_NS = 50 * NS_PER_MS
_CHORE_NS = 20 * NS_PER_MS
_TYPE = re.compile(r"([a-z][a-z0-9_]*)/msg/([A-Z][A-Za-z0-9]*)")


@dataclass
class Lateness:
    """How late after their deadlines messages were sent, in ns."""

    count: int = 0
    total: int = 0
    longest: int = 0

    def note(self, late_ns: int) -> None:
        """Count one message."""
        self.count += 1
        self.total += late_ns
        self.longest = max(self.longest, late_ns)

    @property
    def mean(self) -> float:
        """The mean in ns."""
        return self.total / self.count if self.count else 0.0


class Player:
    """Plays the span of a survey at ``rate`` times its original speed; always call ``close``.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """

    def __init__(
        self,
        survey: PlayableRecording,
        renaming: Renaming,
        rate: float,
        *,
        clock: bool,
        arguments: RosArguments = NO_ARGUMENTS,
    ) -> None:
        self.lateness = Lateness()
        self.paused = False
        self.position = survey.begin
        self._survey, self._renaming, self._rate = survey, renaming, rate
        self._context = joined_context(arguments)
        space = renaming.space(survey.spaces[0]) if survey.spaces else renaming.topic("")
        name = arguments.name_of("player", main=True)
        self._node = Node(name, namespace=space or "/", context=self._context, enable_rosout=False)
        self._node.create_service(Trigger, "~/pause", self._pause)
        self._node.create_service(Trigger, "~/resume", self._resume)
        self.health = Health()
        self._guard = RequestGuard(self.health, self._node.get_logger().error)
        self._guard.services(self._node)
        self._executor = make_executor(self._context)
        self._executor.add_node(self._node)
        self._outlets: dict[str, _Outlet] = {}
        self._with_clock = clock
        self._clock: Publisher[Any] | None = None
        self._encode_clock = encoder("rosgraph_msgs/msg/Clock")
        self._zero_ns = 0
        self._next_clock = 0
        self._next_chore = 0
        self._paused_since = 0

    @property
    def name(self) -> str:
        """The node's full name."""
        return str(self._node.get_fully_qualified_name())

    def look_around(self, stopping: Callable[[], bool], *, for_racks: bool) -> list[str]:
        """Wait for subscribers to find the topics; return the namespaces with a live rack, as soon as one is seen."""
        spaces = [self._renaming.space(space) for space in self._survey.spaces if for_racks]
        own = {publisher.topic_name for publisher in self._node.publishers}
        deadline = time.monotonic_ns() + DISCOVERY_NS
        while time.monotonic_ns() < deadline and not stopping():
            tables = {space: f"{space}/variables" for space in spaces}
            found = [space for space, name in tables.items() if self._node.count_publishers(name) > (name in own)]
            if found:
                return found
            self._serve(0.02)
        return []

    @property
    def clock_taken(self) -> bool:
        """Whether another node publishes ``/clock`` too."""
        return self._clock is not None and self._node.count_publishers("/clock") > 1

    def open(self) -> None:
        """Create the publishers; a topic that cannot be played gets its ``fault``."""
        for topic in self._survey.topics.values():
            if not topic.fault:
                kind = _find_class(topic)
                if kind is not None:
                    self._open(topic, kind)
        if self._with_clock:
            kind = message_class("rosgraph_msgs/msg/Clock")
            self._clock = self._node.create_publisher(kind, "/clock", 1)

    def play(self, stopping: Callable[[], bool], on_idle: Callable[[], None]) -> bool:
        """Publish the span once; return False if stopped. ``on_idle`` is called now and then.

        Raises:
            BagError: a message is malformed.
        """
        self.position = self._survey.begin
        for record in self._survey.latched.values():
            self._send(record)
        self._zero_ns = self._next_clock = self._paused_since = time.monotonic_ns() + LEAD_NS
        self._next_chore = 0
        for record in self._survey.messages():
            while (now := time.monotonic_ns()) < (due := self._due(record.log_time)) or self.paused:
                if not self._wait(now, due, stopping, on_idle):
                    return False
            if now >= self._next_chore and not self._wait(now, now, stopping, on_idle):
                return False
            self.position = record.log_time
            self._send(record)
            self.lateness.note(time.monotonic_ns() - due)
        self._send_clock(self._survey.end)
        return True

    def settle(self, stopping: Callable[[], bool]) -> None:
        """Wait until subscribers have acknowledged the last messages, at most ``ACKNOWLEDGE_NS``."""
        deadline = time.monotonic_ns() + ACKNOWLEDGE_NS
        for outlet in self._outlets.values():
            while outlet.unconfirmed() and time.monotonic_ns() < deadline and not stopping():
                self._serve(0.01)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def _serve(self, seconds: float) -> None:
        self._guard.serve(self._executor, self._context, seconds)

    def _open(self, topic: PlayTopic, kind: Any) -> None:
        name = self._renaming.topic(topic.name)
        try:
            publisher = self._node.create_publisher(kind, name, ros_qos(topic.qos))
        except (ValueError, RuntimeError) as error:  # a name that ROS refuses, for example
            topic.fault = f"ROS refuses it: {str(error).splitlines()[0][:120]}"
            return
        outlet = _Outlet(publisher, topic, kind)
        installed = self._hash_of(name)
        if topic.type_name not in message_types() and installed and topic.type_hash not in {"", installed}:
            topic.fault = f"{topic.type_name} is installed with another definition"
            self._node.destroy_publisher(publisher)
            return
        self._outlets[topic.name] = outlet

    def _hash_of(self, topic: str) -> str:
        """Return the type hash of our own publisher, empty if it is unknown."""
        own = (self._node.get_name(), self._node.get_namespace())
        for item in self._node.get_publishers_info_by_topic(topic):
            if (item.node_name, item.node_namespace) == own and item.topic_type_hash.version > 0:
                return f"RIHS{item.topic_type_hash.version:02d}_{bytes(item.topic_type_hash.value).hex()}"
        return ""

    def _due(self, log_time: int) -> int:
        return self._zero_ns + round((log_time - self._survey.begin) / self._rate)

    def _wait(self, now: int, due: int, stopping: Callable[[], bool], on_idle: Callable[[], None]) -> bool:
        """Serve ROS until the next deadline or clock tick, or for a moment; return False if asked to stop."""
        if self.paused:
            self._shift(now)
        elif now >= self._next_clock:
            elapsed = round((self._next_clock - self._zero_ns) * self._rate)
            self._send_clock(min(self._survey.begin + max(0, elapsed), self._survey.end))
            # A tick that the host made us miss is skipped; the next one stays on the grid.
            self._next_clock += CLOCK_PERIOD_NS * (1 + (now - self._next_clock) // CLOCK_PERIOD_NS)
        if now >= self._next_chore:
            self._next_chore = now + _CHORE_NS
            on_idle()
            if stopping():
                return False
        wake = min(due, self._next_clock, now + _LONGEST_WAIT_NS) if not self.paused else now + _LONGEST_WAIT_NS
        self._serve(max(0, wake - time.monotonic_ns()) / NS_PER_S)
        return True

    def _shift(self, now: int) -> None:
        passed = max(0, now - self._paused_since)
        self._paused_since += passed
        self._zero_ns += passed
        self._next_clock += passed

    def _send(self, record: RawMessage) -> None:
        outlet = self._outlets.get(record.channel.topic)
        if outlet is None:
            return
        try:
            outlet.check(record.data)
            outlet.publisher.publish(self._renaming.payload(outlet.topic.type_name, record.data))
        except CdrError as error:
            place = ", ".join(str(file) for file in self._survey.bag.files[:1])
            text = f"the message on {outlet.topic.name[:247]} at {record.log_time} ns is malformed: {error}"
            raise BagError("AMX6816", place, text) from error

    def _send_clock(self, now_ns: int) -> None:
        if self._clock is not None and 0 <= now_ns < (2**31) * NS_PER_S:
            self._clock.publish(self._encode_clock(Clock(now_ns)))

    def _pause(self, _: Any, response: Any) -> Any:
        if not self.paused:
            self.paused, self._paused_since = True, time.monotonic_ns()
        response.success = True
        return response

    def _resume(self, _: Any, response: Any) -> Any:
        if self.paused:
            self._shift(time.monotonic_ns())
            self.paused = False
        response.success = True
        return response


class _Outlet:
    """A publisher, and the check of its messages."""

    def __init__(self, publisher: Publisher[Any], topic: PlayTopic, kind: Any) -> None:
        self.publisher, self.topic, self._kind = publisher, topic, kind
        self._decode = decoder(topic.type_name) if topic.type_name in message_types() else None

    def check(self, data: bytes) -> None:
        """Check that subscribers can read a message.

        Raises:
            CdrError: they cannot.
        """
        if self._decode is not None:
            self._decode(data)
            return
        try:
            deserialize_message(data, self._kind)
        except Exception as error:  # rclpy's error has no public class
            raise CdrError(f"not of type {self.topic.type_name}: {str(error)[:120]}") from error

    def unconfirmed(self) -> bool:
        from rclpy.duration import Duration

        return not self.publisher.wait_for_all_acked(Duration(nanoseconds=NS_PER_MS))


def _find_class(topic: PlayTopic) -> Any | None:
    """Return the class of a topic's messages; None, and the topic's ``fault``, if it is not installed."""
    match = _TYPE.fullmatch(topic.type_name)
    # Only packages that say they hold interfaces are imported: the name comes from the recording.
    if match is None or match[1] not in get_resources("rosidl_interfaces"):
        topic.fault = f"its type {topic.type_name[:100]} is not installed"
        return None
    try:
        return message_class(topic.type_name)
    except (ImportError, AttributeError):
        topic.fault = f"its type {topic.type_name[:100]} is not installed"
        return None
