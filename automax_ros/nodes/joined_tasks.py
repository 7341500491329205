"""The tasks of other processes of a rack, in the table that the home sends.

Each other process sends the table of its own modules on ``tasks/parts``, each second and when it changes; the home
joins them by module. A module that has not been heard of for ``SILENT_NS`` is not in the table (decision): nobody knows
how its tasks stand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from automax_ros.core.ticks import NS_PER_S
from automax_ros.nodes.bus_way import BusWay, Terms
from automax_ros.nodes.module_node import ModuleNode
from automax_ros.nodes.topics import ros_qos
from automax_ros.running.health import FROM_STRANGERS
from automax_ros.wire.messages import NAMES
from automax_ros.wire.qos import QosProfile
from automax_ros.wire.task_table import TaskInfo as RemoteTask
from automax_ros.wire.task_table import TaskTable as RemoteTable

PARTS = "tasks/parts"
"""The topic of the parts, in the rack's namespace."""
PART = QosProfile("reliable", "transient_local", "keep_last", 32)
"""The last parts of all processes wait for the home."""
SILENT_NS = 3 * NS_PER_S
MOST_BYTES = 1 << 20
"""Longest part that is read."""


class JoinedTasks:
    """Hears the parts; ``changed`` is called when tasks have come. To be used where common memory is."""

    def __init__(self, node: ModuleNode, changed: Callable[[], None]) -> None:
        """Subscribe."""
        self._site, self._changed = node.site, changed
        rack = node.site.rack
        self._tasks = {
            (module.name, module.slot): {task.name for task in module.tasks}
            for module in rack.config.modules
            if module.slot not in rack.part.slots
        }
        self._heard: dict[str, tuple[int, list[RemoteTask]]] = {}
        BusWay(node, PARTS, NAMES[RemoteTable], ros_qos(PART), self._take, self._refuse, Terms(MOST_BYTES))

    def tasks(self, now_ns: int) -> Sequence[RemoteTask]:
        """Return the tasks of all modules that were heard of lately."""
        return [item for at_ns, items in self._heard.values() if now_ns - at_ns <= SILENT_NS for item in items]

    def _take(self, table: RemoteTable, _: bytes) -> None:
        if table.run_id != self._site.stream.run_id:
            return  # the run before, whose part still waits: the bus tells of other racks
        modules: dict[str, list[RemoteTask]] = {}
        for item in table.tasks:
            if item.task not in self._tasks.get((item.module, item.slot), ()):
                self._refuse(PARTS, "a task that is not another process's")
                return
            modules.setdefault(item.module, []).append(item)
        now_ns = self._site.rack.now_ns
        self._heard |= {module: (now_ns, items) for module, items in modules.items()}
        self._changed()

    def _refuse(self, topic: str, what: str) -> None:
        self._site.health.note("refused table", what[:40], lambda: f"{topic}: {what} was refused", most=FROM_STRANGERS)
