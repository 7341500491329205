"""Records the messages of a running rack, in the order in which they were sent, into a bag that can be replayed.

A recorder that joins late knows nothing of common memory until it receives an image. Writes older than the image are
dropped; newer ones must follow it without a gap in their numbers, or recording is suspended until the next image.
Messages between two writes wait for the second: only its number proves that memory was as recorded. A task's scans are
recorded from one with all latched values (``full``) on; earlier scans cannot be interpreted.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from automax_ros.core.kinds import WriterKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.messages.cdr.message_headers import (
    WriteHead,
    image_head,
    operation_head,
    plant_stamp,
    scan_head,
    table_of,
    write_head,
)
from automax_ros.messages.types.messages import VariableTable
from automax_ros.messages.types.rack_files import RackFile
from automax_ros.recordings.live.topics import LiveTopics, lacking, provenance
from automax_ros.recordings.live.tracks import Gap, TaskProgress, has_written, possible, task_head, timely
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.read.common_log import WriteLog
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recording import Recording
from automax_ros.recordings.write.writer import MAX_STAMP, BagWriter, RecordedChannel

SETTLE_NS = NS_PER_S
"""If no write is received for this long, none is missing."""
LATE_NS = 10 * NS_PER_S
"""Longest wait for a scan's write (decision): on a busy host the process of common memory may be late."""
MOST_EARLY = 16
"""Most states of a task that wait for its scans (decision: a task sends one where it starts or ends, or when asked)."""
MAX_PENDING = 100_000
"""Most messages that wait for the next write."""
_RESTARTED = "the rack was started again"
_MALFORMED_NAMED = 3


