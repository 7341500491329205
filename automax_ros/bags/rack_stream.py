"""The stream of a running rack: every topic's messages as CDR bytes, for the recorder and the nodes alike.

The stream observes the rack and hands each message to its sinks, once encoded. Values of commons go out on change, not
more often than a variable's rate limit allows; the last value before a pause always goes out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from automax_ros.bags.cdr import encoder
from automax_ros.bags.messages import NAMES
from automax_ros.bags.qos import LATCHED, SCAN, VALUE, QosProfile
from automax_ros.bags.rack_messages import Message, RackMessages, message_maker, value_type_name
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.config import CommonVariable, Direction
from automax_ros.rack.rack import Rack
from automax_ros.rack.ros_names import topic_names
from automax_ros.runtime.memory import Write
from automax_ros.runtime.scheduler import EventClass, EventKey
from automax_ros.runtime.task import ScanRecord, Task

SNAPSHOT_PERIOD_NS = 10 * NS_PER_S
"""How often an image, full latches and the tasks' states enter the stream (decision)."""


@dataclass(frozen=True)
class Topic:
    """A topic of the stream: full name, ROS type, quality of service; ``slot`` of the module that sends on it.

    Several modules send on one topic: each has a Topic of its own. ``slot`` None is the common memory.
    """

    name: str
    type_name: str
    qos: QosProfile
    slot: int | None = None


Sink = Callable[[Topic, int, bytes], None]
"""Takes a message: its topic, its stamp in ns, its CDR bytes."""


class _ValueTopic:
    """The topic of one variable, with what its rate limit needs."""

    def __init__(self, variable: CommonVariable, topic: Topic) -> None:
        self.variable = variable
        self.topic = topic
        self.make = message_maker(variable)
        self.encode = encoder(topic.type_name)
        self.interval_ns = round(NS_PER_S / variable.rate_limit_hz) if variable.rate_limit_hz else 0
        self.last_ns = -1
        self.last_payload = b""
        self.waits = False


