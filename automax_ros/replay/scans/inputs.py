"""The inputs of a recorded scan: common memory rebuilt from the write log, with the four memory operations of a scan.

In the log a scan precedes its writes, so common memory as rebuilt so far is the memory that the scan saw.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Sequence

from automax_ros.compile.base.scan_io import MUST_WAIT
from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import DataType, Latched, Value, same_bits
from automax_ros.messages.types.messages import Scan
from automax_ros.recordings.read.common_log import Entry, Key
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.drives import DRIVES, RecordedDrive
from automax_ros.runtime.memory.views import LatchPlan, latch_plan
from automax_ros.runtime.scan.channels import CHANNEL_VIEWS, Message, item_types

CHANNELS = frozenset(CHANNEL_VIEWS.values())
"""The views of values from channels."""


class RecordedChannels:
    """Channels on which each access has the outcome of the recorded burst's next access to that channel number.

    After the last of those an edited task must wait (decision: what it would have received is unknown).
    """

    def __init__(self) -> None:
        """Create the channels, before the first burst."""
        self._entries: dict[int, deque[tuple[int, Value]]] = {}
        self.other: list[tuple[int, Message, Message]] = []

    def begin(self, entries: Iterable[Entry]) -> None:
        """Begin a burst with its recorded entries: view, number of the channel, value."""
        self._entries = {}
        self.other.clear()
        for view, number, value in entries:
            self._entries.setdefault(number, deque()).append((view, value))

    def open_reader(self, number: int, types: str, depth: int, reader: str, now_ns: int) -> int:  # noqa: ARG002
        """Return the recorded outcome."""
        return self._outcome(number)

    def open_writer(self, number: int, types: str) -> int:  # noqa: ARG002
        """Return the recorded outcome."""
        return self._outcome(number)

    def receive(self, number: int, types: str, reader: str, now_ns: int) -> tuple[Message, int]:  # noqa: ARG002
        """Return the recorded message and outcome."""
        outcome = self._outcome(number)
        if outcome:
            return (), outcome
        items = self._items(number, types)
        return (items, 0) if len(items) == len(types) else ((), MUST_WAIT)

    def send(self, number: int, types: str, message: Message, now_ns: int) -> int:  # noqa: ARG002
        """Return the recorded outcome; a message that differs from the recorded one is kept in ``other``."""
        outcome = self._outcome(number)
        if not outcome:
            recorded = self._items(number, types)
            if len(recorded) != len(message) or not all(map(same_bits, recorded, message)):
                self.other.append((number, recorded, message))
        return outcome

    def unsent(self, number: int) -> Message:
        """Return the items that the recorded burst sent to a channel and this one did not, as one message."""
        return tuple(value for _, value in self._entries.get(number, ()))

    def _items(self, number: int, types: str) -> Message:
        """Return the next items as far as they are of these types."""
        items: list[Value] = []
        for kind in item_types(types):
            item = self._next(number, CHANNEL_VIEWS[kind])
            if item is None:
                break
            items.append(item)
        return tuple(items)

    def _outcome(self, number: int) -> int:
        outcome = self._next(number, CHANNEL_VIEWS[DataType.INTEGER])
        return outcome if isinstance(outcome, int) else MUST_WAIT

    def _next(self, number: int, view: int) -> Value | None:
        entries = self._entries.get(number)
        if not entries or entries[0][0] != view:
            return None
        return entries.popleft()[1]


_APART = CHANNELS | DRIVES
"""The views of inputs that do not come from memory."""


class ReplayMemory:
    """Common memory as one task's recorded scans saw it; the replayed task's own changes are kept separately.

    A scan reads its own writes, of this scan or of an earlier one unless there was another write since. As long as it
    reads and writes in the recorded order, its other reads return the recorded values; but where the recorded scan
    wrote the variable itself, an edited one, which may not have done so, reads the memory of the recording.

    ``apart`` are the values that the task's own writes left different from the recorded ones. ``channels`` are those of
    a BASIC task, ``drive`` is that of a current minor loop task.

    A modeled scan is in the log where it ended, after some of its own writes. An edited one reads the memory at that
    place, without these: others may have written it since the latch (decision).
    """

    def __init__(self, commons: RecordedCommons, *, edited: bool = False) -> None:
        """Create the memory on that of the recording; ``edited``: a different source runs than the recorded one."""
        self.now_ns = 0
        self.channels = RecordedChannels()
        self.drive = RecordedDrive()
        self._edited = edited
        self.apart: dict[Key, Value] = {}
        self._commons = commons
        self._index = {variable.name: view for view, variable in enumerate(commons.rack)}
        self._views: tuple[int, ...] = ()
        self._positions: dict[int, int] = {}
        self._recorded: list[Value] = []
        self._unrecorded: set[int] = set()
        self._in_step = False
        self._reads: list[Entry] = []
        self._read_count = 0
        self._writes: list[Entry] = []
        self._rewritten: frozenset[Key] = frozenset()
        self._write_count = 0
        self._committed: list[Entry] = []
        self._own: dict[Key, Value] = {}
        self._forced: frozenset[Key] = frozenset()
        self._on_forces: list[Callable[[], None]] = []
        self._before: dict[Key, Value] = {}
        """Former values of variables that the next recorded scan has written already."""

    @property
    def carried(self) -> tuple[object, ...]:
        """The state left by earlier scans, except what the next full scan records again."""
        return sorted(self.apart.items()), sorted(self._before.items())

    def view(self, name: str) -> int:
        """Return the view of a variable by its full name; KeyError if the rack has none."""
        return self._index[name]

    def is_forced(self, view: int) -> bool:
        """Return whether a force held a simple view when the recorded scan latched."""
        return (view, 0) in self._forced

    def under_force(self, view: int) -> Value:
        """Return the value that the recorded scan found under a force."""
        return self.read_now(view)

    def watch_forces(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` whenever the set of forces for a scan differs from that for the previous one."""
        self._on_forces.append(changed)

    def plan(self, views: Sequence[int]) -> LatchPlan:
        """Remember the views that the task latches."""
        self._views = tuple(views)
        self._positions = {view: position for position, view in enumerate(self._views)}
        self._recorded = [0] * len(self._views)
        self.forget_latch()
        return latch_plan(views)

    def forget_latch(self) -> None:
        """Forget the latched values, after scans that are missing."""
        self._unrecorded = set(range(len(self._views)))

    def follow(self, scan: Scan) -> None:
        """Apply the newly latched values of a scan; to be called for each scan, executed or not.

        Raises:
            BagError: the scan does not fit the variables of the rack.
        """
        if not scan.scan:
            return
        if scan.full:
            self.forget_latch()
        for view, _, value in self._commons.entries(scan.latched, scan.stamp):
            position = self._positions.get(view)
            if position is not None:
                self._recorded[position] = value
                self._unrecorded.discard(position)

    @property
    def is_uniform(self) -> bool:
        """Whether the inputs of a scan are exactly the values that the recorded one latched and read."""
        return not (self._unrecorded or self.apart or self._before or self._forced)

    @property
    def is_alone(self) -> bool:
        """Whether the inputs of a scan are those of the recorded one, and what the task itself has left."""
        return not (self._before or self._forced)

    @property
    def unrecorded(self) -> Collection[int]:
        """The places of the latched views whose values the recorded scans did not latch."""
        return self._unrecorded

    @property
    def latched_last(self) -> Sequence[Value]:
        """The values that the task latched last."""
        return self._recorded

    def follow_skipped(self, latched: Sequence[Value]) -> None:
        """Apply the values that the last scan executed by columns latched."""
        self._recorded[:] = latched

    def begin(self, scan: Scan) -> None:
        """Prepare for the execution of a scan, after ``follow``.

        Raises:
            BagError: the scan does not fit the variables of the rack.
        """
        commons = self._commons
        reads = commons.reads(scan.read, scan.stamp)
        self._reads = [entry for entry in reads if entry[0] not in _APART]
        self.channels.begin(entry for entry in reads if entry[0] in CHANNELS)
        self.drive.begin(entry for entry in reads if entry[0] in DRIVES)
        self._writes = commons.entries(scan.written, scan.stamp)
        self._committed = commons.entries(scan.committed, scan.stamp)
        self._rewritten = frozenset(entry[:2] for entry in self._writes) if self._edited else frozenset()
        self._read_count = self._write_count = 0
        self._in_step = True
        self._own.clear()
        forced = commons.forced_at(scan.stamp) if scan.duration_ns else commons.forced
        if forced != self._forced:
            self._forced = forced
            for changed in self._on_forces:
                changed()

    def latch(self, plan: LatchPlan) -> Latched:  # noqa: ARG002
        """Return the recorded latch, with this task's own values for variables that only it latches or has changed."""
        if not self._unrecorded and not self.apart:
            return tuple(self._recorded)
        values = list(self._recorded)
        for position in self._unrecorded:
            if (self._views[position], 0) not in self.apart:
                values[position] = self._recorded_value((self._views[position], 0))
        for (view, _), value in self.apart.items():
            latched_at = self._positions.get(view)
            if latched_at is not None:
                values[latched_at] = value
        return tuple(values)

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return the present value as the scan sees it."""
        key = (view, element)
        number = self._read_count
        if self._in_step:
            self._read_count = number + 1
            self._in_step = number < len(self._reads) and self._reads[number][:2] == key
        if self._in_step and not self._edited and key not in self.apart:
            return self._reads[number][2]  # others may have written since the scan's own write
        if key in self._own:
            return self._own[key]
        if key in self.apart:
            return self.apart[key]
        if self._in_step and key not in self._rewritten:
            return self._reads[number][2]
        return self._recorded_value(key)

    def write_now(
        self,
        view: int,
        value: Value,
        writer: int,  # noqa: ARG002
        element: int = 0,
        kind: WriteKind = WriteKind.BASIC,  # noqa: ARG002
    ) -> None:
        """Keep the write of a BASIC statement."""
        self._take(view, element, value)
        number = self._write_count
        self._write_count = number + 1
        if self._in_step:
            if number < len(self._writes):
                recorded = self._writes[number]
                self._in_step = recorded[0] == view and recorded[1] == element and same_bits(recorded[2], value)
            else:
                self._in_step = False

    def commit(self, changes: Iterable[tuple[int, Value]], writer: int) -> None:  # noqa: ARG002
        """Keep the changes by blocks."""
        for view, value in changes:
            self._take(view, 0, value)

    def finish(self, commits: Sequence[tuple[int, Value]]) -> list[tuple[Key, Value, Value]]:
        """End a scan; return the differences from the recorded memory: key, recorded and replayed value.

        Raises:
            UnknownValue: a value is needed that is not in the recording.
        """
        if not self.apart and self.writes_agree and self._commits_agree(commits):
            self._before.clear()
            return []
        recorded = self._recorded_changes()
        different: list[tuple[Key, Value, Value]] = []
        for key in sorted({*recorded, *self._own, *self.apart}):
            before = None if key in recorded else self._commons.value(key)
            its = recorded[key] if before is None else before
            if key in self._own:
                own = self._own[key]
            elif key in self.apart:
                own = self.apart[key]
            else:
                own = self._recorded_value(key)
            if same_bits(its, own):
                self.apart.pop(key, None)
            else:
                self.apart[key] = own
                different.append((key, its, own))
        self._before.clear()
        return different

    @property
    def writes_agree(self) -> bool:
        """Whether the scan's BASIC statements made exactly the recorded writes, in the same order."""
        return self._in_step and self._write_count == len(self._writes)

    @property
    def writes_made(self) -> int:
        """The number of writes by the scan's BASIC statements so far."""
        return self._write_count

    @property
    def recorded_writes(self) -> list[Entry]:
        """The writes of the recorded scan's BASIC statements, in their order."""
        return self._writes

    def after_recorded(self, key: Key) -> Value:
        """Return a value as it was after the recorded scan.

        Raises:
            UnknownValue: it has not been recorded.
        """
        changes = self._recorded_changes()
        return changes[key] if key in changes else self._commons.value(key)

    @property
    def is_apart(self) -> bool:
        """Whether writes of others affect the values that the task reads."""
        return bool(self.apart or self._before)

    def overwritten(self, entries: Iterable[Entry]) -> None:
        """Discard the task's own values where another writer has written."""
        for view, element, _ in entries:
            self.apart.pop((view, element), None)
            self._before.pop((view, element), None)

    def written_early(self, key: Key) -> None:
        """Remember the present value before a write in the log by the next recorded scan."""
        if self._edited and key not in self._before and self._commons.is_known(key):
            self._before[key] = self._commons.value(key)

    def _recorded_value(self, key: Key) -> Value:
        """Return the recorded value, without the writes that the recorded scan itself has made already."""
        return self._before[key] if key in self._before else self._commons.value(key)

    def _take(self, view: int, element: int, value: Value) -> None:
        """Keep a write of the scan, and its effect on other views of the same registers; forces keep their values."""
        if (view, element) in self._commons.forced:
            return
        if view in self._commons.registers.views:
            self._own.update(self._spread(view, element, value, self._present))
        else:
            self._own[view, element] = value

    def _recorded_changes(self) -> dict[Key, Value]:
        """Return the changes by the recorded scan: its writes, and those of other views of the same registers."""
        commons, changes = self._commons, dict[Key, Value]()

        def read(view: int, element: int) -> Value:
            key = (view, element)
            return changes[key] if key in changes else commons.value(key)

        for view, element, value in (*self._writes, *self._committed):
            if (view, element) in commons.forced:
                continue
            if view in commons.registers.views:
                changes.update(self._spread(view, element, value, read))
            else:
                changes[view, element] = value
        return changes

    def _spread(self, view: int, element: int, value: Value, read: Callable[[int, int], Value]) -> dict[Key, Value]:
        """Return the changes by a write of registers, with other views of the same ones; forces keep their values."""
        registers, forced = self._commons.registers, self._commons.forced
        value = registers.keeping(view, element, value, forced, read)
        others = {entry[:2]: entry[2] for entry in registers.consequences(view, element, value, read)}
        return {**{key: shown for key, shown in others.items() if key not in forced}, (view, element): value}

    def _present(self, view: int, element: int) -> Value:
        """Return a value as the task left it, else as recorded."""
        key = (view, element)
        if key in self._own:
            return self._own[key]
        return self.apart[key] if key in self.apart else self._recorded_value(key)

    def _commits_agree(self, commits: Sequence[tuple[int, Value]]) -> bool:
        recorded = self._committed
        return len(commits) == len(recorded) and all(
            one[0] == other[0] and one[1] == other[2] for one, other in zip(commits, recorded, strict=True)
        )
