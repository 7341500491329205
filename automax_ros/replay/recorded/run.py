"""What a recording holds, by time: values of commons, signals of plants, the scans and states of tasks, operations.

It is read once from end to end. From then on memory holds 16 bytes for each value in the write log, 140 for each state
of a plant and 40 for each scan: 50 MB for an hour of section_drive, which is read in ten seconds. Scans themselves are
read again where they are needed.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from automax_ros.core.types import Value
from automax_ros.messages.types.messages import (
    HELD_MARK,
    NAMES,
    CommonImage,
    CommonWrite,
    Operation,
    PlantState,
    RollState,
    Scan,
    TaskState,
    VariableTable,
    WebState,
)
from automax_ros.messages.types.webs_followed import WebsFollowed
from automax_ros.rack.base.observers import Operation as Operated
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.rackfile.model.config import CommonElement
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Entry, Key
from automax_ros.recordings.read.reader import BagMessage, Place
from automax_ros.recordings.tables.series import Progress
from automax_ros.replay.engine import Replay
from automax_ros.replay.recorded.values import DriveLogs, ValueLog
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.state import recorded_fields

MOST_VALUES = 100_000_000
"""Most values of the write log and states of plants that are kept (decision: a bound on memory, 2 GB)."""
_REPLAYED = frozenset(NAMES[kind] for kind in (CommonImage, CommonWrite, Operation, Scan, TaskState, VariableTable))
_DRIVES = (PlantState, RollState, WebState)
_TYPES = _REPLAYED | {NAMES[kind] for kind in _DRIVES}
_TIMED = (CommonImage, CommonWrite, Operation, TaskState, *_DRIVES)
"""Messages with the time at which they are sent; that of a scan is its latch, and one that takes time is sent later."""
_MOST_KEPT = 20_000
"""Most messages that are kept as they were read (decision: some 30 MB)."""


@dataclass(frozen=True)
class RecordedState:
    """A recorded state of a task: its time, its place in the order of messages, its log time and its chunk."""

    time_ns: int
    order: int
    log_time: int
    chunk: int
    state: TaskState


@dataclass
class TaskLog:
    """The scans of one task, in their order, and its states; ``errors`` are (time in ns, line, code, scan).

    Attributes:
        numbers: the number of each scan.
        times: when each latched, ns of the run. ``ends``: when it ended.
        orders: its place in the order of all messages. ``chunks``: its chunk.
        skipped: deadlines missed up to it.
        full: the scans, by their places here, whose messages have the whole latch.
    """

    numbers: array[int] = field(default_factory=lambda: array("Q"))
    times: array[int] = field(default_factory=lambda: array("q"))
    ends: array[int] = field(default_factory=lambda: array("q"))
    orders: array[int] = field(default_factory=lambda: array("i"))
    chunks: array[int] = field(default_factory=lambda: array("i"))
    skipped: array[int] = field(default_factory=lambda: array("q"))
    full: list[int] = field(default_factory=list)
    states: list[RecordedState] = field(default_factory=list)
    errors: list[tuple[int, int, int, int]] = field(default_factory=list)

    def begun(self, at_ns: int) -> int:
        """Return the last scan that has latched by a time; -1 if there is none."""
        return bisect_right(self.times, at_ns) - 1

    def ended(self, at_ns: int) -> int:
        """Return the last scan that has ended by a time; -1 if there is none."""
        return bisect_right(self.ends, at_ns) - 1

    def numbered(self, number: int) -> int | None:
        """Return a scan with a number, None if there is none."""
        near = bisect_left(self.numbers, number)  # true as long as the task has not gone into RUN again
        if near < len(self.numbers) and self.numbers[near] == number:
            return near
        return next((place for place, found in enumerate(self.numbers) if found == number), None)

    @property
    def state_times(self) -> list[int]:
        """The times of all states."""
        return [item.time_ns for item in self.states]

    def state_at(self, at_ns: int) -> RecordedState | None:
        """Return the last state by a time."""
        found = bisect_right(self.states, at_ns, key=lambda item: item.time_ns)
        return self.states[found - 1] if found else None


@dataclass(frozen=True)
class Start:
    """Where to begin in order to execute a scan.

    ``chunk`` is the first chunk to read, ``scan`` the first scan of the task in it and after it; ``state`` is the log
    time of the state to begin with, None for the task's start.
    """

    chunk: int
    scan: int
    state: int | None


class RecordedRun:
    """One recording; ``replay`` has its rack and its sources.

    Attributes:
        commons: the values of common memory. ``views`` are the numbers of its variables by name.
        drives: the signals of plants, rolls and webs.
        tasks: the scans of each task of the rack.
        operations: all operations, with times of the run.
        log: errors, operations, and as remarks what became of webs and gaps in the write log.
        forced: what is forced from a time on, in the order of time.
        from_ns: time of the first value or scan. ``to_ns``: of the last message.

    Raises:
        BagError: the recording is damaged, or does not fit its rack file, or holds more than ``MOST_VALUES``.
    """

    def __init__(self, replay: Replay, progress: Progress | None = None) -> None:
        self.replay, self.bag = replay, replay.bag
        variables, self.origin = replay.rack.config.variables, replay.facts.table.stamp
        self.commons, self.log = ValueLog(variables), RackLog()
        self.views = {variable.name: view for view, variable in enumerate(variables)}
        self.drives = DriveLogs()
        self._webs = WebsFollowed(replay.rack.config.plants)
        self.tasks = {name: TaskLog() for name in replay.rack.task_names}
        self.operations: list[Operated] = []
        self.forced: list[tuple[int, frozenset[Key]]] = []
        self._memory = RecordedCommons(self.bag, replay.facts, replay.rack.config)
        self._images: list[tuple[int, int]] = []
        self._places: list[Place] = []
        self._layouts: dict[tuple[object, ...], tuple[Sequence[str], Sequence[int]]] = {}
        self._kept: OrderedDict[int, list[BagMessage]] = OrderedDict()
        self._ahead: tuple[int, Iterator[list[BagMessage]]] | None = None
        self._states = 0
        self.from_ns = self.to_ns = 0
        self._read(progress)

    def start_of(self, task: str, scan: int) -> Start:
        """Return where to begin for a scan of a task, by its place in the task's log."""
        own = self.tasks[task]
        order = own.orders[scan]
        state = bisect_left(own.states, order, key=lambda item: item.order) - 1
        full = bisect_right(own.full, scan) - 1
        image = bisect_left(self._images, (order,)) - 1
        if min(state, full, image) < 0:
            return Start(0, 0, None)
        begin = own.states[state]
        chunk = min(begin.chunk, own.chunks[own.full[full]], self._images[image][1])
        return Start(chunk, bisect_left(own.chunks, chunk), begin.log_time)

    def start_following(self, task: str, scan: int | None) -> Start:
        """Return where to begin in order to follow the latches from a scan on whose message has the whole latch.

        The task begins with no recorded state; with None, at its start.
        """
        if scan is None:
            return Start(0, 0, None)
        own = self.tasks[task]
        image = bisect_left(self._images, (own.orders[scan],)) - 1
        chunk = min(own.chunks[scan], self._images[image][1]) if image >= 0 else 0
        return Start(chunk, bisect_left(own.chunks, chunk), -1)

    def place_of(self, scan: Scan) -> int:
        """Return the place of a recorded scan in its task's log."""
        own, time_ns = self.tasks[scan.task], self.time_of(scan.stamp)
        place = bisect_left(own.times, time_ns)
        while own.numbers[place] != scan.scan:
            place += 1
        return place

    def messages(self, chunk: int) -> Iterator[BagMessage]:
        """Yield the messages from a chunk on that a replay needs; those read last are kept for the next time.

        Raises:
            BagError: the recording has changed since and is damaged now.
        """
        if not self._places:
            yield from self.replay.reader.again().messages(types=_REPLAYED)
        for number in range(chunk, len(self._places)):
            if number not in self._kept:
                self._read_chunk(number)
            self._kept.move_to_end(number)
            yield from self._kept[number]

    def close(self) -> None:
        """Close the file that is read."""
        self._ahead = None

    def _read_chunk(self, number: int) -> None:
        if self._ahead is None or self._ahead[0] != number:
            self._ahead = number, self._chunks_from(number)
        try:
            self._kept[number] = next(self._ahead[1])
        except BagError:
            self._ahead = None
            raise
        self._ahead = number + 1, self._ahead[1]
        while sum(map(len, self._kept.values())) > _MOST_KEPT and len(self._kept) > 1:
            self._kept.popitem(last=False)

    def _chunks_from(self, number: int) -> Iterator[list[BagMessage]]:
        reader, found = self.replay.reader.again(), list[BagMessage]()
        ends = {place[:2]: index for index, place in enumerate(self._places)}
        for entry in reader.messages(types=_REPLAYED, after=self._places[number - 1] if number else None):
            place = reader.place
            now = ends.get(place[:2], len(ends)) if place is not None else 0
            while number < now:
                yield found
                found, number = [], number + 1
            found.append(entry)
        while number < len(ends):
            yield found
            found, number = [], number + 1

    def value(self, name: CommonElement, at_ns: int) -> Value | None:
        """Return the value of a common at a time, None if it is not known."""
        return self.commons.at((self.views[name.name], name.index), at_ns)

    def time_of(self, stamp: int) -> int:
        """Return the time of a stamp in ns of the run."""
        return max(0, stamp - self.origin)

    def _read(self, progress: Progress | None) -> None:
        reader = self.replay.reader.again()
        reader.on_progress = progress
        known = self._memory.gaps
        chunk, position, time_ns, written_ns = 0, (0, 0), 0, 0
        for order, entry in enumerate(reader.messages(types=_TYPES)):
            message = entry.message
            if isinstance(message, _TIMED):
                time_ns = max(time_ns, self.time_of(message.stamp))
            place = reader.place
            if place is not None and place[:2] != position:
                position = place[:2]
                self._places.append(place)
                chunk = len(self._places) - 1
            if isinstance(message, (CommonImage, CommonWrite)):
                entries = self._memory.take(message)
                if self._memory.gaps != known:
                    known = self._memory.gaps
                    self.commons.lose(written_ns)
                    self.log.note(time_ns, "writes are missing before this")
                if entries is not None:
                    written_ns = time_ns
                    self._take_values(time_ns, message, entries, (order, chunk))
            elif isinstance(message, Scan):
                self._take_scan(message, order, chunk)
            elif isinstance(message, TaskState):
                self._take_state(message, RecordedState(time_ns, order, entry.log_time, chunk, message))
            elif isinstance(message, _DRIVES):
                self._states += self.drives.take(time_ns, message)
                if not isinstance(message, PlantState) and (text := self._webs.take(message)):
                    self.log.note(time_ns, text)
            elif isinstance(message, Operation):
                self._take_operation(message)
            elif isinstance(message, VariableTable):
                self._memory.check_table(message)
            if len(self.commons) + self._states > MOST_VALUES:
                hint = "open one file of it, or a shorter recording"
                raise BagError("AMX6814", self.bag, f"holds more than {MOST_VALUES} values", hint)
        self.commons.finish()
        self.to_ns = max([time_ns, *(own.ends[-1] for own in self.tasks.values() if own.ends)])
        first = [own.times[0] for own in self.tasks.values() if own.times]
        self.from_ns = min([self.to_ns, self.commons.first_ns, *first])

    def _take_values(
        self, time_ns: int, message: CommonImage | CommonWrite, entries: list[Entry], place: tuple[int, int]
    ) -> None:
        image = isinstance(message, CommonImage)
        self.commons.take(time_ns, entries, image=image)
        if image:
            self._images.append(place)
        if self._memory.forced != (self.forced[-1][1] if self.forced else frozenset()):
            self.forced.append((time_ns, self._memory.forced))

    def _take_scan(self, scan: Scan, order: int, chunk: int) -> None:
        own = self.tasks.get(scan.task)
        if own is None:
            text = f"has scans of a task {scan.task[:40]!r}, which its rack.yaml does not have"
            raise BagError("AMX6831", self.bag, text)
        begin, before = self.time_of(scan.stamp), len(own.times) - 1
        if before >= 0:
            begin = max(begin, own.times[before])
        if scan.full:
            own.full.append(len(own.times))
        own.numbers.append(scan.scan)
        own.times.append(begin)
        own.ends.append(max(begin + scan.duration_ns, own.ends[before] if before >= 0 else 0))
        own.orders.append(order)
        own.chunks.append(chunk)
        own.skipped.append(scan.skipped + (own.skipped[before] if before >= 0 else 0))
        for error in scan.errors:
            own.errors.append((begin, error.line, error.code, scan.scan))
            self.log.error(begin, scan.task, error.line, error.code, scan.scan)

    def _take_state(self, state: TaskState, found: RecordedState) -> None:
        own = self.tasks.get(state.task)
        if own is not None:
            recorded_fields(self.bag, state)
            key = (state.layout_hash, *(name for name in state.field if name.startswith(HELD_MARK)))
            fields, sizes = self._layouts.setdefault(key, (state.field, state.size))
            if (fields, sizes) == (state.field, state.size):
                state = state._replace(field=fields, size=sizes, value=array("d", state.value))
            own.states.append(RecordedState(found.time_ns, found.order, found.log_time, found.chunk, state))

    def _take_operation(self, message: Operation) -> None:
        done = message.what, message.task, message.ok, message.reason, message.detail
        operation = Operated(self.time_of(message.stamp), *done)
        self.operations.append(operation)
        self.log.operation(operation)