class LiveRecording(Recording):
    """One recording of a running rack; call ``take`` with every message in order, ``close`` finishes the bag.

    ``failure`` is why the disk ended the recording, ``ended`` why the rack did; both are None until then. Of ``scans``
    that are recorded ``executable`` can be executed again: they follow a state, or are their task's first.
    ``notes`` are lines for the user, which the caller removes.
    """

    def __init__(
        self,
        folder: Path,
        topics: LiveTopics,
        table: bytes,
        files: Sequence[RackFile] = (),
        tasks: Collection[str] | None = None,
        storage: StorageOptions | None = None,
        split_ns: int = 0,
    ) -> None:
        """Create the bag with the rack's files in it. ``table`` is the VariableTable, ``tasks`` those to record.

        A further file begins with the first image after each multiple of ``split_ns`` of rack time, 0 for never, or
        after the size that ``storage`` gives; that image is requested from the rack.

        Raises:
            RecordingError: the folder exists already or cannot be written.
            CdrError: the table is malformed.
        """
        self._facts: VariableTable = table_of(table)
        super().__init__(BagWriter(folder, options=storage), files)
        self.ended: str | None = None
        self.notes: list[str] = []
        self.gaps: list[Gap] = []
        self.scans = self.executable = self.writes = self.values = self.dropped = self.malformed = 0
        self.first_stamp: int | None = None
        self.last_stamp = 0
        self.replayable_from: int | None = None
        self._topics, self._table, self._files = topics, table, files
        self._log = WriteLog(self._facts.run_id)
        names = [writer.name for writer in self._facts.writers if writer.kind == WriterKind.TASK]
        self._tasks = {name: TaskProgress() for name in names if tasks is None or name in tasks}
        self._wrong_sources: list[str] = []
        self._proves = self._recording = False
        self._image: tuple[int, WriteHead, bytes] | None = None
        self._pending: list[tuple[str, int, bytes]] = []
        self._proven_ns = self._last_write = self._last_sent = 0
        self._newest_write = (0, 0)
        self._open_gap: int | None = None
        self._last_values: dict[str, bytes] = {}
        self._values_now: dict[str, bytes] = {}
        self.files_begun = 1
        self._split_ns, self._next_split = split_ns, 0
        self._takers: dict[str, Callable[[str, int, bytes], None]] = {
            topics.variables: self._take_table,
            topics.snapshot: self._take_image,
            topics.backplane: self._take_write,
            **dict.fromkeys((topics.scans, topics.states, topics.operations), self._keep),
            **dict.fromkeys((*topics.values, *topics.plants), self._keep),
        }
        self._recorders: dict[str, Callable[[str, int, bytes], None]] = {
            topics.scans: self._record_scan,
            topics.states: self._record_state,
            topics.operations: self._record_operation,
            **dict.fromkeys(topics.values, self._record_value),
            **dict.fromkeys(topics.plants, self._record_plant),
        }
        self._channels: dict[str, RecordedChannel] = {
            name: self._writer.channel(name, kind.type_name, kind.qos) for name, kind in topics.all.items()
        }

    @property
    def wants_image(self) -> bool:
        """Whether recording, or the next file, waits for an image from the rack."""
        return self._split_due if self._recording else self._image is None

    @property
    def wants_states(self) -> bool:
        """Whether a task waits for a full scan or a state."""
        return self._recording and not all(track.alone for track in self._tasks.values())

    @property
    def rests(self) -> bool:
        """Whether something is not recorded, or cannot be replayed, until the rack sends an image or states."""
        return not self._recording or not all(track.ready for track in self._tasks.values())

    @property
    def lacks(self) -> list[str]:
        """The parts that the bag lacks for a replay without the repository."""
        waiting = [task for task, track in self._tasks.items() if not track.ready and self.first_stamp is not None]
        return lacking(self._files, self._tasks, self._wrong_sources, self._topics.left_out, waiting)

    def take(self, topic: str, sent_ns: int, payload: bytes) -> None:
        """Record a message of one of the topics, sent at a time of the rack's clock."""
        if self.failure is not None or self.ended is not None:
            return
        try:
            self._takers[topic](topic, sent_ns, payload)
        except CdrError as error:
            self._note_malformed(topic, error)
        except RecordingError as error:
            self.failure = error

    def seconds(self, stamp: int) -> float:
        """Return a stamp as seconds from the start of the rack's run."""
        return (stamp - self._facts.stamp) / NS_PER_S

    def flush(self, passed_ns: int) -> None:
        """Hand the open chunk to the operating system if its time has passed, ``passed_ns`` after the last message."""
        self._flush(self.last_stamp + passed_ns)

    def close(self) -> None:
        """Finish the bag."""
        if self.failure is None and self.ended is None:
            with self._enduring():
                self._settle(at_end=True)
                for track in self._tasks.values():
                    track.follows = False
                    self._record_early(track)
        if self.failure is None:
            replayable_s = None if self.replayable_from is None else self.seconds(self.replayable_from)
            gaps = [f"{self.seconds(gap.stamp):.6f} s: {gap}" for gap in self.gaps]
            data = provenance(self._facts.rack, self._files, self.lacks, replayable_s, gaps, self.ended)
            self._writer.custom_data.update(data)
            self._finish()

    def _take_table(self, topic: str, sent_ns: int, payload: bytes) -> None:  # noqa: ARG002
        self._check_run(timely(table_of(payload)).run_id)

    def _take_image(self, topic: str, sent_ns: int, payload: bytes) -> None:
        head = timely(image_head(payload))
        newest, newest_sent_ns = self._newest_write
        if not self._check_run(head.run_id) or (head.sequence < newest and sent_ns <= newest_sent_ns):
            return  # the writes that follow an older image were received already, or are lost
        if self._image is not None and head.sequence == self._image[1].sequence:
            self._begin()  # there was no write between the two images, so none is missing
        missing = self._log.missing(head.sequence, image=True)
        if self._recording and missing <= 0:
            if not missing:
                self._prove(sent_ns)
                if self._split_due:
                    self._split(head.stamp)
                self._write(topic, sent_ns, head.stamp, payload)
            return
        if self._recording:
            self._rest(head.stamp, missing)
        self._drop_pending()
        self._image, self._proven_ns = (sent_ns, head, payload), sent_ns

    def _take_write(self, topic: str, sent_ns: int, payload: bytes) -> None:
        head = timely(write_head(payload))
        if not self._check_run(head.run_id):
            return
        self._newest_write = max(self._newest_write, (head.sequence, sent_ns))
        if not self._recording and self._image is not None:
            image = self._image[1].sequence
            if head.sequence == image + 1:
                self._begin()
            elif head.sequence > image:
                self._image = None
                self._drop_pending()
        missing = self._log.missing(head.sequence, image=False)
        if not self._recording or missing < 0:
            return
        if missing:
            self._rest(head.stamp, missing)
            return
        self._prove(sent_ns)
        self._log.sequence, self._last_write = head.sequence, head.stamp
        self.writes += 1
        self._write(topic, sent_ns, head.stamp, payload)

    def _record_scan(self, topic: str, sent_ns: int, payload: bytes) -> None:
        head = timely(scan_head(payload))
        track = self._tasks.get(head.task)
        if track is None:
            return
        if track.began_anew(head.scan, head.stamp, proven=self._proves):
            self._end(_RESTARTED)
        if head.scan <= track.last:
            return
        if track.follows and head.scan != track.last + 1:
            missing = head.scan - track.last - 1
            self._note_gap(Gap(head.stamp, f"scans of task {head.task}", missing), "it is recorded again")
            track.rest()
        if not track.follows and not head.full:
            self.dropped += 1
            return
        track.take_scan(head.scan, head.stamp)
        self.scans += 1
        self.executable += track.ready or not head.scan
        self._write(topic, sent_ns, head.stamp, payload)
        self._look_whether_replayable(head.stamp)
        self._record_early(track)

    def _record_early(self, track: TaskProgress) -> None:
        """Record the states of a task whose scans are recorded by now."""
        early, track.early = track.early, []
        for topic, sent_ns, payload in early:
            self._record_state(topic, sent_ns, payload)

    def _record_state(self, topic: str, sent_ns: int, payload: bytes) -> None:
        state: Any = decode("automax_msgs/msg/TaskState", payload)
        possible(state.stamp)
        track = self._tasks.get(state.task)
        if track is None:
            return
        if track.began_anew(state.scan, state.stamp, proven=self._proves):
            self._end(_RESTARTED)
            return
        if track.follows and state.scan > track.last and len(track.early) < MOST_EARLY:
            track.early.append((topic, sent_ns, payload))
            return
        if track.state < 0:
            self._compare_source(state.task, state.source_hash)
        track.take_state(state.scan)
        self._write(topic, sent_ns, state.stamp, payload)
        self._look_whether_replayable(state.stamp)

    def _record_operation(self, topic: str, sent_ns: int, payload: bytes) -> None:
        stamp, run_id = timely(operation_head(payload))
        if run_id == self._log.run_id and stamp >= (self.first_stamp or 0):  # late joiners receive older ones, too
            self._write(topic, sent_ns, stamp, payload)

    def _record_plant(self, topic: str, sent_ns: int, payload: bytes) -> None:
        stamp = possible(plant_stamp(self._topics.plants[topic].type_name, payload))
        self._write(topic, sent_ns, stamp, payload)

    def _record_value(self, topic: str, sent_ns: int, payload: bytes) -> None:
        self.values += 1
        self._values_now[topic] = payload
        # A value has no stamp: it belongs to the instant of the message before, or was sent this much later.
        later = max(0, sent_ns - self._last_sent) if self._last_sent else 0
        self._write(topic, 0, min(self.last_stamp + (later if later > NS_PER_S // 1000 else 0), MAX_STAMP), payload)

    def _keep(self, topic: str, sent_ns: int, payload: bytes) -> None:
        """Keep a message until the next write, which shows whether one is missing before it."""
        if self._recording or self._image is not None:
            self._pending.append((topic, sent_ns, payload))
            if sent_ns - self._proven_ns > SETTLE_NS or len(self._pending) >= MAX_PENDING:
                self._settle()
        elif topic in self._topics.values:
            self._last_values[topic] = payload
        else:
            self.dropped += topic == self._topics.scans

    def _prove(self, sent_ns: int) -> None:
        """Record the pending messages: nothing is missing before this time."""
        self._proven_ns, self._proves = sent_ns, True
        pending, self._pending = self._pending, []
        for topic, sent, payload in pending:
            self._record(topic, sent, payload)
        self._proves = False

    def _settle(self, *, at_end: bool = False) -> None:
        """Record pending messages without the proof of a write, up to a scan whose write has not been received."""
        pending, self._pending = self._pending, []
        if self._image is not None:
            self._begin()
        for number, (topic, sent, payload) in enumerate(pending):
            again = self._begins_anew(topic, payload)
            if again and not at_end and len(pending) < MAX_PENDING:
                self._pending = pending[number:]  # a write or an image will show whether it is the same run
                return
            if not again and topic == self._topics.scans and has_written(payload, self._last_write):
                if not at_end:
                    self._pending = pending[number:]
                    if pending[-1][1] - self._proven_ns > LATE_NS or len(pending) >= MAX_PENDING:
                        self._rest(scan_head(payload).stamp, 0)
                return
            if self._recording:
                self._record(topic, sent, payload)

    def _record(self, topic: str, sent_ns: int, payload: bytes) -> None:
        if self.ended is None:
            try:
                self._recorders[topic](topic, sent_ns, payload)
            except CdrError as error:
                self._note_malformed(topic, error)

    def _begins_anew(self, topic: str, payload: bytes) -> bool:
        """Whether a message is a scan or state of a task that was put into RUN again, in this run or a later one."""
        head = task_head(self._topics, topic, payload)
        track = None if head is None else self._tasks.get(head.task)
        return head is not None and track is not None and track.began_anew(head.scan, head.stamp)

    def _drop_pending(self) -> None:
        self.dropped += sum(topic == self._topics.scans for topic, _, _ in self._pending)
        self._last_values.update(
            (topic, payload) for topic, _, payload in self._pending if topic in self._topics.values
        )
        self._pending.clear()

    def _begin(self) -> None:
        """Begin to record with the image."""
        assert self._image is not None
        sent_ns, head, payload = self._image
        self._image = None
        if self._open_gap is not None:
            # Now the number of writes that the bag lacks is known: the lost ones, and those before the image.
            number, self._open_gap = self._open_gap, None
            missing = self._log.missing(head.sequence, image=True)
            self.gaps[number] = replace(self.gaps[number], missing=missing)
        self._recording, self._log.sequence = True, head.sequence
        if self.first_stamp is None:
            self.first_stamp = head.stamp
            self._plan_split(head.stamp)
            self._write(self._topics.variables, 0, head.stamp, self._table)
        self._write(self._topics.snapshot, sent_ns, head.stamp, payload)
        for topic, value in self._last_values.items():
            self._record_value(topic, 0, value)
        self._last_values.clear()

    @property
    def _split_due(self) -> bool:
        return self._writer.split_due or bool(self._split_ns and self.last_stamp >= self._next_split)

    def _plan_split(self, stamp: int) -> None:
        origin, period = self._facts.stamp, self._split_ns or 1
        self._next_split = origin + ((stamp - origin) // period + 1) * period

    def _split(self, stamp: int) -> None:
        """Begin a further file, with all that is needed to read it alone except the image, which is written next."""
        self._plan_split(stamp)
        self._writer.split()
        self.files_begun += 1
        self._write(self._topics.variables, 0, stamp, self._table)
        for topic, payload in self._values_now.items():
            self._write(topic, 0, stamp, payload)
        for track in self._tasks.values():
            track.begin_file()

    def _rest(self, stamp: int, missing: int) -> None:
        """Suspend recording until the next image, after writes were lost."""
        self._open_gap = len(self.gaps)
        self._note_gap(Gap(stamp, "writes of common memory", missing), "recording goes on")
        self._recording, self._image = False, None
        self._drop_pending()
        for track in self._tasks.values():
            track.rest()

    def _note_gap(self, gap: Gap, then: str) -> None:
        self.gaps.append(gap)
        self.notes.append(
            f"gap at {self.seconds(gap.stamp):.3f} s of the run: {gap} did not come; "
            f"{then} from the rack's next image and states on"
        )

    def _note_malformed(self, topic: str, error: CdrError) -> None:
        self.malformed += 1
        if self.malformed <= _MALFORMED_NAMED:
            self.notes.append(f"left out a malformed message on {topic}: {error}")

    def _check_run(self, run_id: int) -> bool:
        """Return whether a message is of this run of the rack; one of another run ends the recording."""
        if run_id != self._log.run_id:
            self._end(_RESTARTED)
        return run_id == self._log.run_id

    def _end(self, reason: str) -> None:
        """End the recording after the pending messages of this run."""
        if self.ended is None:
            self._settle(at_end=True)
            self.ended = reason

    def _compare_source(self, task: str, source_hash: str) -> None:
        own = {file.sha256: file.name for file in (*self._files, *self._stored.values()) if file.owner == task}
        if own and source_hash not in own and task not in self._wrong_sources:
            self._wrong_sources.append(task)
            self.notes.append(f"the file stored as {next(iter(own.values()))} is not the source that task {task} runs")

    def _look_whether_replayable(self, stamp: int) -> None:
        if self.replayable_from is None and all(track.ready for track in self._tasks.values()):
            self.replayable_from = stamp

    def _write(self, topic: str, sent_ns: int, stamp: int, payload: bytes) -> None:
        if sent_ns:
            self._last_sent = sent_ns
            self.last_stamp = stamp
        self._writer.write(self._channels[topic], stamp, payload)
