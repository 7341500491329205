"""The tables of a live rack on topics: ``tasks`` and ``forces`` (latched, on change), ``statistics`` (each second).

The process with common memory publishes forces and the tasks of the whole rack; each process publishes the
statistics of its own modules. A table is checked once per second of rack time, and soon after each operation, ten
times per second at most (decision).

Each other process publishes the tasks of its own modules on ``tasks/parts``, each second and when they change; common
memory's process joins them by module (``JoinedTasks``). A module without a part for ``SILENT_NS`` is not in the table
(decision): the state of its tasks is unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from automax_msgs.msg import Force, ForceTable, ScanStatistics, TaskInfo, TaskStatistics, TaskTable
from builtin_interfaces.msg import Time

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S, NS_PER_US
from automax_ros.core.values import source_text
from automax_ros.messages.types.messages import NAMES
from automax_ros.messages.types.messages import TaskInfo as RemoteTask
from automax_ros.messages.types.messages import TaskTable as RemoteTable
from automax_ros.messages.types.topics import LATCHED, QosProfile
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.modules.module import Module
from automax_ros.rack.operator.halting import is_halted
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.reading.executive import most_forces
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.qos import ros_qos
from automax_ros.ros.distributed.bus_topics import BusTopic, Terms
from automax_ros.runtime.health import FROM_STRANGERS
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import EventClass, EventKey

PARTS = "tasks/parts"
"""The topic of the parts, in the rack's namespace."""
PART = QosProfile("reliable", "transient_local", "keep_last", 32)
"""Latched, so that the process with common memory receives the last parts of all processes."""
SILENT_NS = 3 * NS_PER_S
MOST_BYTES = 1 << 20
"""Longest part that is read."""


PERIOD_NS = NS_PER_S
"""Period at which statistics are published and tables are checked, rack time."""
LOOK_NS = 100 * NS_PER_MS
"""Shortest time between two checks after operations, rack time."""
STATISTICS_DEPTH = 10
DELETED = "deleted"
"""The status of a task that was deleted from the rack."""
_UNCOUNTED = frozenset({"scans", "skipped"})
"""Fields whose change alone is not a reason to publish a table of tasks."""


class JoinedTasks:
    """Receives the parts; ``changed`` is called after each. For the process with common memory."""

    def __init__(self, node: ModuleNode, changed: Callable[[], None]) -> None:
        self._rack_context, self._changed = node.rack_context, changed
        rack = node.rack_context.rack
        self._tasks = {
            (module.name, module.slot): {task.name for task in module.tasks}
            for module in rack.config.modules
            if module.slot not in rack.part.slots
        }
        self._parts: dict[str, tuple[int, list[RemoteTask]]] = {}
        BusTopic(node, PARTS, NAMES[RemoteTable], ros_qos(PART), self._take, self._refuse, Terms(MOST_BYTES))

    def tasks(self, now_ns: int) -> Sequence[RemoteTask]:
        """Return the tasks of all modules whose parts are recent."""
        return [item for at_ns, items in self._parts.values() if now_ns - at_ns <= SILENT_NS for item in items]

    def _take(self, table: RemoteTable, _: bytes) -> None:
        if table.run_id != self._rack_context.stream.run_id:
            return  # latched by the run before; other racks are reported by the bus
        modules: dict[str, list[RemoteTask]] = {}
        for item in table.tasks:
            if item.task not in self._tasks.get((item.module, item.slot), ()):
                self._refuse(PARTS, "a task that is not another process's")
                return
            modules.setdefault(item.module, []).append(item)
        now_ns = self._rack_context.rack.now_ns
        self._parts |= {module: (now_ns, items) for module, items in modules.items()}
        self._changed()

    def _refuse(self, topic: str, what: str) -> None:
        self._rack_context.health.note(
            "refused table", what[:40], lambda: f"{topic}: {what} was refused", most=FROM_STRANGERS
        )


