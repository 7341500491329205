"""Executes recorded scans again from nothing but a bag: what replay will do, without its comforts.

Each task starts from a recorded TaskState. A scan gets its latch from ``Scan.latched`` (differences added up), its
reads from ``Scan.read`` one after the other, and must then write and commit what the bag says.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rack.helpers import config_at

from automax_ros.compile.base.layout import Layout
from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.types import DataType, Value
from automax_ros.rack.rack import Rack
from automax_ros.recordings.read.reader import BagReader
from automax_ros.runtime.tasks.task import Status, Task


class RecordedMemory:
    """Stands in for common memory: gives what a scan saw, notes what it writes."""

    def __init__(self, names: list[str]) -> None:
        self.now_ns = 0
        self.latched: dict[int, Value] = {}
        self.reads: deque[tuple[int, int, Value]] = deque()
        self.written: list[tuple[int, int, Value]] = []
        self.committed: list[tuple[int, int, Value]] = []
        self._views = {name: number for number, name in enumerate(names)}

    def view(self, name: str) -> int:
        return self._views[name]

    def is_forced(self, view: int) -> bool:  # noqa: ARG002
        return False

    def watch_forces(self, changed: object) -> None:
        """Nothing is forced in the runs that are executed again here."""

    def plan(self, views: list[int]) -> list[int]:
        return views

    def latch(self, plan: list[int]) -> tuple[Value, ...]:
        return tuple(self.latched[view] for view in plan)

    def read_now(self, view: int, element: int = 0) -> Value:
        wanted, index, value = self.reads.popleft()
        assert (wanted, index) == (view, element)
        return value

    def write_now(self, view: int, value: Value, writer: int, element: int = 0, kind: object = None) -> None:  # noqa: ARG002
        self.written.append((view, element, value))

    def commit(self, changes: list[tuple[int, Value]], writer: int) -> None:  # noqa: ARG002
        self.committed += [(view, 0, value) for view, value in changes]


@dataclass
class Outcome:
    """How much of a bag was executed again; all of it agreed."""

    scans: dict[str, int] = field(default_factory=dict)
    states: dict[str, int] = field(default_factory=dict)


class Reexecution:
    """All tasks of a recorded run; ``folder`` takes the files stored in the bag."""

    def __init__(self, bag: Path, folder: Path) -> None:
        self._reader = BagReader(bag)
        for attachment in self._reader.attachments():
            (folder / attachment.name).write_bytes(attachment.data)
        config = config_at(folder / "rack.yaml")
        self._kinds = [variable.type for variable in config.variables]
        names = [variable.name for variable in config.variables]
        compiled = {task.name: task.compiled for task in Rack(config).tasks}
        self._memories = {name: RecordedMemory(names) for name in compiled}
        self._tasks = {name: _task(item, self._memories[name]) for name, item in compiled.items()}
        self._known: dict[str, int] = {}

    def execute(self) -> Outcome:
        """Execute every scan and compare; states in between must be those that we have come to."""
        outcome = Outcome()
        for item in self._reader.messages(types={"automax_msgs/msg/Scan", "automax_msgs/msg/TaskState"}):
            message = item.message
            counts = outcome.scans if hasattr(message, "latched") else outcome.states
            counts[message.task] = counts.get(message.task, 0) + 1
            if hasattr(message, "latched"):
                self._scan(message)
            else:
                self._state(message)
        return outcome

    def _state(self, message: Any) -> None:
        task = self._tasks[message.task]
        assert message.layout_hash == task.layout.hash
        assert message.source_hash == task.compiled.program.source_hash
        values = _state_values(task.layout, message)
        if self._known.get(message.task) == message.scan and not self._tuned(task, values):
            assert _bits(task.snapshot()) == _bits(values)
        task.restore(values)
        self._known[message.task] = message.scan

    def _tuned(self, task: Task, values: list[Value]) -> bool:
        """Whether a state differs from ours in tunables alone: somebody has tuned the task since its last scan."""
        pairs = zip(_bits(task.snapshot()), _bits(values), strict=True)
        different = {number for number, (before, after) in enumerate(pairs) if before != after}
        tunables = {number for number, item in enumerate(task.layout.fields) if item.role.value == "tunable"}
        return bool(different) and different <= tunables

    def _scan(self, message: Any) -> None:
        task, memory = self._tasks[message.task], self._memories[message.task]
        if message.full:
            memory.latched.clear()
        memory.latched.update({view: value for view, _, value in self._typed(message.latched)})
        memory.reads.extend(self._typed(message.read))
        memory.written.clear()
        memory.committed.clear()
        if message.scan == 0:
            record = task.run(message.stamp)
        else:
            task.scan_number, task.status = message.scan - 1, Status.RUNNING
            record = task.scan(message.stamp, message.skipped)
        assert record is not None
        assert memory.written == self._typed(message.written)
        assert memory.committed == self._typed(message.committed)
        assert not memory.reads, "it reads less than the recorded scan"
        assert record.errors == [tuple(error) for error in message.errors]
        self._known[message.task] = message.scan

    def _typed(self, values: Any) -> list[tuple[int, int, Value]]:
        texts = iter(values.text)
        return [
            (view, element, _typed(self._kinds[view], value, texts))
            for view, element, value in zip(values.variable, values.element, values.value, strict=True)
        ]


def _bits(values: list[Value]) -> list[str]:
    """Values for a comparison in which NaN is NaN, and 0.0 is not -0.0."""
    return [repr(value) for value in values]


def _task(compiled: CompiledTask, memory: Any) -> Task:
    task = Task(compiled, memory)
    task.record_scans()
    return task


def _typed(kind: DataType, value: float, texts: Any) -> Value:
    if kind is DataType.STRING:
        return str(next(texts))
    if kind is DataType.BOOLEAN:
        return bool(value)
    return value if kind is DataType.REAL else int(value)


def _state_values(layout: Layout, message: Any) -> list[Value]:
    assert list(message.field) == [item.name for item in layout.fields]
    assert list(message.size) == [item.size for item in layout.fields]
    texts = iter(message.text)
    kinds = [item.type for item in layout.fields for _ in range(item.size)]
    return [_typed(kind, value, texts) for kind, value in zip(kinds, message.value, strict=True)]
