"""Finds in a recording what came from outside the rack: the operator, ROS, stimuli, other racks of a network.

The rest, what tasks, plants, modules and the rack itself have written, is left to the rack that runs again. A write to
a point of a module is in the log with what it changed on the same registers; only the write itself is from outside. A
network module that has received frames is not run again: all that it wrote counts as from outside (decision: the other
racks are not in the recording).
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from automax_ros.core.kinds import WriteKind, WriterKind
from automax_ros.core.names import PREDEFINED, element_name
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import Value
from automax_ros.drive.base.state import SavedState
from automax_ros.messages.types.messages import (
    NAMES,
    CommonImage,
    CommonWrite,
    Operation,
    Scan,
    TaskState,
    VariableTable,
)
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, ROS_WRITER
from automax_ros.rackfile.modules.network import AREA, BROADCAST, MASTER, RECEIVED, NetworkConfig
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import HOLD_NS, BagMessage, BagReader
from automax_ros.recordings.read.run_facts import RunFacts, run_facts
from automax_ros.recordings.write.recorder import STOCK
from automax_ros.replay.rerun.causes import Causes
from automax_ros.replay.rerun.events import Act, Entry, Event, Operated, Order, Tuned, Written
from automax_ros.replay.rerun.task_states import RecordedStates
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.stored_rack import StoredRack, stored_rack

MOST_EVENTS = 2_000_000
"""Most events, and values that they wrote, of one recording (decision: a bound on memory, 1 GB)."""
_TYPES = frozenset(NAMES[kind] for kind in (CommonImage, CommonWrite, Operation, Scan, TaskState, VariableTable))
_FROM_OUTSIDE = frozenset({WriterKind.ROS, WriterKind.OPERATOR})
_BY_ITSELF = frozenset({WriterKind.IO, WriterKind.PLANT})
_REPLACES = ("reload", "delete", "power_on")
"""Operations after which a task's tunables are others without having been set."""


@dataclass(frozen=True)
class Outside:
    """What came from outside in a recorded run, and what else its run again needs; times in ns of the run.

    Attributes:
        events: in their order; those from ``Order.START`` on.
        settings: values written before the modules had power, by name.
        states: the states of tasks that were not as installed at the start, by task.
        forced: what was forced then: view, element, value.
        starting: the tasks that were put into RUN at the start, None for all.
        begins_ns: time of the first message. ``ends_ns``: of the last one that was read.
        tasks: the tasks whose scans are recorded. ``every_state``: each with its state.
        files: when each file but the first begins, and whether something of that instant came before.
        skipped: scans left out by a late host, and ``skipped_ns`` when the first was.
        played: slots of network modules that received frames.
        stock: what the rack found on its rolls and webs, kept from an earlier run.
    """

    events: tuple[Event, ...]
    settings: tuple[tuple[str, Value], ...] = ()
    states: Mapping[str, TaskState] = field(default_factory=dict)
    forced: tuple[Entry, ...] = ()
    starting: frozenset[str] | None = None
    begins_ns: int = 0
    ends_ns: int = 0
    tasks: frozenset[str] = frozenset()
    every_state: bool = False
    files: tuple[tuple[int, bool], ...] = ()
    skipped: int = 0
    skipped_ns: int = 0
    played: frozenset[int] = frozenset()
    stock: Mapping[str, SavedState] = field(default_factory=dict)

    def counts(self) -> Counter[str]:
        """Return how many there are of each: ``operator``, ``ros``, ``network`` (writes), ``operations``, ``tuned``."""
        return Counter(_word(event.act) for event in self.events) + Counter(operator=bool(self.settings))


def _word(act: Act) -> str:
    if isinstance(act, Written):
        return {ROS_WRITER: "ros", OPERATOR_WRITER: "operator"}.get(act.writer, "network")
    return "operations" if isinstance(act, Operated) else "tuned"


def recorded_outside(
    bag: Path, progress: Callable[[float], None] | None = None, to_ns: int | None = None
) -> tuple[RackConfig, Outside]:
    """Return the rack of a recording, and what came from outside in its run, up to a time of it (ns).

    Raises:
        BagError: as ``read_outside``.
        SourceRefused: the rack file has errors.
    """
    reader = BagReader(bag)
    rack, facts = stored_rack(reader), run_facts(reader)
    rack.check_table(facts.table)
    reader = reader.again()
    reader.on_progress = progress
    return rack.config, read_outside(reader, rack, facts, to_ns)


