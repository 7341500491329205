"""Records a rack's stream into a bag, with the rack's file and all sources stored inside."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import automax_ros
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.rack_files import files_of
from automax_ros.messages.types.topics import Take, Topic
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recording import Recording
from automax_ros.recordings.write.writer import BagWriter
from automax_ros.runtime.time.scheduler import EventClass, EventKey

_FIRST = EventKey(EventClass.OUTSIDE, -1, "")
"""Before all other events of an instant: the rack is in the state that the previous instant left."""


EDITED, STOCK = "edited", "stock"
"""Keys of a recording's custom data: what was edited; what a rack with rolls and webs has found on them (JSON)."""


@dataclass(frozen=True)
class RecordingOptions:
    """Options that select what is recorded, and into how many files.

    A file ends at each multiple of ``split_ns`` of rack time, 0 for never. ``tasks`` are those whose scans and states
    are recorded, None for all; common memory is always recorded whole. ``every_state``: a state after each such scan.
    ``edited``: what was edited and when, in words, if the run is that of another recording with an edit.
    """

    storage: StorageOptions = field(default_factory=StorageOptions)
    split_ns: int = 0
    tasks: frozenset[str] | None = None
    every_state: bool = False
    edited: str = ""


class Recorder(Recording):
    """Records one run. Create it before the rack is started; ``close`` finishes the bag.

    If the disk cannot be written, recording ends and ``failure`` is the reason; the rack continues.
    """

    def __init__(self, rack: Rack, stream: RackStream, folder: Path, options: RecordingOptions | None = None) -> None:
        """Create the bag and subscribe to the stream.

        Raises:
            RecordingError: the folder exists already or cannot be written.
        """
        options = options or RecordingOptions()
        provenance = {
            "rack": rack.config.name,
            "version": automax_ros.__version__,
            "fingerprint": f"{rack.fingerprint:016x}",
        }
        if options.edited:
            provenance[EDITED] = options.edited
        if rack.plants.found:
            provenance[STOCK] = json.dumps(rack.plants.found)
        scheduler = rack.scheduler
        writer = BagWriter(
            folder,
            custom_data=provenance,
            options=options.storage,
            keeps_pace=lambda: scheduler.zero_ns is not None,
        )
        super().__init__(writer, files_of(rack))
        self._rack, self._stream = rack, stream
        self._split_posted = False
        self._splits_by_size = options.storage.split_bytes > 0
        if options.split_ns:
            first_ns = (rack.now_ns // options.split_ns + 1) * options.split_ns
            rack.scheduler.every(options.split_ns, first_ns, _FIRST, lambda now_ns, _: self._split(now_ns))
        self._takes = stream.add_sink(self._sink, tasks=options.tasks, every_state=options.every_state)

    @property
    def has_tasks(self) -> bool:
        """Whether there are tasks whose scans it could record."""
        return bool(self._rack.tasks)

    @property
    def scans(self) -> int:
        """The number of scans recorded so far; what a task does before its first, scan 0, counts too."""
        topics = {topic.name for topic in self._stream.scans_topics.values()}
        return self._writer.count(topics)

    def begin_here(self) -> None:
        """Record the present state first, between two scans: the stream has begun before, and the rack runs already."""
        self._stream.repeat_facts(self._takes)

    def flush(self, now_ns: int) -> None:
        """Hand a chunk whose time has passed at a rack time to the operating system, even without new messages.

        To be called periodically on the wall clock; in simulated time the next message does it.
        """
        self._flush(self._stream.stamp(now_ns))

    def close(self) -> None:
        """Finish the bag; that of a rack that was never started has its tables and its state, and no scan."""
        if not self._stream.has_begun:
            self._stream.repeat_facts(self._takes)
        self._finish()

    def _sink(self, topic: Topic) -> Take:
        """Return the function that records messages of a topic."""
        channel = self._writer.channel(topic.name, topic.type_name, topic.qos)
        writer = self._writer

        def take(stamp: int, payload: bytes) -> None:
            if self.failure is None:
                try:
                    writer.write(channel, stamp, payload)
                except RecordingError as error:
                    self.failure = error

        def take_and_measure(stamp: int, payload: bytes) -> None:
            take(stamp, payload)
            if self._writer.split_due and not self._split_posted:
                self._split_posted = True
                self._rack.scheduler.at(self._rack.now_ns + 1, _FIRST, self._split)

        def take_and_store(stamp: int, payload: bytes) -> None:
            take_and_measure(stamp, payload)
            self.store(files_of(self._rack))  # the operation may have been a reload

        if topic == self._stream.operations_topic:
            return take_and_store
        return take_and_measure if self._splits_by_size else take

    def _split(self, now_ns: int) -> None:  # noqa: ARG002
        """Begin the next file; called as an event of the scheduler, between scans."""
        self._split_posted = False
        if self.failure is not None:
            return
        with self._enduring():
            self._store(files_of(self._rack))  # a task may have been reloaded, and each file can be replayed alone
            self._writer.split()
        self._stream.repeat_facts(self._takes)
