"""Synchronizes one process's part of a rack with the others: sends its writes, applies theirs; all images agree.

A write by a task, an input or an operator of this process is recorded with its version and sent, in one batch per scan
and writer. A write of another process is applied between two scans if it is newer than the value held. The writes of a
scan that the host delayed count from its deadline: if another process wrote the same variable after that, the other's
value is restored (decision). A late scan does not see what others wrote after its deadline, or in a scan with the same
deadline: that is applied after it (decision).

Presets are not sent. Nor are writes that stimuli make at the same rack time in every process (``is_common``), except by
the process with common memory: one that joins in the middle of a wave gets the wave's values from it.
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
"""A write from further ahead is applied at once (decision): a process that is later than this is lost."""


@dataclass(frozen=True)
class Batch:
    """Writes of one writer at one instant, in order: (view, element, value).

    ``process_slot`` names the process that wrote.
    """

    process_slot: int
    sequence: int
    time_ns: int
    writer: int
    kind: WriteKind
    entries: tuple[tuple[int, int, Value], ...]

    @property
    def version(self) -> Version:
        """Version of its values."""
        return self.time_ns, self.process_slot, self.sequence


@dataclass(frozen=True)
class HeldForce:
    """A force, or one that was released (``held`` FALSE), with its version."""

    view: int
    element: int
    value: Value
    held: bool
    version: Version


@dataclass(frozen=True)
class ImageCopy:
    """All that was written since the rack's start, from one image after its own batch ``sequence``."""

    sequence: int
    values: tuple[VersionedValue, ...]
    forces: tuple[HeldForce, ...]


@dataclass(frozen=True)
class StopState:
    """Whether the whole rack is stopped, for ``cause``, or runs (None), and since when."""

    at_ns: int = 0
    process_slot: int = 0
    cause: StopCause | None = None

    @property
    def order(self) -> tuple[int, int]:
        """Sorts states: the greatest is valid."""
        return self.at_ns, self.process_slot


