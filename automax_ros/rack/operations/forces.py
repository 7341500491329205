"""The forces of a rack: which variables may be forced, how many, and which are (J2-3106-1 p. 18-10).

A force holds a simple variable of any type but STRING against every write, until it is released; it survives STOP ALL
and power. Commons are named by their names, a task's own variables with the task: ``SPEED.COUNT%``. A tunable cannot be
forced, since only the operator writes it (decision), nor can an output of a drive's current minor loop (52.0).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.names import PREDEFINED, Element, NameFault
from automax_ros.core.types import DataType, Value
from automax_ros.language.tree.tree import Scope
from automax_ros.rack.base.local_names import LocalElement, local_named
from automax_ros.rackfile.model.config import CommonElement, RackConfig
from automax_ros.rackfile.reading.executive import most_forces, version_text
from automax_ros.runtime.memory.memory import FORCING, CommonMemory
from automax_ros.runtime.memory.views import MemoryValueError, ViewSpec, fitting
from automax_ros.runtime.tasks.task import Task

Target = CommonElement | LocalElement
"""A variable that an operation means: a common or an element of one, or a task's own."""


@dataclass(frozen=True)
class Force:
    """A line of the force table: a variable and the value at which it is held.

    ``under`` is the value written last, which the force hides; None for a local, for which none is kept.
    """

    name: str
    value: Value
    under: Value | None = None


class ForceTable:
    """Forces variables of one rack, within the limits of its Executive."""

    def __init__(self, config: RackConfig, memory: CommonMemory, tasks: Callable[[], Sequence[Task]]) -> None:
        """Create a table without forces; ``tasks`` returns the rack's tasks."""
        self._config, self._memory, self._tasks = config, memory, tasks
        self.most = most_forces(config.executive)

    def table(self) -> list[Force]:
        """Return the forces: commons in the order of the rack file, then locals, task by task."""
        memory = self._memory
        held = sorted(memory.forced)
        under = {(view, element): value for view, element, value in memory.under_forces}
        commons = [Force(memory.specs[key[0]].name, memory.read_now(*key), under.get(key)) for key in held]
        return commons + [
            Force(f"{task.name}.{name}", value) for task in self._tasks() for name, value in task.forces.items()
        ]

    def local(self, name: str) -> LocalElement:
        """Return the task's own variable with a name like ``TASK.NAME``.

        Raises:
            NameFault: there is none.
        """
        return local_named(self._tasks(), name)

    def targets(self) -> dict[str, Target]:
        """Return the variables that are forced by their full names, in the order of ``table``."""
        commons = [
            Element(self._config.by_name[self._memory.specs[view].name]) for view, _ in sorted(self._memory.forced)
        ]
        own: list[Target] = [self.local(f"{task.name}.{name}") for task in self._tasks() for name in task.forces]
        return {item.label: item for item in commons + own}

    def force(self, target: Target, value: Value, writer: int) -> None:
        """Hold a variable at a value; one that is forced already gets the new value.

        Raises:
            MemoryValueError: the value does not fit, the variable cannot be forced, or the most that may be are forced.
        """
        if isinstance(target, LocalElement):
            self._force_local(target, value, writer)
            return
        view = self._memory.view(target.name)
        self._require(target.name, self._why_not(view) or self._too_many(again=self._memory.is_forced(view)))
        self._memory.force(view, value, writer=writer)

    def release(self, target: Target, writer: int) -> None:
        """End a force; the value stays until the next write."""
        if isinstance(target, LocalElement):
            own = target.variable.name
            held = {name: value for name, value in target.task.forces.items() if name != own}
            self._hold(target.task, held, writer)
        else:
            self._memory.release(self._memory.view(target.name), writer=writer)

    def release_all(self, writer: int) -> None:
        """End all forces."""
        for task in self._tasks():
            task.hold({})
        self._memory.note_locals(writer, forced=False)
        for view, element in sorted(self._memory.forced):
            self._memory.release(view, element, writer)

    def hold_again(self, task: Task, forces: Mapping[str, Value], writer: int) -> list[str]:
        """Restore the forces of a task after its installation; return the names that it lacks, which are released."""
        symbols = task.compiled.program.symbols
        kept = {name: value for name, value in forces.items() if name in symbols and _may_be_held(task, name)}
        self._hold(task, kept, writer)
        return [f"{task.name}.{name}" for name in forces if name not in kept]

    def load(self) -> None:
        """Update memory after tasks were restored from a state: whether any local is forced."""
        self._memory.note_locals(forced=self._any_local(), report=False)

    def _force_local(self, meant: LocalElement, value: Value, writer: int) -> None:
        symbol, forces = meant.variable, meant.task.forces
        reason = meant.why_not_forced or meant.task.why_not_forced(symbol.name, symbol.scope)
        self._require(meant.label, reason or self._too_many(again=symbol.name in forces))
        fit = fitting(ViewSpec(meant.label, symbol.type), value)
        self._hold(meant.task, {**forces, symbol.name: fit}, writer)

    def _hold(self, task: Task, forces: Mapping[str, Value], writer: int) -> None:
        task.hold(forces)
        self._memory.note_locals(writer, forced=self._any_local())

    def _any_local(self) -> bool:
        return any(task.forces for task in self._tasks())

    def _require(self, name: str, reason: str | None) -> None:
        if reason is not None:
            raise MemoryValueError(f"{name} cannot be forced: {reason}")

    def _why_not(self, view: int) -> str | None:
        memory = self._memory
        spec = memory.specs[view]
        if spec.is_array or spec.type is DataType.STRING:
            return "it is an array" if spec.is_array else "it is a string"
        if spec.name == FORCING:
            return "it shows whether anything is forced"
        if spec.name in PREDEFINED:
            return "the rack itself writes it"
        for task in self._tasks():
            reason = task.why_not_forced(spec.name, Scope.COMMON)
            if reason is not None:
                return reason
        others = memory.registers.others(view)
        return f"{memory.specs[others[0]].name} is part of the same register" if others else None

    def _too_many(self, *, again: bool) -> str | None:
        """Return the reason if one more is too many; a variable that is forced ``again`` does not count."""
        if again or len(self.table()) < self.most:
            return None
        version = version_text(self._config.executive)
        return f"{self.most} variables are forced, the most with executive {version}: release one first"


def _may_be_held(task: Task, name: str) -> bool:
    try:
        meant = local_named([task], f"{task.name}.{name}")
    except NameFault:
        return False
    return meant.why_not_forced is None and task.why_not_forced(name, meant.variable.scope) is None
