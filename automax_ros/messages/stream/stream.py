"""The stream of a running rack: every topic's messages as CDR bytes, for the recorder and the nodes alike.

The stream observes the rack, encodes each message once and sends it to its sinks. Values of commons are sent on change,
at most at a variable's rate limit; the last value before a pause is always sent.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import partial

from automax_ros.core.kinds import Direction
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.messages.cdr.cdr import Message, encode
from automax_ros.messages.stream.plant_stream import PlantStream
from automax_ros.messages.stream.rack_messages import RackMessages, topic_type_name, value_encoder
from automax_ros.messages.stream.task_messages import TaskMessages
from automax_ros.messages.stream.web_stream import WebStream
from automax_ros.messages.types.topics import LATCHED, OPERATION, SCAN, VALUE, Sink, Take, Takes, Topic
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.ros_names import topic_names
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import EventClass, EventKey

SNAPSHOT_PERIOD_NS = 10 * NS_PER_S
"""Time between two images of memory, with full latches and the tasks' states, in the stream, ns (decision: replay may
begin at each)."""


class _ValueTopic:
    """The topic of one variable, with the data of its rate limit."""

    def __init__(self, variable: CommonVariable, topic: Topic) -> None:
        self.variable = variable
        self.topic = topic
        self.takes: list[Take] = []
        self.encode = value_encoder(variable)
        self.interval_ns = round(NS_PER_S / variable.rate_limit_hz) if variable.rate_limit_hz else 0
        self.last_ns = -1
        self.last_payload = b""
        self.waits = False


class _TaskStream:
    """The sinks of one task's scans, of its states, and of a state after each scan."""

    def __init__(self, messages: TaskMessages) -> None:
        self.messages = messages
        self.scans: list[Take] = []
        self.states: list[Take] = []
        self.each_state: list[Take] = []
        self.next_full_ns = 0
        self.held: dict[str, Value] = {}
        self.compiled = messages.compiled
        self.holds = bool(messages.compiled.held)