class StatusTables:
    """Publishes the tables of this process, by the publishers of one node."""

    def __init__(self, node: ModuleNode) -> None:
        self._rack, self._stream, self._pace = node.rack_context.rack, node.rack_context.stream, node.rack_context.pacer
        part = self._rack.part
        self._tasks = node.create_publisher(TaskTable, "tasks" if part.holds_common_memory else PARTS, ros_qos(LATCHED))
        self._joined = JoinedTasks(node, self._check_soon) if part.holds_common_memory and not part.is_whole else None
        self._statistics = node.create_publisher(ScanStatistics, "statistics", STATISTICS_DEPTH)
        self._forces = (
            node.create_publisher(ForceTable, "forces", ros_qos(LATCHED))
            if self._rack.part.holds_common_memory
            else None
        )
        self._sent: dict[type, Any] = {}
        self._reported_ns = self._next_check_ns = self._rack.now_ns
        self._is_pending = False
        self._key = EventKey(EventClass.OBSERVE, 0, "tables")
        self._rack.scheduler.every(PERIOD_NS, self._rack.now_ns, self._key, lambda now, _: self._report(now))
        self._rack.observe(self)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """Ignore scans: the tables are checked each second."""

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes: a force that a program sets is found within the second."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tuning: no table shows tunables."""

    def operated(self, operation: Operation) -> None:  # noqa: ARG002
        """Check the tables after the other events of this instant."""
        self._check_soon()

    def _check_soon(self) -> None:
        if is_halted(self._pace):
            self.look(self._rack.now_ns)
        elif not self._is_pending:
            self._is_pending = True
            self._rack.scheduler.at(max(self._rack.now_ns, self._next_check_ns), self._key, self._check_at)

    def _check_at(self, now_ns: int) -> None:
        self._is_pending, self._next_check_ns = False, now_ns + LOOK_NS
        self.look(now_ns)

    def look(self, now_ns: int) -> None:
        """Publish the tables that have changed."""
        tasks = [(module, item) for module in self._rack.task_modules for item in module.tasks]
        infos: list[Mapping[str, Any]] = [task_fields(self._rack, module, item) for module, item in tasks]
        if self._joined is not None:
            infos += [item._asdict() for item in self._joined.tasks(now_ns)]
            infos.sort(key=lambda info: info["slot"])
        counted = [{key: value for key, value in info.items() if key not in _UNCOUNTED} for info in infos]
        if self._is_new(TaskTable, counted):
            self._tasks.publish(TaskTable(**self._head(now_ns), tasks=[TaskInfo(**info) for info in infos]))
        if self._forces is None:
            return
        forces = [(item.name, source_text(item.value), _text(item.under)) for item in self._rack.forces()]
        if self._is_new(ForceTable, forces):
            lines = [Force(name=name, value=value, under=under) for name, value, under in forces]
            most = most_forces(self._rack.config.executive)
            self._forces.publish(ForceTable(**self._head(now_ns), most=most, forces=lines))

    def _report(self, now_ns: int) -> None:
        if not self._rack.part.holds_common_memory:
            self._sent.clear()  # publish each second, so that common memory's process knows that this process lives
        self.look(now_ns)
        passed_ns, self._reported_ns = now_ns - self._reported_ns, now_ns
        tasks = [statistics_of(module, item, passed_ns) for module in self._rack.task_modules for item in module.tasks]
        if passed_ns:
            self._statistics.publish(ScanStatistics(**self._head(now_ns), window_s=passed_ns / NS_PER_S, tasks=tasks))

    def _is_new(self, kind: type, content: Any) -> bool:
        if self._sent.get(kind) == content:
            return False
        self._sent[kind] = content
        return True

    def _head(self, now_ns: int) -> dict[str, Any]:
        stamp = self._stream.stamp(now_ns)
        return {
            "stamp": Time(sec=stamp // NS_PER_S, nanosec=stamp % NS_PER_S),
            "rack": self._rack.config.name,
            "run_id": self._stream.run_id,
        }


def status_of_task(rack: Rack, task: Task) -> str:
    """Return the status of a task as a word."""
    return DELETED if task.name in rack.operations.deleted else task.status.value


def task_fields(rack: Rack, module: Module, item: ScheduledTask) -> Mapping[str, Any]:
    """Return the status of a module's task, as the fields of TaskInfo."""
    task, last = item.task, item.task.errors.last
    config = next(config for config in module.config.tasks if config.name == task.name)
    return {
        "task": task.name,
        "module": module.config.name,
        "slot": module.config.slot,
        "status": status_of_task(rack, task),
        "priority": task.priority,
        "critical": config.critical,
        "period_ms": _period_ms(task),
        "scans": item.statistics.scans,
        "skipped": item.statistics.skipped,
        "errors": task.errors.count,
        "last_error": "" if last is None else last.describe(),
        "source_hash": task.compiled.program.source_hash,
    }


def statistics_of(module: Module, item: ScheduledTask, passed_ns: int) -> TaskStatistics:
    """Return the statistics of a task, and end the window, which lasted ``passed_ns``; the next one begins."""
    every, window = item.statistics, item.statistics.take_window()
    return TaskStatistics(
        task=item.name,
        module=module.config.name,
        slot=module.config.slot,
        period_ms=_period_ms(item.task),
        scans=window.scans,
        skipped=window.skipped,
        execution_last_us=every.last_ns / NS_PER_US,
        execution_mean_us=window.mean_ns / NS_PER_US,
        execution_min_us=window.least_ns / NS_PER_US,
        execution_max_us=window.longest_ns / NS_PER_US,
        lateness_mean_us=window.mean_late_ns / NS_PER_US,
        lateness_max_us=window.latest_ns / NS_PER_US,
        load_percent=100.0 * window.total_ns / passed_ns if passed_ns else 0.0,
        scans_total=every.scans,
        skipped_total=every.skipped,
        execution_mean_total_us=every.mean_ns / NS_PER_US,
        execution_min_total_us=every.least_ns / NS_PER_US,
        execution_max_total_us=every.longest_ns / NS_PER_US,
        lateness_mean_total_us=every.mean_late_ns / NS_PER_US,
        lateness_max_total_us=every.latest_ns / NS_PER_US,
    )


def _period_ms(task: Task) -> float:
    return 0.0 if task.compiled.program.event is not None else task.period_ns / NS_PER_MS


def _text(value: Any) -> str:
    return "" if value is None else source_text(value)
