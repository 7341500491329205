"""The values of watched variables over time, as instants with the values that changed; for tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.core.kinds import WriteKind, WriterKind
from automax_ros.core.names import NameFault, element_name
from automax_ros.core.ticks import seconds_text
from automax_ros.messages.cdr.message_parts import decode_errors, decode_writes_of
from automax_ros.messages.types.messages import (
    CommonImage,
    CommonWrite,
    PlantState,
    RollState,
    Scan,
    TaskState,
    Variable,
    VariableTable,
    WebState,
)
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import (
    Cell,
    CommonLog,
    Entry,
    Watched,
    WatchedValues,
    watched_by_default,
    watched_by_name,
)
from automax_ros.recordings.read.reader import BagMessage, BagReader, Decode
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.read.span import span_of
from automax_ros.recordings.tables.states import WatchedStates, states_for

MAX_GRID_ROWS = 20_000_000
"""Most rows of an export on a grid of time (decision): a day at 5.5 ms has 15.7 million."""
_TYPES = frozenset(f"automax_msgs/msg/{name}" for name in ("CommonImage", "CommonWrite", "VariableTable"))
_SCAN, _WRITE = "automax_msgs/msg/Scan", "automax_msgs/msg/CommonWrite"

Change = tuple[int, dict[int, Cell]]
"""Nanoseconds from the start of the run, and the new values by index of column."""
Progress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""
TakeWrites = Callable[[int, WriterKind, Sequence[tuple[str, Cell]]], None]
"""Called with the time from the start of the run in ns, the writer, and names with values."""
TakeMessage = Callable[[int, Any], None]
"""Called with the time from the start of the run in ns, and a message of the type that was asked for."""
_OUTSIDE = (WriterKind.ROS, WriterKind.OPERATOR)


@dataclass(frozen=True)
class Window:
    """A part of a run and its grid; nanoseconds from the start of the run.

    ``end_ns`` None is the end of the recording. With ``step_ns`` above 0, values are given at ``start_ns`` and after
    each step.
    """

    start_ns: int = 0
    end_ns: int | None = None
    step_ns: int = 0

    def holds(self, time_ns: int) -> bool:
        """Whether an instant is in the window."""
        return time_ns >= self.start_ns and (self.end_ns is None or time_ns <= self.end_ns)


WHOLE_RUN = Window()


class Series:
    """The watched variables of a recording, to be read once.

    Without ``watch`` all simple numeric and boolean variables are watched; array elements are named like ``TABLE%(3)``,
    locals of tasks like ``SPEED.RATIO%``, signals of plants like ``UNWIND/current_a``, of webs like ``W1/tension_n``.
    ``columns`` are the watched variables, ``rack`` and ``origin_ns`` the rack's name and the stamp at the start of its
    run; ``end_ns`` is the end of the part that was read, after reading. ``take_scan``, if given, is called with each
    scan of the window, ``take_writes`` with the writes of operators, stimuli and ROS: writer, and names with values,
    ``also`` with each message of the window of further types, by the type's name; what they have is not watched by it.
    With ``brief``, scans without errors have no values, and what is not watched is not decoded.

    Raises:
        BagError: the recording cannot be read or has no common memory, or a name in ``watch`` is unknown.
    """

    def __init__(
        self,
        bag: Path,
        watch: Sequence[str] | None = None,
        window: Window = WHOLE_RUN,
        progress: Progress | None = None,
        take_scan: Callable[[int, Scan], None] | None = None,
        take_writes: TakeWrites | None = None,
        also: Mapping[str, TakeMessage] | None = None,
        *,
        brief: bool = False,
    ) -> None:
        self._bag = bag
        self._window = window
        self._reader = BagReader(bag)
        self._reader.on_progress = progress
        self._take_scan, self._take_writes = take_scan, take_writes
        self._also = dict(also or {})
        own = (_TYPES | {_SCAN} if take_scan else _TYPES) | states_for(watch or ())
        self._alone = frozenset(self._also) - own
        self._log = CommonLog(bag, run_facts(self._reader))
        table, variables = self._log.facts.table, self._log.variables
        self._states = WatchedStates(bag)
        self.columns: tuple[Watched, ...] = tuple(self._find_watched(variables, watch))
        self.rack = table.rack
        self.origin_ns = table.stamp
        self.end_ns = 0
        self._values = WatchedValues(self.columns)
        self._outside = {item.id: WriterKind(item.kind) for item in table.writers if item.kind in _OUTSIDE}
        self._named = {item.id: item for item in variables.values()}
        decoders: dict[str, Decode] = {}
        if brief:
            numbers = {column.variable for column in self.columns}
            decoders = {_SCAN: decode_errors, _WRITE: decode_writes_of(numbers, self._named, self._outside)}
        self._messages = self._reader.messages(types=own | self._also.keys(), decoders=decoders)
        self._require_few_rows(progress)

    def changes(self) -> Iterator[Change]:
        """Yield the instants of the window at which something changed, or those of its grid.

        The first one includes the values that hold since before the window. A value is unknown until the recording
        contains it.

        Raises:
            BagError: the recording is damaged, or the window is empty or has too many rows.
        """
        found = False
        changes = self._in_window(self._all_changes())
        for change in self._on_grid(changes) if self._window.step_ns else changes:
            found = True
            yield change
        self._states.require_all()
        if not found and self.columns:
            last = f"the recording ends at {seconds_text(self.end_ns)} s"
            start = seconds_text(self._window.start_ns)
            raise BagError("AMX6825", self._bag, f"holds no value from {start} s on, in the range asked for", last)

    def _find_watched(self, variables: dict[str, Variable], watch: Sequence[str] | None) -> list[Watched]:
        if watch is None:
            return watched_by_default(variables)
        watched: dict[str, Watched] = {}
        try:
            for name in watch:
                if states_for([name]):
                    item = self._states.add(len(watched), name)
                else:
                    (item,) = watched_by_name(variables, [name])
                watched.setdefault(item.label, item)
        except NameFault as error:
            raise BagError("AMX6821", self._bag, error.message, error.hint) from error
        return list(watched.values())

    def _all_changes(self) -> Iterator[Change]:
        """Yield each instant of the recording with a change; the writes of one instant together."""
        values, instant = self._values, self.origin_ns
        for entry in self._messages:
            message = entry.message
            if entry.type_name in self._also:
                self._take_also(entry)
                if entry.type_name in self._alone:
                    continue
            states: Iterable[tuple[int, Cell]] = ()
            entries: Iterable[Entry] | None = ()
            if isinstance(message, (TaskState, PlantState, RollState, WebState)):
                states = self._states.values(message)
            elif isinstance(message, (CommonImage, CommonWrite)):
                entries = self._log.take(message)
                if self._take_writes is not None and entries and isinstance(message, CommonWrite):
                    self._note_writes(message, entries)
            else:
                self._take_other(entry)
                continue
            if entries is None:
                continue
            if message.stamp != instant:
                changed = values.changes()
                if changed:
                    yield max(0, instant - self.origin_ns), changed
                instant = message.stamp
            for column, value in states:
                values.set_value(column, value)
            values.take(entries)
        changed = values.changes()
        if changed:
            yield max(0, instant - self.origin_ns), changed
        self.end_ns = max(0, instant - self.origin_ns, (self._reader.last_stamp or 0) - self.origin_ns)

    def _take_other(self, entry: BagMessage) -> None:
        message = entry.message
        if isinstance(message, VariableTable):
            self._log.check_table(message)
        elif isinstance(message, Scan) and self._take_scan is not None:
            time = max(0, message.stamp - self.origin_ns)
            if self._window.holds(time):
                self._take_scan(time, message)

    def _take_also(self, entry: BagMessage) -> None:
        message: Any = entry.message
        time = message.stamp - self.origin_ns
        if self._window.holds(time):
            self._also[entry.type_name](time, message)

    def _note_writes(self, message: CommonWrite, entries: Iterable[Entry]) -> None:
        """Report a write from outside, without the registers under I/O points, which repeat the same write."""
        writer, time = self._outside.get(message.writer), max(0, message.stamp - self.origin_ns)
        if writer is None or message.kind != WriteKind.OUTSIDE or not self._window.holds(time):
            return
        named = [(self._named[number], index, value) for number, index, value in entries if number in self._named]
        points = [item for item in named if ":" not in item[0].name]
        found = [(element_name(variable, index), value) for variable, index, value in points or named]
        assert self._take_writes is not None
        self._take_writes(time, writer, found)

    def _in_window(self, changes: Iterator[Change]) -> Iterator[Change]:
        """Yield the changes within the window, beginning with the values that hold at its start."""
        start, end = self._window.start_ns, self._window.end_ns
        if not start and end is None:
            yield from changes
            return
        held: dict[int, Cell] = {}
        begun = False
        for time, changed in changes:
            if end is not None and time > end:
                self.end_ns = end
                break
            if time < start:
                held.update(changed)
            elif begun:
                yield time, changed
            else:
                begun = True
                if time > start and held:
                    yield start, held
                    yield time, changed
                else:
                    yield time, {**held, **changed}
        else:
            if end is not None:
                self.end_ns = min(self.end_ns, end)
        if not begun and held and start <= self.end_ns:
            yield start, held

    def _on_grid(self, changes: Iterator[Change]) -> Iterator[Change]:
        """Yield the instants of the grid, from the first with a known value, with the changes since the last one."""
        step = self._window.step_ns
        due: int | None = None
        held: dict[int, Cell] = {}
        rows = 0
        for time, changed in changes:
            if due is None:
                due = self._window.start_ns + -(-(time - self._window.start_ns) // step) * step
            while due < time:
                rows = self._count(rows)
                yield due, held
                held = {}
                due += step
            held.update(changed)
        while due is not None and due <= self.end_ns:
            rows = self._count(rows)
            yield due, held
            held = {}
            due += step

    def _require_few_rows(self, progress: Progress | None) -> None:
        """Refuse a grid with too many rows before any row is made."""
        start, end, step = self._window.start_ns, self._window.end_ns, self._window.step_ns
        if not step or (end is not None and (end - start) // step < MAX_GRID_ROWS):
            return
        first_half = (lambda share: progress(share / 2)) if progress is not None else None
        span = span_of(self._bag, self.origin_ns, progress=first_half)
        if progress is not None:
            self._reader.on_progress = lambda share: progress((1 + share) / 2)
        first, last = (max(0, stamp - self.origin_ns) for stamp in (span.first, span.last))
        if end is not None:
            last = min(last, end)
        due = start + max(0, -(-(first - start) // step)) * step
        rows = (last - due) // step + 1
        if rows > MAX_GRID_ROWS:
            raise self._too_many(f"would make a table of {rows} rows on that grid, at most {MAX_GRID_ROWS}")

    def _count(self, rows: int) -> int:
        if rows >= MAX_GRID_ROWS:
            raise self._too_many(f"has more than {MAX_GRID_ROWS} rows on that grid")
        return rows + 1

    def _too_many(self, text: str) -> BagError:
        hint = "give a greater --every, or a part of the run by --from and --to"
        return BagError("AMX6826", self._bag, text, hint)
