"""The common memory of a running rack: the four memory operations, forcing, and the ordered write log.

``latch`` copies simple views at the start of a scan, ``commit`` writes what its blocks changed, at END; ``read_now``
and ``write_now`` use actual memory, for BASIC statements, arrays, REALs and strings. A force applies to a view: latch
and read_now return its value, writes are dropped. Every write that takes effect is in the write log, if that is kept.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Container, Iterable, Sequence
from typing import Any

from automax_ros.core.kinds import WriteKind
from automax_ros.core.machine_code import mypyc_attr
from automax_ros.core.types import Value
from automax_ros.runtime.memory.image import Image
from automax_ros.runtime.memory.views import CellCommit, MemoryValueError, ViewSpec, Write, WriteGroup, fitting
from automax_ros.runtime.time.scheduler import Scheduler

FORCING = "FORCINGSTATUS@"
"""The pre-defined common that is TRUE while anything is forced (2.4.6)."""


@mypyc_attr(allow_interpreted_subclasses=True)
class CommonMemory(Image):
    """The common variables and module registers of one rack; ``now_ns`` is the time of entries in the write log."""

    def __init__(self, views: Sequence[ViewSpec]) -> None:
        super().__init__(views)
        self._sequence = 0
        self._forced: set[tuple[int, int]] = set()
        self._under: dict[tuple[int, int], Value] = {}
        self._locals_forced = False
        self._force_watchers: list[Callable[[], None]] = []
        self._log: list[WriteGroup] | None = None
        self._causes: list[Write] | None = None
        self._plain = [not spec.is_array and view not in self._shared for view, spec in enumerate(self.specs)]
        """Whether a write to a view changes only its cell."""
        self._watched: dict[tuple[int, int], list[Callable[[], None]]] = {}
        self._gate = array("q", (1, 0))
        self.accesses: dict[int, Callable[[], None]] = {}
        """The functions to call for each access to a view by a scan in modeled time: see ``watch_accesses``."""

    @property
    def sequence(self) -> int:
        """The number of writes that have taken effect: that of the last one in the write log."""
        return self._sequence + self._gate[1]

    def committing(self) -> CellCommit | None:
        """Return where native scans store changed values while nothing is forced or logged; None if they may not."""
        overridden = type(self).commit is not CommonMemory.commit
        return None if overridden else CellCommit(self._cells, self._plain, self._gate)

    def _set_gate(self) -> None:
        gate = self._gate
        self._sequence += gate[1]
        gate[0], gate[1] = not self._forced and self._log is None and self._causes is None, 0

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write what a scan's blocks changed: (view, value), within its type. The log refers to ``changes`` itself."""
        if self._forced or self._causes is not None:
            self._commit_each(changes, writer)
            return
        plain, cells = self._plain, self._cells
        for view, value in changes:
            if not plain[view]:
                self._commit_each(changes, writer)  # earlier ones again: nothing else depends on a plain cell
                return
            cells[view] = value
        first = self._sequence + 1
        self._sequence += len(changes)
        if self._log is not None and changes:
            self._log.append(WriteGroup(first, self.now_ns, writer, WriteKind.COMMIT, 0, changes))

    def _commit_each(self, changes: Sequence[tuple[int, Value]], writer: int) -> None:
        for view, value in changes:
            self._store(view, 0, value, writer, WriteKind.COMMIT)

    def write_now(
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None:
        """Write actual memory; ``value`` is already within the view's type, ``element`` in range."""
        self._store(view, element, value, writer, kind)

    def write_from_outside(self, view: int, value: Value, writer: int, element: int = 0) -> None:
        """Write a value that comes from ROS, a preset or an operator; raises what ``accepted`` does."""
        self._store(view, element, self.accepted(view, value, element), writer, WriteKind.OUTSIDE)

    def accepted(self, view: int, value: Value, element: int = 0) -> Value:
        """Return a value from outside as an element would store it; MemoryValueError if that cannot be."""
        spec = self.specs[view]
        if not 0 <= element < spec.elements:
            raise MemoryValueError(f"{spec.name} has no element {element}: it has {spec.elements}")
        return fitting(spec, value)

    def force(self, view: int, value: Value, element: int = 0, writer: int = 0) -> None:
        """Hold a value against every write until it is released; raises what ``accepted`` does."""
        fit = self.accepted(view, value, element)
        self._under.setdefault((view, element), self.read_now(view, element))
        self._forced.discard((view, element))
        self._store(view, element, fit, writer, WriteKind.FORCE)
        self._forced.add((view, element))
        self._set_gate()
        self._forces_changed(writer)

    def release(self, view: int, element: int = 0, writer: int = 0) -> None:
        """End a force; the value stays until the next write (semantics, Scan, memory, tasks)."""
        if (view, element) in self._forced:
            self._forced.remove((view, element))
            self._set_gate()
            self._under.pop((view, element), None)
            self._store(view, element, self.read_now(view, element), writer, WriteKind.RELEASE)
            self._forces_changed(writer)

    def hold(self, forced: Iterable[tuple[int, int]], under: Iterable[tuple[int, int, Value]] = ()) -> None:
        """Restore which values are forced, and ``under_forces``; nothing is logged."""
        self._forced = set(forced)
        self._set_gate()
        known = {(view, element): value for view, element, value in under}
        self._under = {key: known.get(key, self.read_now(*key)) for key in self._forced}
        for changed in self._force_watchers:
            changed()

    @property
    def forced(self) -> frozenset[tuple[int, int]]:
        """The forced values: pairs of view and element."""
        return frozenset(self._forced)

    def note_locals(self, writer: int = 0, *, forced: bool, report: bool = True) -> None:
        """Note whether variables of tasks are forced; ``report`` is False if FORCINGSTATUS@ shows it already."""
        self._locals_forced = forced
        if report:
            self._forces_changed(writer)

    def is_forced(self, view: int) -> bool:
        """Return whether a force holds a simple view."""
        return (view, 0) in self._forced

    def under_force(self, view: int) -> Value:
        """Return the value of a simple view without its force: the last write, though dropped.

        What a block would write is dropped in its scan already, so it does not count (decision).
        """
        return self._under.get((view, 0), self._cells[view])

    @property
    def under_forces(self) -> list[tuple[int, int, Value]]:
        """The values of forced views without their forces: view, element, value."""
        return [(*key, value) for key, value in sorted(self._under.items())]

    def watch_forces(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` whenever a force begins or ends."""
        self._force_watchers.append(changed)

    def watch(self, bank: int, register: int, written: Callable[[], None]) -> None:
        """Call ``written`` whenever a register is written, directly or through a point: it may only post an event."""
        self._watched.setdefault((bank, register), []).append(written)

    def watch_accesses(self, bank: int, accessed: Callable[[], None]) -> None:
        """Call ``accessed`` for each read and write of a module's registers by a scan that takes modeled time."""
        self.accesses[bank] = accessed
        for view, spec in enumerate(self.specs):
            if spec.place is not None and spec.place.bank == bank:
                self.accesses[view] = accessed

    def keep_log(self) -> None:
        """Begin to keep the write log; the caller must ``take_writes`` or ``drain`` it."""
        if self._log is None:
            self._log = []
            self._set_gate()

    def take_writes(self) -> list[WriteGroup]:
        """Return the groups logged since the last call, oldest first."""
        groups = self._log
        if not groups:
            return []
        self._log = []
        return groups

    def drain(self) -> list[Write]:
        """Return the same as single entries."""
        return [entry for group in self.take_writes() for entry in group.entries()]

    def keep_causes(self) -> None:
        """Begin to keep the writes of named views for ``take_causes``, without consequences on the same registers."""
        if self._causes is None:
            self._causes = []
            self._set_gate()

    def take_causes(self) -> list[Write]:
        """Return these writes since the last call, oldest first."""
        causes, self._causes = self._causes or [], None if self._causes is None else []
        return causes

    def clear(self, writer: int = 0, *, keep_non_volatile: bool = True, kept: Container[tuple[int, int]] = ()) -> None:
        """Set volatile variables to 0, except forced ones and those ``kept``: STOP ALL and system restart (2.4.5)."""
        for view, spec in enumerate(self.specs):
            if spec.name == FORCING or (spec.non_volatile and keep_non_volatile):
                continue
            for element in range(spec.elements):
                if self.read_now(view, element) != spec.type.zero and (view, element) not in kept:
                    self._store(view, element, spec.type.zero, writer, WriteKind.OUTSIDE)

    def _forces_changed(self, writer: int) -> None:
        """Keep the pre-defined FORCINGSTATUS@ TRUE while anything is forced (2.4.6), and call the watchers."""
        view, forced = self._index.get(FORCING), bool(self._forced) or self._locals_forced
        if view is not None and self._cells[view] is not forced:
            self._store(view, 0, forced, writer, WriteKind.OUTSIDE)
        for changed in self._force_watchers:
            changed()

    def _store(self, view: int, element: int, value: Value, writer: int, kind: WriteKind) -> None:
        if self._forced:
            if (view, element) in self._forced:
                self._under[view, element] = value
                return
            if view in self._shared:
                value = self.registers.keeping(view, element, value, self._forced, self.read_now)
        entries = self._spread(view, element, value) if view in self._shared else None
        # Written out instead of ``_put``: every write of every scan passes here.
        array = self._arrays[view]
        if array is None:
            self._cells[view] = value
        else:
            array[element] = value
        self._sequence += 1
        if self._log is not None:
            self._log.append(WriteGroup(self._sequence, self.now_ns, writer, kind, element, ((view, value),)))
        if self._causes is not None:
            self._causes.append(Write(self._sequence, self.now_ns, writer, kind, view, element, value))
        if entries:
            # A view that shares registers with a forced one is not forced itself.
            caused = WriteKind.OUTSIDE if kind in (WriteKind.FORCE, WriteKind.RELEASE) else kind
            for other, place, shown in entries:
                self._put(other, place, shown)
                self._sequence += 1
                if self._log is not None:
                    self._log.append(WriteGroup(self._sequence, self.now_ns, writer, caused, place, ((other, shown),)))
        if entries is not None and self._watched:
            for key in [(view, element), *(entry[:2] for entry in entries)]:
                for watcher in self._watched.get(key, ()):
                    watcher()

    def _spread(self, view: int, element: int, value: Value) -> list[tuple[int, int, Value]]:
        changes = self.registers.consequences(view, element, value, self.read_now)
        return [change for change in changes if change[:2] not in self._forced]


Key = tuple[int, int]
"""View and element."""
Shape = Callable[[Value], Value]
"""Converts a value from outside to that of a register."""


class Freezer:
    """Inputs that freeze together: ``keys`` are all their views, ``owed`` the tasks that have not scanned yet.

    The 57C409, 57C411, 57C419 and 57C421 freeze their inputs at an interrupt until the task that waits for it has
    scanned (4.0). Writes of the process in between are kept, the last one of each variable, and take effect after it.
    """

    def __init__(self, keys: Iterable[Key]) -> None:
        """Create it with inputs that are not frozen."""
        self.keys = frozenset(keys)
        self.owed: set[str] = set()
        self.kept: dict[Key, tuple[Value, int]] = {}

    def state(self) -> dict[str, Any]:
        """Return the tasks that owe a scan, and the writes that wait, in order."""
        kept = [[*key, value, writer] for key, (value, writer) in self.kept.items()]
        return {"owed": sorted(self.owed), "kept": kept}


class ProcessInputs:
    """Writes to ``memory`` from outside tasks. While ``frozen`` has inputs, ``scanned`` is called after every scan."""

    def __init__(self, memory: CommonMemory, scheduler: Scheduler) -> None:
        """Create it with inputs that are not frozen."""
        self.memory, self._scheduler = memory, scheduler
        self.frozen: dict[Key, Freezer] = {}
        self._shapes: dict[Key, Shape] = {}

    def shape(self, keys: Iterable[Key], shape: Shape) -> None:
        """Convert values from outside by a function before they reach a variable."""
        self._shapes.update(dict.fromkeys(keys, shape))

    def write(self, view: int, element: int, value: Value, writer: int, kind: WriteKind = WriteKind.OUTSIDE) -> None:
        """Write a value that fits its variable, now or when it is no longer frozen."""
        key = view, element
        if key in self._shapes:
            value = self._shapes[key](value)
        freezer = self.frozen.get(key)
        if freezer is None:
            self.memory.write_now(view, value, writer, element, kind)
        else:
            # Last in order, so that a word written after one of its bits overrides it.
            freezer.kept.pop(key, None)
            freezer.kept[key] = value, writer

    def write_from_outside(self, view: int, value: Value, writer: int, element: int = 0) -> None:
        """Write a value as ROS, a preset or an operator gives it; raises what ``CommonMemory.accepted`` does."""
        self.write(view, element, self.memory.accepted(view, value, element), writer)

    def freeze(self, freezer: Freezer, tasks: Iterable[str]) -> None:
        """Apply the writes that wait, and freeze the inputs until all of ``tasks`` have scanned."""
        self.free(freezer)
        freezer.owed = set(tasks)
        if freezer.owed:
            self.frozen.update(dict.fromkeys(freezer.keys, freezer))

    def scanned(self, task: str) -> bool:
        """Note a scan; return whether inputs are no longer frozen and have changed."""
        changed = False
        for freezer in dict.fromkeys(self.frozen.values()):
            freezer.owed.discard(task)
            if not freezer.owed:
                changed = self.free(freezer) or changed
        return changed

    def free(self, freezer: Freezer) -> bool:
        """End the freezing of inputs, whichever tasks owe a scan; return whether writes were waiting."""
        freezer.owed = set()
        for key in freezer.keys:
            self.frozen.pop(key, None)
        kept, freezer.kept = freezer.kept, {}
        self.memory.now_ns = self._scheduler.now_ns
        for (view, element), (value, writer) in kept.items():
            self.memory.write_now(view, value, writer, element, WriteKind.OUTSIDE)
        return bool(kept)

    def load(self, freezer: Freezer, owed: Iterable[str], kept: Iterable[Sequence[object]]) -> None:
        """Restore a freezer's state; ValueError if a write that waits is not one to its inputs."""
        self.freeze(freezer, owed)
        for view, element, value, writer in kept:
            if (view, element) not in freezer.keys or not isinstance(value, int) or not isinstance(writer, int):
                raise ValueError(f"{view!r}, {element!r} is not an input that waits")
            freezer.kept[view, element] = value, writer  # type: ignore[index]
