"""Ties one process's part of a rack to the others: its writes go out, theirs come in, and all images agree.

The link observes the rack. What tasks, inputs and operators here write is noted with its version and put out as
batches, one for each scan and writer; what comes from another process is written between two scans as far as it is
newer. A scan that the host has made late writes with the instant of its deadline: where another process wrote the same
after that, the other's value is put back (decision). A late scan does not see what was written elsewhere after its
deadline, or by a scan with the same deadline: that is taken after it (decision).

Presets are not sent, since every process writes them by itself. Neither is what stimuli do at the same rack time in
every process (``is_common``), but for the home: a process that joins in the middle of a wave has it from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.distributed.versions import AS_INSTALLED, TAKEN, Key, Version, VersionedValue, Versions, merged
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.writers import PRESET_WRITER
from automax_ros.runtime.memory.registers import Part
from automax_ros.runtime.memory.views import MemoryValueError, WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent

_FORCES = (WriteKind.FORCE, WriteKind.RELEASE)
_BEFORE_SCANS = EventKey(EventClass.OUTSIDE, 2, "bus")
_AFTER_SCANS = EventKey(EventClass.OBSERVE, 0, "bus")
MOST_AHEAD_NS = 10 * NS_PER_S
"""What comes from further ahead is taken at once (decision): a process that is later than this is lost."""


@dataclass(frozen=True)
class Batch:
    """Writes of one writer at one instant, in order: (view, element, value). ``seat`` is the process's that wrote."""

    seat: int
    sequence: int
    time_ns: int
    writer: int
    kind: WriteKind
    entries: tuple[tuple[int, int, Value], ...]

    @property
    def version(self) -> Version:
        """From when its values count."""
        return self.time_ns, self.seat, self.sequence


@dataclass(frozen=True)
class HeldForce:
    """A force, or one that was released (``held`` FALSE), and from when that counts."""

    view: int
    element: int
    value: Value
    held: bool
    version: Version


@dataclass(frozen=True)
class ImageCopy:
    """All that was written since the rack's start, as one image holds it after its own batch ``sequence``."""

    sequence: int
    values: tuple[VersionedValue, ...]
    forces: tuple[HeldForce, ...]


@dataclass(frozen=True)
class StopState:
    """How the whole rack stands: stopped for ``cause`` or not (None), and from when that counts."""

    at_ns: int = 0
    seat: int = 0
    cause: StopCause | None = None

    @property
    def order(self) -> tuple[int, int]:
        """The greater one is true."""
        return self.at_ns, self.seat


