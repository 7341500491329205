"""The node ``recorder``: records a rack that runs in another process, over DDS.

Subscribes to the rack's ``variables``, ``config``, ``backplane``, ``backplane/snapshot``, ``scans``, ``states`` and to
the topics of all common variables; publishes nothing. Messages are taken as bytes, by polling all topics every 25 ms:
that costs a fraction of one callback each, and one poll shows how far all topics have come. Each message carries the
time at which it was sent, which gives the order of the rack's own log.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, TypeVar

from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.messages.cdr.message_headers import table_of
from automax_ros.messages.types.messages import Presence, VariableTable
from automax_ros.messages.types.rack_files import RackFile, RackFilesError, files_from_text
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.recordings.live.recording import LiveRecording
from automax_ros.recordings.live.topics import LiveTopics, TopicKind
from automax_ros.recordings.live.tracks import SendOrder
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.ros.base.qos import message_class
from automax_ros.ros.clients.recorded_run import MOST_TABLES, RecordedRun, participant
from automax_ros.ros.distributed.recorder_wait import recorder_name
from automax_ros.ros.intake.rcl import TakenMessage, reader_of
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.process import joined_context

LOOK_S = 0.025
"""Seconds between two polls of the topics."""
HOLD_NS = 250 * NS_PER_MS
"""How long a message is held for those that were sent before it and arrive later."""
MOST_BYTES = 64 << 20
"""Longest message that is read (decision: an image of the largest rack is a fraction of it)."""
READER_DEPTH = 10_000
"""Messages of one topic that wait in this process when it is held up."""
FILES_WAIT_NS = 3 * NS_PER_S
"""How long to wait for a rack's files once its table has arrived."""
_REQUEST_NS = NS_PER_S
_SLOW_REQUEST_NS = 10 * _REQUEST_NS
_MOST_REQUESTS = 5
"""Number of requests at intervals of one second; later ones are sent every ten seconds."""
_TABLE_TYPE = "automax_msgs/msg/VariableTable"
_FILES = TopicKind("std_msgs/msg/String", LATCHED)
_PRESENCE = TopicKind("automax_msgs/msg/Presence", SCAN)


class SeveralRacks(UserError):
    """Several racks have the same name in this ROS domain."""


class RawSubscription:
    """Takes the messages of one topic as bytes."""

    def __init__(self, node: Node, topic: str, kind: TopicKind) -> None:
        self.topic, self.kind = topic, kind
        self._node = node
        self._class = message_class(kind.type_name)
        latched = kind.qos.durability == "transient_local"
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=READER_DEPTH,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        self._subscription = node.create_subscription(self._class, topic, _nothing, qos, raw=True)
        self._reader = reader_of(self._subscription, MOST_BYTES)

    def taken(self) -> Iterator[TakenMessage]:
        """Yield the messages received; one longer than ``MOST_BYTES`` has no payload."""
        while (found := self._reader.take()) is not None:
            yield found

    def close(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)


class RecorderNode(Node):  # type: ignore[misc]
    """The recorder's node; it has no services, because nothing spins it."""

    def __init__(self, space: str, context: Context, name: str = "recorder") -> None:
        quiet = [Parameter("start_type_description_service", value=False)]
        super().__init__(
            name,
            namespace=space,
            context=context,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=quiet,
        )

    def racks(self) -> list[str]:
        """Return the namespaces of the racks in the graph, such as ``/pm1``."""
        tables = [name for name, types in self.get_topic_names_and_types() if _TABLE_TYPE in types]
        spaces = [name.removesuffix("/variables") for name in tables if self.count_publishers(name)]
        return sorted(space for space in spaces if f"{space}/variables" in tables)


class Receiver(Protocol):
    """Receives the messages of a rack in the order in which they were sent, as ``LiveRecording`` does."""

    notes: list[str]
    files_begun: int

    @property
    def wants_image(self) -> bool:
        """Whether it waits for an image of common memory."""
        ...

    @property
    def wants_states(self) -> bool:
        """Whether it waits for states of tasks."""
        ...

    def take(self, topic: str, sent_ns: int, payload: bytes) -> None:
        """Take a message, sent at a time of the rack's clock."""

    def store(self, files: Sequence[RackFile]) -> None:
        """Take the files of the rack again: a task was reloaded."""

    def flush(self, passed_ns: int) -> None:
        """Do what is due when no message has come for a time."""

    def close(self) -> None:
        """End: no more messages follow."""


_Receiver = TypeVar("_Receiver", bound=Receiver)


