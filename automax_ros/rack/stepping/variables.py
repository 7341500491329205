"""Variables as stepping names them: commons, ``REF%`` and ``TABLE%(3)``, and a task's own, ``SPEED.COUNT%``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from automax_ros.core.names import NameFault, element
from automax_ros.core.types import DataType, Value
from automax_ros.language.syntax.tree import Scope
from automax_ros.rack.rack import Rack
from automax_ros.rack.settings import common_named
from automax_ros.rack.stepping.by_lines import ByLines
from automax_ros.running.task import Task


@dataclass(frozen=True)
class Variable:
    """A simple variable or an array's element. ``task`` is whose it is, "" for a common."""

    label: str
    type: DataType
    length: int
    task: str
    read: Callable[[], Value]


@dataclass(frozen=True)
class Change:
    """What a variable was before a step, and after it."""

    label: str
    before: Value
    after: Value


@dataclass(frozen=True)
class Variables:
    """Finds the variables of a rack; in a held scan a task's own are as they are at its line."""

    rack: Rack
    execution: ByLines

    def find(self, name: str) -> Variable:
        """Return the variable that a name means.

        Raises:
            NameFault: there is none, or no element.
        """
        owner, dot, own = name.partition(".")
        return self._of_task(owner.strip().upper(), own) if dot else self._common(name)

    def of_task(self, name: str) -> Iterator[Variable]:
        """Yield the simple variables of a task, its commons too, in the order of declaration."""
        for symbol in self.rack.task(name).compiled.program.symbols.values():
            if not symbol.dimensions:
                common = symbol.scope is Scope.COMMON
                yield self._common(symbol.name) if common else self._of_task(name, symbol.name)

    def _common(self, name: str) -> Variable:
        meant = common_named(self.rack.config, name)
        view = self.rack.memory.view(meant.name)
        read = partial(self.rack.memory.read_now, view, meant.index)
        return Variable(meant.label, meant.variable.type, meant.variable.length, "", read)

    def _of_task(self, owner: str, name: str) -> Variable:
        tasks = {task.name: task for task in self.rack.tasks}
        if owner not in tasks:
            raise NameFault(f"the rack has no task '{owner}'", f"it has {', '.join(tasks)}")
        task = tasks[owner]
        symbols = task.compiled.program.symbols
        locals_ = {item.name: item for item in symbols.values() if item.scope is Scope.LOCAL}
        meant = element(name, locals_, f"task {owner} has no variable of its own")
        kind = meant.variable
        read = partial(self._local, task, kind.name, meant.index)
        return Variable(f"{owner}.{meant.label}", kind.type, kind.length, owner, read)

    def _local(self, task: Task, name: str, index: int) -> Value:
        held = self.execution.held
        value = held.values[name] if held is not None and held.item.task is task and held.line else task.value(name)
        return value[index] if isinstance(value, list) else value