class ImageSync:
    """The link of one process. ``seat`` is the slot that names it; ``standing`` is how the rack stands as it knows it.

    ``send`` gets each batch as soon as it is there; it may not write to the rack. ``is_common`` says whether what
    happens now happens in every process by itself. ``guard`` carries out what waited for its time, and deals with what
    that raises: a damaged message of another process ends nothing.
    """

    def __init__(
        self,
        rack: Rack,
        seat: int,
        send: Callable[[Batch], None],
        is_common: Callable[[], bool] = lambda: False,
        guard: Callable[[Callable[[], None]], None] = lambda take: take(),
    ) -> None:
        """Take the rack; nothing is observed yet."""
        self._rack, self._memory, self.seat = rack, rack.memory, seat
        self._send, self._is_common, self._guard = send, is_common, guard
        self._versions = Versions(rack.memory.registers)
        self._forces: dict[Key, tuple[Version, bool, Value]] = {}
        self.sequence = 0
        self.standing = StopState()
        self.starting = True
        self._adopting = False
        self._waiting: dict[ScheduledEvent, Callable[[], None]] = {}

    def begin(self) -> None:
        """Observe the rack, as the last of its observers, before it is started."""
        self._memory.keep_causes()
        self._rack.observe(self)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Send what a scan has written."""
        if writes:
            self._collect()

    def written(self, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Send what was written from outside the tasks."""
        self._collect()

    def tuned(self, task: Task, now_ns: int) -> None:
        """Tunables and locals are the task's alone."""

    def operated(self, operation: Operation) -> None:
        """Note whether the rack stands otherwise than before."""
        cause = self._rack.operations.stopped
        if not self._adopting and cause != self.standing.cause:
            # Two at one instant, or before the start, have their order too.
            seat = self._rack.config.common_memory_slot if self._is_common() else self.seat
            self.standing = StopState(max(operation.at_ns, self.standing.at_ns + 1), seat, cause)

    # from other processes

    def receive(self, batch: Batch) -> None:
        """Take over another process's writes, as far as they are newer than what is held. Between two scans.

        Where the host has made this process late, they are taken only after what it still has to do before them.
        """
        # What start-up parts write at the start of the rack is there before the first scans.
        by_scan = batch.kind is WriteKind.COMMIT or (batch.kind is WriteKind.BASIC and batch.time_ns > 0)
        key = _AFTER_SCANS if by_scan else _BEFORE_SCANS
        self._in_time(batch.time_ns, key, lambda: self._receive(batch))

    def merge(self, picture: ImageCopy) -> None:
        """Take over what another process holds, as far as it is newer. Between two scans, in time as ``receive``."""
        written_ns = [held.version[0] for held in picture.values] + [force.version[0] for force in picture.forces]
        self._in_time(max(written_ns, default=0), _BEFORE_SCANS, lambda: self._merge(picture))

    def picture(self) -> ImageCopy:
        """Return all that was written, for a process that joins or has missed a batch."""
        self._collect()
        forces = (
            HeldForce(view, element, value, held, version)
            for (view, element), (version, held, value) in self._forces.items()
        )
        return ImageCopy(self.sequence, tuple(self._versions.all()), tuple(forces))

    def take_waiting(self) -> None:
        """Take at once what waits for its time: nothing that was written is lost where the rack or its run ends."""
        waiting, self._waiting = self._waiting, {}
        for event, take in waiting.items():
            event.cancel()
            self._guard(take)

    def last_of(self, seat: int) -> ImageCopy:
        """Return what a process has written within the last second, as this image holds it, for all others.

        Where it has ended in the middle of sending some have its last batch and others do not.
        """
        self.take_waiting()
        whole, since_ns = self.picture(), self._rack.now_ns - NS_PER_S
        values = tuple(held for held in whole.values if held.version[1] == seat and held.version[0] >= since_ns)
        forces = tuple(force for force in whole.forces if force.version[1] == seat and force.version[0] >= since_ns)
        return ImageCopy(whole.sequence, values, forces)

    def adopt(self, standing: StopState) -> None:
        """Follow the rack into how it stands by another process's word, if that is newer. Between two scans.

        A part that stands already is not stopped again, which would clear what was set meanwhile (decision).
        """
        if standing.order <= self.standing.order:
            return
        self.take_waiting()
        operations = self._rack.operations
        self.standing = standing
        self._adopting = True
        try:
            if standing.cause is None:
                operations.stopped = None
            elif operations.powered:
                if operations.stopped is None:
                    operations.stop_all(standing.cause.reason, standing.cause.code, standing.cause.task)
                operations.stopped = standing.cause
        finally:
            self._adopting = False

    def _in_time(self, time_ns: int, key: EventKey, take: Callable[[], None]) -> None:
        """Take what was written at a time: now, or where this process is late, after what it has to do before that."""
        scheduler = self._rack.scheduler
        due = scheduler.next_ns
        is_late = due is not None and (due < time_ns or (due == time_ns and key is _AFTER_SCANS))
        if self.starting or not is_late or time_ns - scheduler.now_ns > MOST_AHEAD_NS:
            take()
            return

        def happen(_: int) -> None:
            self._guard(self._waiting.pop(event))

        event = scheduler.at(time_ns, key, happen)
        self._waiting[event] = take

    def _receive(self, batch: Batch) -> None:
        self._collect()
        self._memory.now_ns = self._rack.now_ns
        for view, element, value in batch.entries:
            self._take(view, element, value, batch)
        self._tell_shaped(batch)
        self._tell()

    def _tell_shaped(self, batch: Batch) -> None:
        """Send back what an input has made something else of, as a counter of 24 bits does: all shall hold that."""
        sent = {(view, element): value for view, element, value in batch.entries}
        for cause in self._memory.take_causes():
            entry = cause.view, cause.element, cause.value
            if sent.get(entry[:2], cause.value) != cause.value:
                self._note(max(cause.time_ns, batch.time_ns + 1), cause.writer, WriteKind(cause.kind), (entry,))

    def _merge(self, picture: ImageCopy) -> None:
        self._collect()
        self._memory.now_ns = self._rack.now_ns
        for held in picture.values:
            self._take_held(held)
        for force in picture.forces:
            self._hold(force)
        self._tell()

    def _take(self, view: int, element: int, sent: Value, batch: Batch) -> None:
        value = self._fitting(view, element, sent)
        if value is None:
            return
        fit = self._versions.settle(view, element, value, batch.version)
        if batch.kind in _FORCES:
            held = batch.kind is WriteKind.FORCE
            self._hold(HeldForce(view, element, value, held, batch.version), batch.writer)
        elif fit.whole:
            self._write(view, element, value, batch.writer, batch.kind)
        else:
            self._write_bits(fit.rest, batch.writer, batch.kind)

    def _take_held(self, held: VersionedValue) -> None:
        if held.view in self._memory.registers.views:
            self._write_bits(self._versions.settle_bits(held), PRESET_WRITER, WriteKind.OUTSIDE)
            return
        value = self._fitting(held.view, held.element, held.value)
        if value is not None and self._versions.settle(held.view, held.element, value, held.version).whole:
            self._write(held.view, held.element, value, PRESET_WRITER, WriteKind.OUTSIDE)

    def _fitting(self, view: int, element: int, value: Value) -> Value | None:
        """Return a value as its variable holds it; None where there is no such: what comes may be damaged."""
        if not 0 <= view < len(self._memory.specs):
            return None
        try:
            return self._memory.accepted(view, value, element)
        except MemoryValueError:
            return None

    def _write(self, view: int, element: int, value: Value, writer: int, kind: WriteKind) -> None:
        if self._memory.read_now(view, element) != value:
            self._rack.inputs.write(view, element, value, writer, kind)

    def _write_bits(self, parts: Sequence[Part], writer: int, kind: WriteKind) -> None:
        for part in parts:
            before = int(self._memory.read_now(part.bank, part.register))
            self._write(part.bank, part.register, merged(before, [part]), writer, kind)

    def _hold(self, force: HeldForce, writer: int = PRESET_WRITER) -> None:
        key = force.view, force.element
        known = self._forces.get(key)
        if known is not None and known[0] > force.version:
            return
        self._forces[key] = force.version, force.held, force.value
        if force.held:
            self._memory.force(force.view, force.value, force.element, writer)
        else:
            self._memory.release(force.view, force.element, writer)

    def _tell(self) -> None:
        """Let observers know what has come, without sending it back."""
        self._memory.take_causes()
        self._rack.observers.tell_writes()

    # to other processes

    def _collect(self) -> None:
        """Note and send what was written here since the last time."""
        causes = self._memory.take_causes()
        for (time_ns, writer, kind), group in groupby(causes, key=lambda write: write[1:4]):
            entries = tuple((write.view, write.element, write.value) for write in group)
            self._note(time_ns, writer, WriteKind(kind), entries)

    def _note(self, time_ns: int, writer: int, kind: WriteKind, entries: Iterable[tuple[int, int, Value]]) -> None:
        preset = self.starting and writer == PRESET_WRITER
        common = preset or self._is_common()
        sends = not preset and (not common or self._rack.part.holds_common_memory)
        if sends:
            self.sequence += 1
        if self._adopting:  # what a STOP ALL clears here is not older than the STOP ALL
            time_ns = max(time_ns, self.standing.at_ns)
        home = self._rack.config.common_memory_slot
        version = AS_INSTALLED if preset else (time_ns, home, 0) if common else (time_ns, self.seat, self.sequence)
        repairs: list[Part | VersionedValue] = []
        sent = []
        for view, element, value in entries:
            if kind in _FORCES:
                self._note_force(HeldForce(view, element, value, kind is WriteKind.FORCE, version))
            fit = self._versions.settle(view, element, value, version)
            sent.append((view, element, value))
            if fit is not TAKEN:
                repairs += self._versions.newest(view, element, value)
        if sends:
            self._send(Batch(self.seat, self.sequence, time_ns, writer, kind, tuple(sent)))
        if repairs:
            self._repair(repairs)

    def _note_force(self, force: HeldForce) -> None:
        """Note a force of this process, or put back what is newer."""
        key = force.view, force.element
        known = self._forces.get(key)
        if known is None or known[0] <= force.version:
            self._forces[key] = force.version, force.held, force.value
        elif known[1]:
            self._memory.force(force.view, known[2], force.element, PRESET_WRITER)
        else:
            self._memory.release(force.view, force.element, PRESET_WRITER)

    def _repair(self, repairs: Iterable[Part | VersionedValue]) -> None:
        """Put back what is newer than what was written here."""
        memory = self._memory
        memory.now_ns = self._rack.now_ns
        for item in repairs:
            if isinstance(item, VersionedValue):
                memory.write_now(item.view, item.value, PRESET_WRITER, item.element, WriteKind.OUTSIDE)
            else:
                word = merged(int(memory.read_now(item.bank, item.register)), [item])
                memory.write_now(item.bank, word, PRESET_WRITER, item.register, WriteKind.OUTSIDE)
        memory.take_causes()
        self._rack.observers.tell_writes()