class LiveRecorder:
    """Finds a rack and records it, or lets another ``Receiver`` follow it; always call ``close``.

    ``recording`` is None until ``open`` or ``follow``; ``name`` is the node's, if it does not record.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """

    def __init__(self, space: str, arguments: RosArguments = NO_ARGUMENTS, name: str | None = None) -> None:
        self.recording: Receiver | None = None
        self.lost_values: Counter[str] = Counter()
        self._space = space
        self._context = joined_context(arguments)
        self._node = RecorderNode(space, self._context, name or recorder_name(arguments))
        self._topics = LiveTopics(space)
        self._table = b""
        self._order: SendOrder[tuple[str, bytes]] = SendOrder(HOLD_NS)
        self._subscriptions: list[RawSubscription] = []
        self._files: RawSubscription | None = None
        self._numbers: dict[str, int] = {}
        self._last_due = 0
        self._requests: list[RawSubscription] = []
        self._next_request = 0
        self._request_count = 0
        self._files_begun = 1
        self.binding = RecordedRun(self._node, space)
        self._presences: RawSubscription | None = None
        self._early: dict[str, RawSubscription] = {}
        self._run_id = 0

    def racks(self) -> list[str]:
        """Return the namespaces of the racks in the graph."""
        return self._node.racks()

    @property
    def is_there(self) -> bool:
        """Whether the rack that is recorded is in the graph."""
        return self.binding.is_there

    def expect(self, config: RackConfig) -> None:
        """Subscribe to a rack that may not exist yet, so that its first messages are not lost.

        They wait until ``open``, ``READER_DEPTH`` messages of each topic.
        """
        topics = LiveTopics.expected(self._space, config)
        kinds = topics.all
        self._subscribe_presences()
        self._files = RawSubscription(self._node, topics.config, _FILES)
        self._early = {name: RawSubscription(self._node, name, kinds[name]) for name in topics.in_order}

    def find(self, wait_ns: int, stopping: Callable[[], bool]) -> VariableTable | None:
        """Wait for the rack's table; return None if it does not arrive. Then only that rack's messages are recorded.

        Raises:
            CdrError: the message is not a table.
            SeveralRacks: several racks have this name.
        """
        topic = self._topics.variables
        source = self._early.pop(topic, None) or RawSubscription(self._node, topic, self._topics.all[topic])
        tables: dict[bytes, TakenMessage] = {}
        deadline = time.monotonic_ns() + wait_ns
        try:
            while not stopping() and time.monotonic_ns() < deadline:
                for found in source.taken():
                    tables[participant(found.sender)] = found
                racks = self.binding.racks() if self.binding.knows_senders else set(tables)
                if len(tables) > MOST_TABLES:
                    tables = {sender: found for sender, found in tables.items() if sender in racks}
                if len(racks) > 1:
                    raise SeveralRacks(f"{len(racks)} racks are called {self._space}", "stop one of them")
                for rack in racks & tables.keys():
                    return self._bind(tables[rack])
                time.sleep(LOOK_S)
        finally:
            source.close()
        return None

    def _bind(self, found: TakenMessage) -> VariableTable:
        self.binding.bind(found.sender)
        self._table = found.payload or b""
        table = table_of(self._table)
        self._run_id = table.run_id
        self._subscribe_presences()
        return table

    def _subscribe_presences(self) -> None:
        if self._presences is None:
            self._presences = RawSubscription(self._node, f"{self._space}/bus/presence", _PRESENCE)

    def files(self, stopping: Callable[[], bool]) -> list[RackFile]:
        """Return the files that the rack runs from; an empty list if it does not publish them.

        Raises:
            RackFilesError: the message does not hold files.
        """
        if self._files is None:
            self._files = RawSubscription(self._node, self._topics.config, _FILES)
        deadline = time.monotonic_ns() + FILES_WAIT_NS
        while time.monotonic_ns() < deadline and not stopping():
            found = [item.payload for item in self._ours(self._files) if item.payload]
            if found:
                return _files(found[-1])
            time.sleep(LOOK_S)
        return []

    def open(
        self,
        folder: Path,
        files: list[RackFile],
        tasks: Collection[str] | None,
        storage: StorageOptions,
        split_ns: int = 0,
    ) -> LiveRecording:
        """Create the bag and subscribe; ``step`` records messages. ``split_ns`` is that of ``LiveRecording``.

        Raises:
            RecordingError: the folder exists already or cannot be written.
        """
        return self.follow(lambda topics: LiveRecording(folder, topics, self._table, files, tasks, storage, split_ns))

    def follow(
        self, make: Callable[[LiveTopics], _Receiver], others: Mapping[str, TopicKind] | None = None
    ) -> _Receiver:
        """Subscribe; ``step`` gives messages to what ``make`` returns for the rack's topics, and those of ``others``.

        ``make`` may take topics of common variables away.
        """
        offered = dict(self._node.get_topic_names_and_types())
        self._topics = topics = LiveTopics(self._space, table_of(self._table), offered)
        receiver = self.recording = make(topics)
        kinds = {**(others or {}), **topics.all}
        early, self._early = self._early, {}
        for name, subscription in list(early.items()):
            if subscription.kind != kinds.get(name):
                early.pop(name).close()  # the rack is not what its file says
        self._subscriptions = [
            early.get(name) or RawSubscription(self._node, name, kinds[name])
            for name in (*(others or ()), *topics.in_order)
        ]
        self._files = self._files or RawSubscription(self._node, topics.config, _FILES)
        return receiver

    def step(self) -> None:
        """Take the messages received and record those that are due."""
        assert self.recording is not None
        now = time.monotonic_ns()
        self._poll()
        self._poll_files()
        due = self._order.due(now)
        for sent_ns, (topic, payload) in due:
            self.recording.take(topic, sent_ns, payload)
        if due:
            self._last_due = now
        elif now - self._last_due > HOLD_NS:
            self.recording.flush(now - self._last_due)
        if now >= self._next_request or self.recording.files_begun > self._files_begun:
            self._files_begun = self.recording.files_begun
            self._request_image(now)

    def finish(self) -> None:
        """Take and record the remaining messages, and finish the bag; a disk error is the recording's failure."""
        if self.recording is None:
            return
        self._poll()
        self._poll_files()
        for sent_ns, (topic, payload) in self._order.rest():
            self.recording.take(topic, sent_ns, payload)
        self.recording.close()

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()

    def _poll(self) -> None:
        self._poll_presences()
        self.binding.look()
        table = self.binding.successor()
        if table is not None:
            self._order.add(table.sent_ns, (self._topics.variables, table.payload or b""))
        for subscription in self._subscriptions:
            topic = subscription.topic
            for found in self._ours(subscription):
                if topic in self._topics.values:
                    self._count_lost(topic, found.number)
                self._order.add(found.sent_ns, (topic, found.payload or b""))

    def _ours(self, subscription: RawSubscription) -> Iterator[TakenMessage]:
        topic, binding = subscription.topic, self.binding
        for found in subscription.taken():
            if binding.is_ours(topic, found):
                yield found
            elif topic == self._topics.variables:
                binding.keep(found)

    def _poll_presences(self) -> None:
        if self._presences is None:
            return
        for found in self._presences.taken():
            with suppress(CdrError):
                presence = decode(_PRESENCE.type_name, found.payload or b"")
                if isinstance(presence, Presence) and presence.run_id == self._run_id:
                    self.binding.admit(found.sender)

    def _poll_files(self) -> None:
        """Store the source of a task that was reloaded meanwhile: the rack publishes its files again then."""
        assert self._files is not None
        assert self.recording is not None
        for found in self._ours(self._files):
            try:
                self.recording.store(_files(found.payload or b""))
            except RackFilesError as error:
                self.recording.notes.append(f"left out what {self._topics.config} told: {error}")

    def _count_lost(self, topic: str, number: int) -> None:
        """Count lost values of a common: the publisher keeps only one of them."""
        before = self._numbers.get(topic, 0)
        if before and number > before + 1:
            self.lost_values[topic] += number - before - 1
        if number:
            self._numbers[topic] = number

    def _request_image(self, now: int) -> None:
        """Request the data that recording still needs; the rack sends it again to every new subscriber."""
        assert self.recording is not None
        for request in self._requests:
            request.close()
        self._requests.clear()
        self._next_request = now + (_REQUEST_NS if self._request_count < _MOST_REQUESTS else _SLOW_REQUEST_NS)
        wanted = [self._topics.snapshot] if self.recording.wants_image else []
        wanted += [self._topics.states] if self.recording.wants_states else []
        if not wanted:
            self._request_count = 0
        else:
            self._request_count += 1
            kinds = self._topics.all
            self._requests = [RawSubscription(self._node, name, kinds[name]) for name in wanted]


def _files(payload: bytes) -> list[RackFile]:
    """Return the files in a message of the topic ``config``.

    Raises:
        RackFilesError: the message does not hold files.
    """
    try:
        return files_from_text(str(decode("std_msgs/msg/String", payload)[0]))
    except CdrError as error:
        raise RackFilesError(str(error)) from error


def _nothing(_: Any) -> None:
    """Do nothing: messages are polled."""
