"""Variables of tasks by their names in a rack: ``SPEED.COUNT%``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from automax_ros.core.names import Element, NameFault, element
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, Value
from automax_ros.language.program import Symbol
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.tasks.task import Task


@dataclass(frozen=True)
class LocalElement:
    """A task's simple variable, or an element of its array."""

    task: Task
    element: Element[Symbol]

    @property
    def variable(self) -> Symbol:
        """The declaration."""
        return self.element.variable

    @property
    def value(self) -> Value:
        """The present value."""
        value = self.task.value(self.variable.name)
        return value[self.element.index] if isinstance(value, list) else value

    @property
    def is_current(self) -> bool:
        """Whether the task still has this declaration: a reload brings others."""
        return self.task.compiled.program.symbols.get(self.variable.name) is self.variable

    @property
    def label(self) -> str:
        """The full name, with the task: ``SPEED.COUNT%``."""
        return f"{self.task.name}.{self.element.label}"

    @property
    def why_not_forced(self) -> str | None:
        """Why it cannot be forced; None for a simple local of any type but STRING (J2-3106-1 p. 18-10)."""
        if self.variable.dimensions:
            return "it is an element of an array"
        if self.variable.tuning is not None:
            return "it is a tunable"
        return "it is a string" if self.variable.type is DataType.STRING else None


def local_named(tasks: Iterable[Task], name: str) -> LocalElement:
    """Return the variable that ``TASK.NAME`` means; case and blanks do not matter.

    Raises:
        NameFault: the rack has no such task, or the task no such variable of its own.
    """
    owner, _, own = name.partition(".")
    known = {task.name: task for task in tasks}
    task = known.get(owner.strip().upper())
    if task is None:
        raise NameFault(f"the rack has no task {quoted(owner.strip().upper())}", f"it has {', '.join(known)}")
    symbols = task.compiled.program.symbols
    locals_ = {item.name: item for item in symbols.values() if item.scope is Scope.LOCAL}
    return LocalElement(task, element(own, locals_, f"task {task.name} has no variable of its own"))
