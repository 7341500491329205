"""Inputs as the process sets them: a write from outside reaches its register at once, or when it is no longer frozen.

The 57C409, 57C411, 57C419 and 57C421 freeze their inputs at an interrupt until the task that waits for it has scanned
(4.0). Writes of the process in between are kept, the last one of each variable, and take effect after that scan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Value
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.time.scheduler import Scheduler

Key = tuple[int, int]
"""View and element."""
Shape = Callable[[Value], Value]
"""Converts a value from outside to that of a register."""


class Freezer:
    """Inputs that freeze together: ``keys`` are all their views, ``owed`` the tasks that have not scanned yet."""

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