class RackStream:
    """Observes a rack and streams it to ``sinks``. ``run_id`` is that of ``RackMessages``."""

    def __init__(self, rack: Rack, run_id: int) -> None:
        """Prepare the topics; nothing flows before ``begin``."""
        space = f"/{rack.config.namespace}"
        self._rack = rack
        self._messages = RackMessages(rack, run_id)
        self.variables_topic = Topic(f"{space}/variables", "automax_msgs/msg/VariableTable", LATCHED)
        self.snapshot_topic = Topic(f"{space}/backplane/snapshot", "automax_msgs/msg/CommonImage", LATCHED)
        self.backplane_topic = Topic(f"{space}/backplane", "automax_msgs/msg/CommonWrite", SCAN)
        slots = [processor.slot for processor in rack.processors]
        self.scans_topics = {slot: Topic(f"{space}/scans", "automax_msgs/msg/Scan", SCAN, slot) for slot in slots}
        self.states_topics = {
            slot: Topic(f"{space}/states", "automax_msgs/msg/TaskState", SCAN, slot) for slot in slots
        }
        self._values = self._value_topics(space)
        self._sinks: list[Sink] = []
        self._encoders = {name: encoder(name) for name in NAMES.values() if name.startswith("automax_msgs/")}
        self._next_snapshot: dict[str, int] = {}
        self._begun = False

    @property
    def topics(self) -> list[Topic]:
        """All topics of the stream."""
        fixed = [self.variables_topic, self.snapshot_topic, self.backplane_topic, *self.module_topics]
        return [*fixed, *(value.topic for value in self._values.values())]

    @property
    def module_topics(self) -> list[Topic]:
        """The topics that Processors send on."""
        return [*self.scans_topics.values(), *self.states_topics.values()]

    def value_topic(self, view: int) -> Topic | None:
        """Return the topic of a variable by its index in the rack's table, None if it has none."""
        value = self._values.get(view)
        return value.topic if value else None

    def add_sink(self, sink: Sink) -> None:
        """Hand every message to a further taker."""
        self._sinks.append(sink)

    def begin(self, epoch_ns: int = 0) -> None:
        """Send the facts that stand at the start, and observe the rack: to be called just before ``Rack.start``.

        ``epoch_ns`` is the wall clock at rack time 0; simulated time has none.
        """
        self._messages.epoch_ns = epoch_ns
        self._put(self.variables_topic, self._messages.stamp(self._rack.now_ns), self._messages.table())
        self._send_image(self._rack.now_ns)
        self._send_values(self._values, self._rack.now_ns)
        self._rack.observe(self)
        self._begun = True

    def send_image(self) -> None:
        """Send all of common memory as it is now, for somebody who joins a running rack."""
        if self._begun:
            self._send_image(self._rack.now_ns)

    def end(self) -> None:
        """Send what is held back by rate limits and the final states."""
        now = self._rack.now_ns
        for view, value in self._values.items():
            if value.waits:
                self._send_value(view, value, now)
        for task in self._rack.tasks:
            self._send_state(task, now)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[Write]) -> None:
        """Send a scan, its writes and the values that changed; every now and then a snapshot behind them."""
        now = record.time_ns
        full = now >= self._next_snapshot.get(task.name, 0) and record.scan > 0
        message = self._messages.scan(task, record, full=full)
        self._put(self.scans_topics[task.slot], message.stamp, message)
        if writes:
            self._send_writes(writes, now)
        if full or not record.scan:
            self._send_state(task, now)
        if full:
            self._next_snapshot[task.name] = (now // SNAPSHOT_PERIOD_NS + 1) * SNAPSHOT_PERIOD_NS
            if now >= self._next_snapshot.get("", SNAPSHOT_PERIOD_NS):
                self._next_snapshot[""] = self._next_snapshot[task.name]
                self._send_image(now)

    def written(self, writes: list[Write]) -> None:
        """Send writes from outside and the values that changed."""
        self._send_writes(writes, self._rack.now_ns)

    def tuned(self, task: Task, now_ns: int) -> None:
        """Send the task's new state: no scan tells that a tunable was set."""
        self._send_state(task, now_ns)

    def all_stopped(self, reason: str, now_ns: int) -> None:  # noqa: ARG002
        """Send the states in which the tasks were stopped."""
        for task in self._rack.tasks:
            self._send_state(task, now_ns)

    def _value_topics(self, space: str) -> dict[int, _ValueTopic]:
        variables = self._rack.config.variables
        names = topic_names(variable.name for variable in variables)
        topics = {}
        for view, variable in enumerate(variables):
            type_name = value_type_name(variable)
            if variable.direction is not Direction.CLOSED and type_name is not None:
                topics[view] = _ValueTopic(variable, Topic(f"{space}/{names[variable.name]}", type_name, VALUE))
        return topics

    def _send_state(self, task: Task, now_ns: int) -> None:
        message = self._messages.state(task, now_ns)
        self._put(self.states_topics[task.slot], message.stamp, message)

    def _send_image(self, now_ns: int) -> None:
        self._put(self.snapshot_topic, self._messages.stamp(now_ns), self._messages.image(now_ns))

    def _send_writes(self, writes: list[Write], now_ns: int) -> None:
        for message in self._messages.writes(writes):
            self._put(self.backplane_topic, message.stamp, message)
        self._send_values({entry.view: None for entry in writes}, now_ns)

    def _send_values(self, views: Iterable[int], now_ns: int) -> None:
        for view in views:
            value = self._values.get(view)
            if value is None:
                continue
            due = value.last_ns + value.interval_ns
            if value.last_ns < 0 or not value.interval_ns or now_ns >= due:
                self._send_value(view, value, now_ns)
            elif not value.waits:
                value.waits = True
                key = EventKey(EventClass.OBSERVE, 0, value.variable.name)
                self._rack.scheduler.at(due, key, partial(self._send_late, view, value))

    def _send_late(self, view: int, value: _ValueTopic, now_ns: int) -> None:
        if value.waits and now_ns >= value.last_ns + value.interval_ns:
            self._send_value(view, value, now_ns)

    def _send_value(self, view: int, value: _ValueTopic, now_ns: int) -> None:
        value.waits = False
        payload = value.encode(value.make(self._rack.memory.present(view)))
        if payload != value.last_payload:
            value.last_ns, value.last_payload = now_ns, payload
            stamp = self._messages.stamp(now_ns)
            for sink in self._sinks:
                sink(value.topic, stamp, payload)

    def _put(self, topic: Topic, stamp: int, message: Message) -> None:
        payload = self._encoders[topic.type_name](message)
        for sink in self._sinks:
            sink(topic, stamp, payload)