class ImageSync:
    """The link of one process. ``process_slot`` names it, ``standing`` is the rack's stop state as known here.

    ``send`` receives each batch immediately; it may not write to the rack. ``is_common`` returns whether every process
    makes the present writes. ``guard`` executes deferred writes and handles exceptions: a message may be damaged.
    """

    def __init__(
        self,
        rack: Rack,
        process_slot: int,
        send: Callable[[Batch], None],
        is_common: Callable[[], bool] = lambda: False,
        guard: Callable[[Callable[[], None]], None] = lambda take: take(),
    ) -> None:
        """Create the link of a rack; it does not observe the rack yet."""
        self._rack, self._memory, self.process_slot = rack, rack.memory, process_slot
        self._send, self._is_common, self._guard = send, is_common, guard
        self._versions = Versions(rack.memory.registers)
        self._forces: dict[Key, tuple[Version, bool, Value]] = {}
        self.sequence = 0
        self.standing = StopState()
        self.starting = True
        self._adopting = False
        self._waiting: dict[ScheduledEvent, Callable[[], None]] = {}

    def begin(self) -> None:
        """Observe the rack, as its last observer; called before the rack is started."""
        self._memory.keep_causes()
        self._rack.observe(self)

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Send the writes of a scan."""
        if writes:
            self._collect()

    def written(self, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Send writes that were not made by a scan."""
        self._collect()

    def tuned(self, task: Task, now_ns: int) -> None:
        """Do nothing: tunables and locals belong to one task."""

    def operated(self, operation: Operation) -> None:
        """Record that the rack was stopped or started."""
        cause = self._rack.operations.stopped
        if not self._adopting and cause != self.standing.cause:
            # Two at one instant, or before the start, have an order too.
            process_slot = self._rack.config.common_memory_slot if self._is_common() else self.process_slot
            self.standing = StopState(max(operation.at_ns, self.standing.at_ns + 1), process_slot, cause)

    def receive(self, batch: Batch) -> None:
        """Apply another process's writes that are newer, between two scans: after those that are due before them."""
        # Writes of start-up parts at the start of the rack are applied before the first scans.
        by_scan = batch.kind is WriteKind.COMMIT or (batch.kind is WriteKind.BASIC and batch.time_ns > 0)
        key = _AFTER_SCANS if by_scan else _BEFORE_SCANS
        self._in_time(batch.time_ns, key, lambda: self._receive(batch))

    def merge(self, picture: ImageCopy) -> None:
        """Apply the values of another process's image that are newer. Between two scans, deferred as in ``receive``."""
        written_ns = [held.version[0] for held in picture.values] + [force.version[0] for force in picture.forces]
        self._in_time(max(written_ns, default=0), _BEFORE_SCANS, lambda: self._merge(picture))

    def picture(self) -> ImageCopy:
        """Return all that was written, for a process that joins or missed a batch."""
        self._collect()
        forces = (
            HeldForce(view, element, value, held, version)
            for (view, element), (version, held, value) in self._forces.items()
        )
        return ImageCopy(self.sequence, tuple(self._versions.all()), tuple(forces))

    def take_waiting(self) -> None:
        """Apply deferred writes immediately: none is lost when the rack or its run ends."""
        waiting, self._waiting = self._waiting, {}
        for event, take in waiting.items():
            event.cancel()
            self._guard(take)

    def last_of(self, process_slot: int) -> ImageCopy:
        """Return what a process wrote within the last second: others may lack the batch that it sent as it ended."""
        self.take_waiting()
        whole, since_ns = self.picture(), self._rack.now_ns - NS_PER_S
        values = tuple(held for held in whole.values if held.version[1] == process_slot and held.version[0] >= since_ns)
        forces = tuple(
            force for force in whole.forces if force.version[1] == process_slot and force.version[0] >= since_ns
        )
        return ImageCopy(whole.sequence, values, forces)

    def adopt(self, standing: StopState) -> None:
        """Adopt another process's stop state if it is newer, between two scans.

        A part that is stopped already is not stopped again, which would clear what was set meanwhile (decision).
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
        """Apply writes made at ``time_ns``: now, or if this process is late, after what is due before that."""
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
        self._send_shaped(batch)
        self._report_writes()

    def _send_shaped(self, batch: Batch) -> None:
        """Send back values that an input changed, as a counter of 24 bits does: all images must hold them."""
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
        self._report_writes()

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

    def _report_writes(self) -> None:
        self._memory.take_causes()
        self._rack.observers.report_writes()

    def _collect(self) -> None:
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
        if self._adopting:  # values that a STOP ALL clears here are not older than the STOP ALL
            time_ns = max(time_ns, self.standing.at_ns)
        memory_slot = self._rack.config.common_memory_slot
        own = (time_ns, memory_slot, 0) if common else (time_ns, self.process_slot, self.sequence)
        version = AS_INSTALLED if preset else own
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
            self._send(Batch(self.process_slot, self.sequence, time_ns, writer, kind, tuple(sent)))
        if repairs:
            self._repair(repairs)

    def _note_force(self, force: HeldForce) -> None:
        key = force.view, force.element
        known = self._forces.get(key)
        if known is None or known[0] <= force.version:
            self._forces[key] = force.version, force.held, force.value
        elif known[1]:
            self._memory.force(force.view, known[2], force.element, PRESET_WRITER)
        else:
            self._memory.release(force.view, force.element, PRESET_WRITER)

    def _repair(self, repairs: Iterable[Part | VersionedValue]) -> None:
        memory = self._memory
        memory.now_ns = self._rack.now_ns
        for item in repairs:
            if isinstance(item, VersionedValue):
                memory.write_now(item.view, item.value, PRESET_WRITER, item.element, WriteKind.OUTSIDE)
            else:
                word = merged(int(memory.read_now(item.bank, item.register)), [item])
                memory.write_now(item.bank, word, PRESET_WRITER, item.register, WriteKind.OUTSIDE)
        memory.take_causes()
        self._rack.observers.report_writes()
