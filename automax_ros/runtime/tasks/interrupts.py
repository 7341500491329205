"""Hardware interrupts: which events of which tasks a module's interrupt status and control register (ISCR) sets.

An EVENT with INTERRUPT_STATUS names a common that shows an ISCR; when the module interrupts, the event is set
(J-3675 p. 6-17). The operating system enables the interrupt by the EVENT of an installed task (57C411 p. 4-1).
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.scan.events import Event, Events
from automax_ros.runtime.tasks.basic_task import awaits
from automax_ros.runtime.tasks.task import Status, Task


class Interrupts:
    """The interrupts of one rack; an ISCR is the view of a module's bank with a register."""

    def __init__(self, memory: CommonMemory, events: Events) -> None:
        self._memory, self._events = memory, events
        self._bound: dict[tuple[int, int], dict[tuple[int, str, str], tuple[Task, Event]]] = {}
        self._watchers: list[Callable[[], None]] = []

    def bind(self, task: Task) -> None:
        """Connect the hardware events that a task declares, in place of those of its earlier source."""
        for bound in self._bound.values():
            for key in [key for key, (other, _) in bound.items() if other is task]:
                del bound[key]
        for declared in task.compiled.program.events:
            if declared.interrupt_status is not None:
                place = self._memory.specs[self._memory.view(declared.interrupt_status.name)].place
                assert place is not None
                bound = self._bound.setdefault((place.bank, place.register), {})
                bound[task.priority, task.name, declared.name] = task, self._events.event(declared.name)
        for changed in self._watchers:
            changed()

    def watch(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` whenever a task was installed."""
        self._watchers.append(changed)

    def is_enabled(self, bank: int, register: int) -> bool:
        """Return whether an installed task declares an event of this ISCR."""
        return bool(self._bound.get((bank, register)))

    def waiting(self, bank: int, register: int) -> list[str]:
        """Return the tasks in RUN that an interrupt resumes, in the order of priority and name."""
        bound = sorted(self._bound.get((bank, register), {}).items())
        return [task.name for (*_, event), (task, _) in bound if task.status is Status.RUNNING and awaits(task, event)]

    def post(self, bank: int, register: int, now_ns: int, skipped: int = 0) -> None:
        """Set the events of an ISCR, in the order of their tasks; a late host left out ``skipped`` before it."""
        bound = sorted(self._bound.get((bank, register), {}).items())
        for event in dict.fromkeys(event for _, (_, event) in bound):
            event.set(now_ns, skipped)
