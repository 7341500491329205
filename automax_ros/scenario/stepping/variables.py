"""Variables as stepping names them: commons, ``REF%`` and ``TABLE%(3)``, and a task's own, ``SPEED.COUNT%``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from automax_ros.core.types import DataType, Value
from automax_ros.language.tree.tree import Scope
from automax_ros.rack.base.local_names import local_named
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.value_names import common_named
from automax_ros.runtime.tasks.task import Task
from automax_ros.scenario.stepping.held_scans import ByLines


@dataclass(frozen=True)
class Variable:
    """A simple variable or an array's element. ``task`` is its task, "" for a common."""

    label: str
    type: DataType
    length: int
    task: str
    read: Callable[[], Value]


@dataclass(frozen=True)
class Change:
    """Values of a variable before and after a step."""

    label: str
    before: Value
    after: Value


@dataclass(frozen=True)
class Variables:
    """Finds variables of a rack; a task's own have, in a held scan, their values at its line."""

    rack: Rack
    execution: ByLines

    def find(self, name: str) -> Variable:
        """Return the variable with a name.

        Raises:
            NameFault: there is no such variable or element.
        """
        return self._of_task(name) if "." in name else self._common(name)

    def of_task(self, name: str) -> Iterator[Variable]:
        """Yield the simple variables of a task, its commons too, in the order of declaration."""
        for symbol in self.rack.task(name).compiled.program.symbols.values():
            if not symbol.dimensions:
                common = symbol.scope is Scope.COMMON
                yield self._common(symbol.name) if common else self._of_task(f"{name}.{symbol.name}")

    def _common(self, name: str) -> Variable:
        meant = common_named(self.rack.config, name)
        view = self.rack.memory.view(meant.name)
        read = partial(self.rack.memory.read_now, view, meant.index)
        return Variable(meant.label, meant.variable.type, meant.variable.length, "", read)

    def _of_task(self, name: str) -> Variable:
        meant = local_named(self.rack.tasks, name)
        kind = meant.variable
        read = partial(self._local, meant.task, kind.name, meant.element.index)
        return Variable(meant.label, kind.type, kind.length, meant.task.name, read)

    def _local(self, task: Task, name: str, index: int) -> Value:
        held = self.execution.held
        value = held.values[name] if held is not None and held.item.task is task and held.line else task.value(name)
        return value[index] if isinstance(value, list) else value
