"""Executes recorded scans again line by line, so that values which a later line of the scan overwrites are seen too."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

from automax_ros.compile.base.layout import Role, StateValue
from automax_ros.compile.base.scan_io import LineValues
from automax_ros.compile.compiler import CompiledTask, ScanSteps
from automax_ros.core.names import element_name
from automax_ros.core.types import Value
from automax_ros.language.program import Program, places_that_write
from automax_ros.language.tree.tree import Call, Reference, Scope
from automax_ros.language.tree.walk import statements_in_order
from automax_ros.recordings.read.common_log import Entry, Key
from automax_ros.replay.scans.task import TaskReplay
from automax_ros.runtime.tasks.task import ScanRecord, Status, Task

MOST_ELEMENTS = 256
"""Most elements of a task's own array that are shown at the start of a scan (decision)."""


@dataclass
class ScanLines:
    """The values of a scan by names without the task: at its start, and after each BASIC line those that it wrote.

    A line that was executed several times has the values after its last execution.
    """

    before: dict[str, Value] = field(default_factory=dict)
    after: dict[int, dict[str, Value]] = field(default_factory=dict)


@dataclass(frozen=True)
class Kept:
    """What a task in a replay has from its scans so far, for another replay of it that goes on from here."""

    values: Sequence[Value]
    forces: Mapping[str, Value]
    scan: int
    status: Status
    apart: Mapping[Key, Value]


def kept_of(replayed: TaskReplay) -> Kept:
    """Return what a task has between two scans."""
    task = replayed.task
    return Kept(task.snapshot(), dict(task.forces), task.scan_number, task.status, dict(replayed.memory.apart))


class LineReplay(TaskReplay):
    """Executes the scans of one task again, line by line while ``by_lines``; ``lines`` are those of the last scan.

    There are none of a BASIC task, nor of what is before SCAN_LOOP.
    """

    by_lines = False
    lines: ScanLines | None = None

    def go_on(self, kept: Kept) -> None:
        """Continue after the recorded scan that was followed last, with what another replay had after it.

        Raises:
            ValueError: it is of another task.
        """
        task = self._task
        task.restore(list(kept.values))
        task.hold(kept.forces)
        task.scan_number, task.status = kept.scan, kept.status
        self.memory.apart = dict(kept.apart)
        self._starts_at, self._synchronous = None, True

    def _scanned(self, now_ns: int, skipped: int) -> ScanRecord | None:
        self.lines = None
        if not self.by_lines or self._task.compiled.program.is_basic:
            return super()._scanned(now_ns, skipped)
        task = self._task
        points = _Points(task, self.memory.writes_made)
        steps = task.scan_modeled(now_ns, skipped, form=cast(ScanSteps, task.compiled.scan_lines.scan))
        record: ScanRecord | None = None
        while True:
            try:
                reached = cast(LineValues, next(steps))
            except StopIteration as end:
                record = end.value
                break
            points.add(*reached, self.memory.writes_made)
        if record is not None:
            self.lines = points.lines(record, self._label, self._present, self.memory.writes_made)
        return record

    def _label(self, key: Key) -> str | None:
        """Return the name of a common; None for what a BASIC task or a drive exchanges."""
        view, index = key
        return element_name(self._commons.rack[view], index) if view < len(self._commons.rack) else None

    def _present(self, entry: Entry) -> Value:
        """Return the value of a common after a write: a force keeps its own."""
        key = entry[:2]
        return self._commons.value(key) if key in self._commons.forced else entry[2]


class _Points:
    """The places that one scan has reached: the line that follows, the values there, and the writes made before."""

    def __init__(self, task: Task, writes: int) -> None:
        self._task, self._compiled = task, task.compiled
        self._names = [field.name for field in task.compiled.layout.fields]
        cml = task.compiled.program.cml
        self._reached: list[tuple[int, list[StateValue], int]] = []
        self.add(0 if cml is None else cml.line, task.state, writes)

    def add(self, line: int, values: Sequence[StateValue], writes: int) -> None:
        """Add a place; arrays are copied, for the scan goes on with them."""
        self._reached.append((line, [item[:] if isinstance(item, list) else item for item in values], writes))

    def lines(
        self, record: ScanRecord, label: Callable[[Key], str | None], present: Callable[[Entry], Value], writes: int
    ) -> ScanLines:
        """Return the values of the scan, which has ended."""
        compiled, start = self._compiled, self._reached[0]
        latched = dict(zip(compiled.latched, record.latched, strict=True))
        commits = dict(record.commits)
        last = [commits.get(view, value) for view, value in zip(compiled.latched_views, record.latched, strict=True)]
        self.add(0, [*self._task.state, *last], writes)
        names, found = [*self._names, *compiled.latched], ScanLines()
        found.before = {**dict(own_values(compiled, start[1])), **latched}
        for view, index, value in record.reads:
            name = label((view, index))
            if name is not None:
                found.before.setdefault(name, value)
        targets = _targets(compiled.program)
        for (line, values, made), (_, later, now_made) in zip(self._reached, self._reached[1:], strict=False):
            if not line:
                continue
            own = found.after.setdefault(line, {})
            before, after = dict(zip(names, values, strict=False)), dict(zip(names, later, strict=True))
            for name in targets.get(line, ()):
                own.update(_changed(compiled.program, name, before.get(name), after[name]))
            for entry in record.writes[made:now_made]:
                name = label(entry[:2])
                if name is not None:
                    own[name] = present(entry)
        return found


def own_values(compiled: CompiledTask, state: Sequence[StateValue]) -> Iterator[tuple[str, Value]]:
    """Yield names and values of a task's own variables, of an array the first ``MOST_ELEMENTS`` elements."""
    for place, value in zip(compiled.layout.fields, state, strict=False):
        if place.role not in (Role.LOCAL, Role.TUNABLE):
            continue
        if not isinstance(value, list):
            yield place.name, value
            continue
        symbol = compiled.program.symbols[place.name]
        for index, item in enumerate(value[:MOST_ELEMENTS]):
            yield element_name(symbol, index), item


def _changed(program: Program, name: str, before: object, after: StateValue) -> Iterator[tuple[str, Value]]:
    """Yield the value of a simple variable, or those elements of an array that have changed."""
    if not isinstance(after, list):
        yield name, after
        return
    old = before if isinstance(before, list) else [None] * len(after)
    for index, (one, other) in enumerate(zip(old, after, strict=True)):
        if one is None or one != other:
            yield element_name(program.symbols[name], index), other


def _targets(program: Program) -> dict[int, list[str]]:
    """Return the variables in the values of a scan that each BASIC line writes: locals, and commons by its block.

    Statements write commons to memory at once: these writes are in the record of the scan.
    """
    found: dict[int, list[str]] = {}
    for name, places in places_that_write(program, Scope.LOCAL).items():
        for line, _ in places:
            found.setdefault(line, []).append(name)
    calls = [program.calls[call.span] for call, _ in statements_in_order(program.scan) if isinstance(call, Call)]
    for bound in [*calls, *([program.cml] if program.cml is not None else [])]:
        names = [target.name for target in bound.targets if isinstance(target, Reference)]
        found.setdefault(bound.line, []).extend(name for name in names if program.symbols[name].latched)
    return found