class RackStream:
    """Observes a rack and streams it to sinks. ``run_id`` is that of ``RackMessages``."""

    def __init__(self, rack: Rack, run_id: int) -> None:
        space = f"/{rack.config.namespace}"
        self._rack = rack
        self.run_id = run_id
        self._messages = RackMessages(rack, run_id)
        self.variables_topic = Topic(f"{space}/variables", "automax_msgs/msg/VariableTable", LATCHED)
        self.snapshot_topic = Topic(f"{space}/backplane/snapshot", "automax_msgs/msg/CommonImage", LATCHED)
        slots = [module.config.slot for module in rack.task_modules]
        # If common memory is in another process, the first module with tasks sends the operations of this one.
        first = None if rack.part.holds_common_memory else next(iter(slots), None)
        self.operations_topic = Topic(f"{space}/operations", "automax_msgs/msg/Operation", OPERATION, first)
        self.backplane_topic = Topic(f"{space}/backplane", "automax_msgs/msg/CommonWrite", SCAN)
        self.scans_topics = {slot: Topic(f"{space}/scans", "automax_msgs/msg/Scan", SCAN, slot) for slot in slots}
        self.states_topics = {
            slot: Topic(f"{space}/states", "automax_msgs/msg/TaskState", SCAN, slot) for slot in slots
        }
        self._values = self._value_topics(space)
        self._by_view = [self._values.get(view) for view in range(len(rack.config.variables))]
        self.plants = PlantStream(rack, space, self._messages.stamp)
        self.webs = WebStream(rack, space, self._messages.stamp)
        self._tables: list[Take] = []
        self._images: list[Take] = []
        self._writes: list[Take] = []
        self._operations: list[Take] = []
        self._tasks = {task: _TaskStream(self._messages.of(task)) for task in rack.tasks}
        self._next_image_ns = SNAPSHOT_PERIOD_NS
        self._begun = False
        self._present, self._scheduler = rack.memory.present, rack.scheduler

    @property
    def has_begun(self) -> bool:
        """Whether messages are being sent."""
        return self._begun

    @property
    def topics(self) -> list[Topic]:
        """All topics of the stream: of the part of the rack that is in this process."""
        if not self._rack.part.holds_common_memory:
            return [*self.module_topics, *self.drive_topics]
        rack = [self.variables_topic, self.snapshot_topic, self.backplane_topic, self.operations_topic]
        values = (value.topic for value in self._values.values())
        return [*rack, *self.module_topics, *values, *self.drive_topics]

    @property
    def drive_topics(self) -> list[Topic]:
        """The topics of plants, of their rolls and rollers, and of webs."""
        return [*self.plants.topics, *self.webs.topics]

    @property
    def module_topics(self) -> list[Topic]:
        """The topics of modules with tasks."""
        own = [*self.scans_topics.values(), *self.states_topics.values()]
        return own if self.operations_topic.slot is None else [*own, self.operations_topic]

    def value_topic(self, view: int) -> Topic | None:
        """Return the topic of a variable by its index in the rack's table, None if it has none."""
        value = self._values.get(view)
        return value.topic if value else None

    def add_sink(self, sink: Sink, *, tasks: Collection[str] | None = None, every_state: bool = False) -> Takes:
        """Send a sink the messages of the topics that it takes; return these topics with their functions.

        With ``tasks`` it gets only scans and states of these, with ``every_state`` a state after each of these scans.
        """
        takes = {topic: take for topic in self.topics if (take := sink(topic)) is not None}

        def route(routed: list[Take], topic: Topic) -> None:
            if topic in takes:
                routed.append(takes[topic])

        route(self._tables, self.variables_topic)
        route(self._images, self.snapshot_topic)
        route(self._writes, self.backplane_topic)
        route(self._operations, self.operations_topic)
        for value in self._values.values():
            route(value.takes, value.topic)
        for task, stream in self._tasks.items():
            if tasks is None or task.name in tasks:
                route(stream.scans, self.scans_topics[task.slot])
                route(stream.states, self.states_topics[task.slot])
                if every_state:
                    route(stream.each_state, self.states_topics[task.slot])
        self.plants.route(takes)
        self.webs.route(takes)
        return takes

    def stamp(self, now_ns: int) -> int:
        """Return the stamp of an instant of rack time."""
        return self._messages.stamp(now_ns)

    def in_run(self, run_id: int) -> None:
        """Set the number of the run, if it was unknown at creation; to be called before ``begin``."""
        self.run_id = self._messages.run_id = run_id

    def leave_out(self, time_ns: int) -> None:
        """Advance later stamps by a time (ns) that the rack skips."""
        self._messages.epoch_ns += time_ns

    def begin(self, epoch_ns: int = 0) -> None:
        """Send the state at the start, and observe the rack: to be called just before ``Rack.start``.

        It contains states of tasks that are not those of an installation, as after a power-up.
        ``epoch_ns`` is the wall clock at rack time 0; simulated time has none.
        """
        self._messages.epoch_ns = epoch_ns
        for task, stream in self._tasks.items():
            stream.messages = self._messages.of(task)
        _send(self._messages.table(), self._tables, self._messages.stamp(self._rack.now_ns))
        self._send_image(self._rack.now_ns)
        self._send_values(self._values, self._rack.now_ns)
        for task in self._tasks:
            if task.compiled.held or task.snapshot() != task.layout.flatten(task.layout.fresh()):
                self._send_state(task, self._rack.now_ns)
        self._rack.observe(self)
        self.plants.begin()
        self.webs.begin()
        self._begun = True

    def send_image(self) -> None:
        """Send the present image of common memory, for subscribers that join a running rack."""
        if self._begun:
            self._send_image(self._rack.now_ns)

    def send_states(self, slot: int) -> None:
        """Send the states of a Processor's tasks, for late joiners; the next scan of each is a full one."""
        now = self._rack.now_ns
        for task, stream in self._tasks.items():
            if self._begun and task.slot == slot:
                self._send_state(task, now)
                stream.next_full_ns = now

    def repeat_facts(self, takes: Takes) -> None:
        """Send one sink the present state, between two scans: table, image, values of commons, states of its tasks.

        The next scan of each task is a full one. So a recording, or its next file, can begin here.
        """
        now = self._rack.now_ns
        own = set(takes.values())
        _send(self._messages.table(), own.intersection(self._tables), self._messages.stamp(now))
        self._send_image(now, own.intersection(self._images))
        for value in self._values.values():
            if value.last_payload:
                for take in own.intersection(value.takes):
                    take(self._messages.stamp(now), value.last_payload)
        for task, stream in self._tasks.items():
            stream.next_full_ns = now
            self._send_state(task, now, own.intersection(stream.states))

    def end(self) -> None:
        """Send values held back by rate limits, what a scan in progress has written so far, and the final states."""
        now = self._rack.now_ns
        self._rack.observers.report_writes()
        for view, value in self._values.items():
            if value.waits:
                self._send_value(view, value, now)
        for task in self._rack.tasks:
            self._send_state(task, now)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """Send a scan, its writes and the values that changed; at intervals also a snapshot after them."""
        stream = self._tasks[task]
        now = max(record.time_ns, self._scheduler.now_ns)  # a modeled scan is reported when it has ended
        full = now >= stream.next_full_ns and record.scan > 0
        own = 0 if not writes or writes[0].writer == task.writer else own_from(writes, task.writer)
        if own:
            self._send_log(writes[:own])
        if stream.scans:
            epoch_ns = self._messages.epoch_ns
            payload = stream.messages.scan_bytes(record, epoch_ns + record.time_ns, full=full)
            stamp = epoch_ns + (writes[own].time_ns if own < len(writes) else now)
            for take in stream.scans:
                take(stamp, payload)
        if writes:
            if own < len(writes):
                self._send_log(writes[own:] if own else writes)
            self._send_written(writes, now)
        if task.compiled is not stream.compiled:
            stream.compiled, stream.holds = task.compiled, bool(task.compiled.held)
        if full or not record.scan or ((stream.held or stream.holds) and stream.held != task.held):
            self._send_state(task, now)
        elif stream.each_state:
            self._send_state(task, now, stream.each_state)
        if full:
            stream.next_full_ns = (now // SNAPSHOT_PERIOD_NS + 1) * SNAPSHOT_PERIOD_NS
            if now >= self._next_image_ns:
                self._next_image_ns = stream.next_full_ns
                self._send_image(now)

    def written(self, writes: list[WriteGroup]) -> None:
        """Send writes from outside and the values that changed."""
        self._send_log(writes)
        self._send_written(writes, self._rack.now_ns)

    def tuned(self, task: Task, now_ns: int) -> None:
        """Send the task's new state: no scan shows that a tunable was set."""
        self._send_state(task, now_ns)

    def operated(self, operation: Operation) -> None:
        """Send an operation, and the new states of the tasks that it concerns."""
        _send(self._messages.operation(operation), self._operations)
        for task in self._rack.tasks:
            if operation.ok and operation.concerns(task.name):
                self._tasks[task].messages = self._messages.of(task)
                self._send_state(task, operation.at_ns)

    def _value_topics(self, space: str) -> dict[int, _ValueTopic]:
        variables = self._rack.config.variables
        names = topic_names(variable.name for variable in variables)
        return {
            view: _ValueTopic(variable, Topic(f"{space}/{names[variable.name]}", type_name, VALUE))
            for view, variable in enumerate(variables)
            if variable.direction is not Direction.CLOSED and (type_name := topic_type_name(variable)) is not None
        }

    def _send_state(self, task: Task, now_ns: int, takes: Collection[Take] | None = None) -> None:
        stream = self._tasks[task]
        if takes is None:
            takes, stream.held = stream.states, task.held
        if takes:
            stamp = self._messages.stamp(now_ns)
            payload = stream.messages.state_bytes(stamp)
            for take in takes:
                take(stamp, payload)

    def _send_image(self, now_ns: int, takes: Collection[Take] | None = None) -> None:
        _send(self._messages.image(now_ns), self._images if takes is None else takes)
        forces = self._messages.forces(now_ns)
        if forces is not None:
            _send(forces, self._writes)

    def _send_log(self, writes: list[WriteGroup]) -> None:
        for stamp, payload in self._messages.write_bytes(writes):
            for take in self._writes:
                take(stamp, payload)

    def _send_written(self, writes: list[WriteGroup], now_ns: int) -> None:
        if len(writes) == 1:
            self._send_values([change[0] for change in writes[0].changes], now_ns)
        else:
            self._send_values(dict.fromkeys(change[0] for group in writes for change in group.changes), now_ns)

    def _send_values(self, views: Iterable[int], now_ns: int) -> None:
        for view in views:
            value = self._by_view[view]
            if value is None:
                continue
            if not value.interval_ns:
                self._send_value(view, value, now_ns)
                continue
            due = value.last_ns + value.interval_ns
            if value.last_ns < 0 or now_ns >= due:
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
        payload = value.encode(self._present(view))
        if payload != value.last_payload:
            value.last_ns, value.last_payload = now_ns, payload
            stamp = self._messages.stamp(now_ns)
            for take in value.takes:
                take(stamp, payload)


def own_from(writes: Sequence[WriteGroup], writer: int) -> int:
    """Return the place of a scan among writes: before its own first one, after those of others before that."""
    return next((place for place, entry in enumerate(writes) if entry.writer == writer), len(writes))


def _send(message: Message, takes: Collection[Take], stamp: int | None = None) -> None:
    """Send a message that is not sent with every scan, at its own stamp unless another is given."""
    payload = encode(message)
    for take in takes:
        take(message[0] if stamp is None else stamp, payload)