def read_outside(reader: BagReader, rack: StoredRack, facts: RunFacts, to_ns: int | None = None) -> Outside:
    """Read a recording to its end, or to a time of its run (ns).

    Raises:
        BagError: it cannot be read, does not fit its rack file, lacks the source of a reload (AMX6835), or more came
            from outside than ``MOST_EVENTS``.
    """
    return _Reading(reader, rack, facts, to_ns).read()


class _Reading:
    """One pass over a recording."""

    def __init__(self, reader: BagReader, rack: StoredRack, facts: RunFacts, to_ns: int | None) -> None:
        self._reader, self._rack, self._bag = reader, rack, reader.path
        self._to_ns, self._is_cut = to_ns, False
        self._origin = facts.table.stamp
        self._is_modeled = rack.config.execution is Timing.MODELED
        self._commons = RecordedCommons(self._bag, facts, rack.config)
        self._variables = rack.config.variables
        self._kinds = {writer.id: writer.kind for writer in facts.table.writers}
        self._names = {writer.id: writer.name for writer in facts.table.writers}
        self._networks = _networks(rack, facts)
        self._received: set[int] = set()
        self._network_events: list[tuple[int, int]] = []
        self._task_states = RecordedStates(self._bag, rack)
        self._causes = Causes(self._commons, rack.config)
        self._waiting = {program.name for program in rack.programs() if program.events}
        self._freezable = _freezable(rack, self._commons)
        self._frozen: set[tuple[int, int]] = set()
        self._events: list[Event] = []
        self._room = MOST_EVENTS
        self._reloads: dict[str, int] = {}
        self._settings: tuple[tuple[str, Value], ...] = ()
        self._states: dict[str, TaskState] = {}
        self._forced: list[Entry] = []
        self._wrote = self._beyond_presets = self._scanned = False
        self._preset_at: int | None = None
        self._instant, self._io = -1, False
        self._scan: tuple[str, int] = ("", 0)
        self._scan_ns = self._scan_end_ns = -1
        self._directly = False
        self._began: set[str] = set()
        self._stated, self._owing = set[str](), dict[str, int]()
        self._states_follow = True
        self._file = 0
        self._files: list[tuple[int, bool]] = []
        self._skipped = self._skipped_ns = 0
        self._first: int | None = None
        self._last = 0

    def read(self) -> Outside:
        """Read all messages."""
        for entry in self._reader.messages(types=_TYPES):
            self._take(entry)
            self._is_cut = self._has_enough()
            if self._is_cut:
                break
        if self._reader.last_stamp is not None:
            self._last = max(self._last, self._reader.last_stamp - self._origin)
        for name, place in self._reloads.items():
            raise self._task_states.lacks_source(name, self._events[place].at_ns)
        played = frozenset(module.slot for number, module in self._networks.items() if number in self._received)
        dropped = {place for place, number in self._network_events if number not in self._received}
        return Outside(
            tuple(event for place, event in enumerate(self._events) if place not in dropped and self._counts(event)),
            self._settings,
            self._states,
            tuple(self._forced),
            self._starting(),
            self._first or 0,
            self._last,
            frozenset(self._stated | self._began),
            self._has_every_state(),
            tuple(self._files),
            self._skipped,
            self._skipped_ns,
            played,
            self._stock(),
        )

    def _counts(self, event: Event) -> bool:
        return self._to_ns is None or event.at_ns <= self._to_ns

    def _has_enough(self) -> bool:
        """Return whether no instant up to the end is to come, and it is known what AUTO RUN started."""
        if self._to_ns is None or self._last <= self._to_ns + HOLD_NS or self._reloads:
            return False
        known = self._began | self._stated
        return not self._rack.config.auto_run or not self._began or known.issuperset(self._rack.task_names)

    def _has_every_state(self) -> bool:
        """Return whether each scan has a state; where reading ended early that of the last one may still be to come."""
        missing = any(not self._is_cut or end_ns < self._last for end_ns in self._owing.values())
        return self._scanned and self._states_follow and not missing

    def _stock(self) -> Mapping[str, SavedState]:
        """Return what the rack found on its rolls and webs; whether it is possible is seen when it is put back."""
        try:
            stock = json.loads(self._reader.custom_data.get(STOCK, "{}"))
            return {name: dict(kept) for name, kept in stock.items()}
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            why = "is damaged: what was kept of its rolls and webs is not JSON"
            raise BagError("AMX6835", self._bag, why) from error

    def _take(self, entry: BagMessage) -> None:
        message = entry.message
        assert isinstance(message, CommonImage | CommonWrite | Operation | Scan | TaskState | VariableTable)
        now = max(0, self._time_of(entry) - self._origin)
        if self._first is None:
            self._first = max(0, entry.stamp - self._origin)
        place = self._reader.place
        if place is not None and place.file != self._file:
            self._file = place.file
            self._files.append((now, now == self._instant))
        self._last = max(self._last, now)
        if now != self._instant:
            self._instant, self._io = now, False
        if isinstance(message, CommonWrite):
            self._take_write(message, now, entry.log_time)
        elif isinstance(message, Operation):
            self._take_operation(message, now)
        elif isinstance(message, Scan):
            self._take_scan(message, now)
        elif isinstance(message, TaskState):
            self._take_state(message, now)
        elif isinstance(message, CommonImage):
            self._commons.take(message)
        else:
            self._commons.check_table(message)

    def _time_of(self, entry: BagMessage) -> int:
        message = entry.message
        if self._reader.is_ours:
            return entry.stamp
        if isinstance(message, Scan):
            return message.stamp + message.duration_ns
        return int(getattr(message, "stamp", entry.stamp))

    def _take_write(self, message: CommonWrite, now: int, log_time: int) -> None:
        kind, writer = self._kinds.get(message.writer), message.writer
        network = self._networks.get(writer)
        entries = self._commons.entries(message.values, message.stamp)
        is_outside = kind in _FROM_OUTSIDE or network is not None
        causes, shown = self._causes.of(entries, now, writer) if is_outside else ((), ())
        if self._commons.take(message) is None:
            return
        self._directly = self._directly and (is_outside or self._names.get(writer) == self._scan[0])
        if kind == WriterKind.PRESET:
            if message.kind == WriteKind.FORCE and not self._wrote:
                self._forced += entries
                return
            self._wrote, self._preset_at = True, log_time
            return
        self._wrote = True
        together = self._preset_at is None or log_time == self._preset_at + 1
        if network is not None:
            self._take_network(writer, causes, shown, now)
        elif kind in _BY_ITSELF:
            self._io = True
        elif is_outside and message.kind == WriteKind.OUTSIDE:
            meant = tuple(item for item in causes if self._is_meant(writer, item))
            if meant:
                self._take_meant(Written(writer, meant, shown), now, together=together)
        self._beyond_presets = True

    def _take_meant(self, written: Written, now: int, *, together: bool) -> None:
        """Add a write; one that stands with the presets was made before the modules had power."""
        begins = not (now or self._beyond_presets or self._scanned or self._settings)
        if begins and together and self._kinds.get(written.writer) == WriterKind.OPERATOR:
            self._settings = tuple((self._label(item), item[2]) for item in written.entries)
        else:
            self._add(now, written)

    def _take_network(self, writer: int, causes: tuple[Entry, ...], shown: tuple[Entry, ...], now: int) -> None:
        module = self._networks[writer]
        own = (entry for entry in causes if self._variables[entry[0]].bank == module.slot)
        if any(_arrives(module, register, value) for _, register, value in own):
            self._received.add(writer)
        if causes:
            self._network_events.append((len(self._events), writer))
            self._add(now, Written(writer, causes, shown))

    def _is_meant(self, writer: int, entry: Entry) -> bool:
        """Return whether a write is one of its own: neither the rack's answer to a force, nor one that waited."""
        if self._variables[entry[0]].name in PREDEFINED:
            return False
        if self._kinds.get(writer) == WriterKind.OPERATOR and entry[:2] in self._frozen:
            self._frozen.discard(entry[:2])
            return False
        return True

    def _take_operation(self, message: Operation, now: int) -> None:
        what, task = message.what, message.task
        self._directly = False
        self._beyond_presets = self._wrote = True
        if message.ok and what in _REPLACES:
            self._task_states.replaced([task] if task else self._rack.task_names)
        if message.ok and ((what == "stop_all" and (message.detail or task)) or (what == "unforce" and task)):
            return  # a fault, or a local that a reload has released
        act = Operated(what, task, message.ok, message.reason, message.detail)
        if message.ok and what == "set":
            act = replace(act, written=self._written_by(message, now))
        elif what == "tune" and self._events and isinstance(self._events[-1].act, Tuned):
            tuned = self._events[-1]
            if tuned.at_ns == now and message.detail.startswith(f"{task}."):
                self._events.pop()
        if message.ok and what == "reload":
            self._reloads[task] = len(self._events)
        self._add(now, act)

    def _written_by(self, message: Operation, now: int) -> Written | None:
        """Take what a ``set`` has written out of the events; one to inputs that are frozen is written later."""
        label = message.detail.partition(" = ")[0]
        last = self._events[-1] if self._events else None
        written = last.act if last is not None and last.at_ns == now and isinstance(last.act, Written) else None
        if written is not None and [self._label(entry) for entry in written.entries] == [label]:
            self._events.pop()
            return written
        meant = self._rack.config.common(label)
        view = next(view for view, item in enumerate(self._variables) if item.name == meant.name)
        if (view, meant.index) in self._freezable:
            self._frozen.add((view, meant.index))
        return None

    def _take_scan(self, scan: Scan, now: int) -> None:
        self._scanned = self._wrote = True
        self._states_follow = self._states_follow and scan.task not in self._owing
        end_ns = max(now, scan.stamp - self._origin + scan.duration_ns)
        self._owing[scan.task] = end_ns
        if not scan.scan:
            if not now:
                self._began.add(scan.task)
            return
        # A modeled scan stands where it first wrote, and ends by the time that its duration says.
        self._scan, self._scan_ns, self._scan_end_ns = (scan.task, scan.scan), now, end_ns
        self._directly = True
        if scan.skipped:
            self._skipped_ns = self._skipped_ns if self._skipped else now
            self._skipped += scan.skipped

    def _take_state(self, state: TaskState, now: int) -> None:
        name = state.task
        if not self._wrote and not self._scanned:
            self._states[name] = state
        self._stated.add(name)
        if now <= self._owing.get(name, -1):
            del self._owing[name]
        place = self._reloads.pop(name, None)
        if place is not None:
            event = self._events[place]
            assert isinstance(event.act, Operated)
            source = self._task_states.source(state, event.at_ns)
            self._events[place] = replace(event, act=replace(event.act, source=source))
        for tuned in self._task_states.tuned(state):
            self._add(now, tuned)

    def _add(self, now: int, act: Act) -> None:
        self._room -= 1 + (len(act.entries) + len(act.shown) if isinstance(act, Written) else 0)
        if self._room < 0:
            when = seconds_text(now)
            what = f"has more than {MOST_EVENTS} events from outside, and values that they wrote, by {when} s"
            raise BagError("AMX6814", self._bag, what, "end more than 1 s before that, with --to")
        if not now and not self._scanned:
            self._events.append(Event(now, act, Order.START))
        elif self._is_modeled and isinstance(act, Written) and self._frees(act, now):
            self._events.append(Event(now, act, Order.AFTER_SCAN, self._scan))
        elif self._scan_ns == now:
            order = Order.AFTER_SCAN if isinstance(act, Written) else Order.LAST
            self._events.append(Event(now, act, order, self._scan if isinstance(act, Written) else None))
        else:
            self._events.append(Event(now, act, Order.AFTER_IO if self._io else Order.FIRST))

    def _frees(self, act: Written, now: int) -> bool:
        """Return whether inputs that were frozen may have taken these values at the end of the last scan."""
        inputs = all(entry[:2] in self._freezable for entry in act.entries)
        waits = self._directly and self._scan[0] in self._waiting
        return inputs and waits and self._scan_ns <= now <= self._scan_end_ns

    def _starting(self) -> frozenset[str] | None:
        """Return the tasks that AUTO RUN has started, if it did not start all."""
        if not self._rack.config.auto_run or not self._began:
            return None
        rested = {task for task in self._stated if task not in self._began}
        operated = {event.act.task for event in self._events if not event.at_ns and isinstance(event.act, Operated)}
        return None if not rested - operated else frozenset(self._rack.task_names) - (rested - operated)

    def _label(self, entry: Entry) -> str:
        return element_name(self._variables[entry[0]], entry[1])


def _networks(rack: StoredRack, facts: RunFacts) -> dict[int, NetworkConfig]:
    """Return the network modules by the ids under which they write."""
    known = {module.name: module for module in rack.config.modules if isinstance(module, NetworkConfig)}
    writers = facts.table.writers
    return {item.id: known[item.name] for item in writers if item.kind == WriterKind.IO and item.name in known}


def _arrives(module: NetworkConfig, register: int, value: Value) -> bool:
    """Return whether a register that a network module has written shows that it has received a frame."""
    if register < AREA:
        return bool(value) and (register == RECEIVED or (module.drop != MASTER and register in BROADCAST))
    return module.registers.direction(register) == "input"


def _freezable(rack: StoredRack, commons: RecordedCommons) -> frozenset[tuple[int, int]]:
    """Return the inputs that freeze at an interrupt of their module: view and element."""
    views = {item.bank: view for view, item in enumerate(rack.config.variables) if item.bank is not None}
    found = (
        commons.registers.showing(views[module.slot], interrupt.inputs)
        for module in rack.config.modules
        if module.slot in views
        for interrupt in module.registers.interrupts
    )
    return frozenset().union(*found)
