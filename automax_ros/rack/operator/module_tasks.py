"""Operates all tasks of one module together, as its node's transitions do. All of them, or none."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import printable
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.modules.module import Module
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.reading.files import FileFault, lies_next_to, read_task_source
from automax_ros.runtime.tasks.task import Status


class ModuleTasks:
    """Operates the tasks of one module of a rack, between two scans.

    Raises:
        OperationRefused: ``run``, ``stop`` and ``delete``, if the rack refuses one task; then none is changed.
    """

    def __init__(self, rack: Rack, module: Module) -> None:
        self._rack, self._items = rack, list(module.tasks)
        self._configs = {task.name: task for task in module.config.tasks}
        self._inside = {name for name, task in self._configs.items() if lies_next_to(task.file, rack.config.path)}

    @property
    def deleted(self) -> list[str]:
        """The tasks that were deleted."""
        return [item.name for item in self._items if item.name in self._rack.operations.deleted]

    @property
    def are_deleted(self) -> bool:
        """Whether the module has tasks, and all of them are deleted."""
        return bool(self._items) and len(self.deleted) == len(self._items)

    @property
    def is_running(self) -> bool:
        """Whether at least one of them is in RUN."""
        return any(map(_runs, self._items))

    def run(self) -> None:
        """Put tasks at rest into RUN, in the order of priority and name, except deleted ones."""
        resting = [item for item in self._items if not _runs(item) and item.name not in self.deleted]
        order = sorted(resting, key=lambda item: (item.task.priority, item.name))
        for item in _first(order, lambda item: item.task.status is Status.FAULTED):
            self._rack.operations.run(item.name)

    def stop(self) -> None:
        """Stop those that run."""
        running = [item for item in self._items if _runs(item)]
        for item in _first(running, lambda item: self._configs[item.name].critical):
            self._rack.operations.stop(item.name)

    def delete(self) -> None:
        """Delete all of them."""
        there = [item for item in self._items if item.name not in self.deleted]
        for item in _first(there, _runs):
            self._rack.operations.delete(item.name)

    def source(self, name: str) -> SourceText:
        """Return the source of a task as it is on the disk now; safe on any thread.

        A file that was in the rack file's folder and is outside now is not read (decision: a link may have been
        exchanged since the rack file was checked).

        Raises:
            OperationRefused: it cannot be read.
        """
        file = self._configs[name].file
        try:
            if name in self._inside and not lies_next_to(file, self._rack.config.path):
                raise FileFault("lies outside the rack file's folder now")
            return read_task_source(file)
        except FileFault as fault:
            raise OperationRefused(f"the source {printable(file.name)} of task {name} {fault}") from fault


def _runs(item: ScheduledTask) -> bool:
    return item.task.status is Status.RUNNING


def _first(items: list[ScheduledTask], refused: Callable[[ScheduledTask], bool]) -> list[ScheduledTask]:
    """Sort tasks that the rack will refuse to the front: then nothing has been changed when it does."""
    return sorted(items, key=lambda item: not refused(item))
