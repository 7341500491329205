"""The nodes ``processor_SLOT`` and ``udc_SLOT``: a Processor or UDC module with its tasks.

Publishes: ``/RACK/scans`` (automax_msgs/Scan) and ``/RACK/states`` (automax_msgs/TaskState) of its tasks, with a state
and a full Scan of each for late joiners; its part of ``/diagnostics``: a status of the module and one of each task.

Parameters: ``TASK.NAME`` for each tunable of a task, with limits and step in the descriptor; setting one tunes the
task.

Its tasks' run-time errors and PRINT lines go to /rosout. It is a managed node (``ros/base/module_lifecycle``).

For a UDC, ``/diagnostics`` also shows the common clock, the next scan, and the scans per interrupt.
"""

from __future__ import annotations

from functools import partial

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.modules.module import Module
from automax_ros.rack.operator.faults import displays_of
from automax_ros.rackfile.modules.udc import ISCR, SCAN_COUNTER, SCANS_PER_INTERRUPT
from automax_ros.ros.base.diagnostics import worst
from automax_ros.ros.base.module_lifecycle import ManagedModuleNode
from automax_ros.ros.base.node import RackContext
from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.nodes.tunables import TunableParameters
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.scan.error_log import LogEntry
from automax_ros.runtime.tasks.task import ScanRecord, Status, Task

ERROR_INTERVAL_S = 1.0
"""A STOP ALL, and a task's run-time errors, are logged at most this often."""
ERRORS_SHOWN = 5
"""Most errors of one scan that are logged."""


_SHOWN = {"iscr": ISCR, "scans_per_interrupt": SCANS_PER_INTERRUPT, "scans_since_interrupt": SCAN_COUNTER}


class ProcessorNode(ManagedModuleNode):
    """Node of one Processor; the scheduler of the rack scans its tasks."""

    def __init__(self, rack_context: RackContext, processor: Module) -> None:
        super().__init__(rack_context, processor)
        rack, stream = rack_context.rack, rack_context.stream
        self._rack, self._module = rack, processor.config
        self._slot, self._tasks = processor.config.slot, [item.task for item in processor.tasks]
        outlets = {
            topic: self.outlet(topic, partial(stream.send_states, self._slot))
            for topic in stream.module_topics
            if topic.slot == self._slot
        }
        self.tunables = TunableParameters(self, rack, rack_context.between_scans)
        self.tunables.declare(self._tasks)
        self._stop_throttle = Throttle(ERROR_INTERVAL_S)
        self._error_throttles = {task.name: Throttle(ERROR_INTERVAL_S) for task in self._tasks}
        stream.add_sink(outlets.get)
        rack.observe(self)
        self.diagnose(self._health)

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Report errors and printed lines of the Processor's own tasks."""
        if task.slot != self._slot:
            return
        if record.errors:
            self._report_errors(task, record)
        while task.printed:
            self.get_logger().info(f"{task.name}: {task.printed.popleft()}")

    def _report_errors(self, task: Task, record: ScanRecord) -> None:
        is_logged = self._error_throttles[task.name].passes()
        for number, (line, code) in enumerate(record.errors):
            describe = partial(_describe, task, LogEntry(line, code, record.scan))
            self.rack_context.health.note("run-time error", (task.name, line, code), describe)
            if is_logged and number < ERRORS_SHOWN:
                self.get_logger().warning(describe())

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes from outside."""

    def tuned(self, task: Task, now_ns: int) -> None:  # noqa: ARG002
        """Update the parameters after a task was tuned by other means."""
        if task.slot == self._slot:
            self.tunables.follow(task)

    def operated(self, operation: Operation) -> None:
        """Log a STOP ALL; update parameters and lifecycle state after operations on the tasks."""
        if operation.what == "stop_all" and operation.ok and self._stop_throttle.passes():
            self.get_logger().error(f"STOP ALL: {operation.reason}")
        concerned = [task for task in self._tasks if operation.concerns(task.name)]
        if operation.ok and operation.what in ("reload", "power_on"):
            self.tunables.declare(concerned)
        self.follow_operation(operation)

    def _health(self, now_ns: int) -> list[DiagnosticStatus]:
        tasks = [self._status(task, now_ns) for task in self._tasks]
        return [self._module_status(tasks), *tasks]

    def _module_status(self, tasks: list[DiagnosticStatus]) -> DiagnosticStatus:
        config, statistics = self._module, [self._rack.statistics[task.name] for task in self._tasks]
        level, running = worst(tasks), sum(task.status is Status.RUNNING for task in self._tasks)
        values = {
            "tick_ms": f"{config.tick_ns / NS_PER_MS:g}",
            "tasks": str(len(self._tasks)),
            "running": str(running),
            "skipped": str(sum(item.skipped for item in statistics)),
            "errors": str(sum(task.errors.count for task in self._tasks)),
        }
        for shown in displays_of(self._rack):
            if shown.module == config.name:
                values |= {"display": shown.code, "display_meaning": shown.meaning}
        text = f"{running} of {count_of(len(self._tasks), 'task')} run"
        if level != DiagnosticStatus.OK:
            item = next(item for item in tasks if item.level == level)
            text = f"{item.name.rpartition(': ')[2]}: {item.message}"
        return self.status(config.model, level, text, config.slot, values)

    def _status(self, task: Task, now_ns: int) -> DiagnosticStatus:
        """Return a task's health: ERROR if faulted, WARN if stopped, with errors or newly late, else OK (REP-107).

        A BASIC task that has reached its END has done its work: OK (decision).
        """
        statistics = self._rack.statistics[task.name]
        newly_skipped = self.rack_context.diagnostics.newly(task.name, statistics.skipped)
        cause = self._rack.operations.stopped
        level, text = DiagnosticStatus.OK, task.status.value
        if task.status is Status.FAULTED:
            level, text = DiagnosticStatus.ERROR, self._rack.stop_reason or text
        elif task.is_done and cause is None:
            text = "done"
        elif task.status is not Status.RUNNING:
            level = DiagnosticStatus.WARN
            text = f"{text}: {cause.title}" if cause is not None else text
        elif newly_skipped:
            level, text = DiagnosticStatus.WARN, f"AMX7042 deadlines missed since the last report: {newly_skipped}"
        elif task.errors.last is not None:
            level, text = DiagnosticStatus.WARN, task.errors.last.describe()
        values = {
            "period_ms": task.period_ns / NS_PER_MS,
            "priority": task.priority,
            "scans": statistics.scans,
            "skipped": statistics.skipped,
            "errors": task.errors.count,
            "load_percent": 100.0 * statistics.total_ns / now_ns if now_ns else 0.0,
            "mean_us": statistics.mean_ns / 1000,
            "longest_us": statistics.longest_ns / 1000,
            "late_mean_us": statistics.mean_late_ns / 1000,
            "late_longest_us": statistics.latest_ns / 1000,
        }
        shown = {key: f"{value:g}" for key, value in values.items()}
        if cause is not None:
            shown |= {"stopped_code": cause.code or "", "stopped_by": cause.task, "stopped_reason": cause.reason}
        return self.status(task.name, level, text, task.slot, shown)


def _describe(task: Task, entry: LogEntry) -> str:
    return f"{task.name}: {entry.describe()}"


class UdcNode(ProcessorNode):
    """Node of one UDC."""

    def __init__(self, rack_context: RackContext, udc: Module) -> None:
        self._udc = udc
        super().__init__(rack_context, udc)

    def _module_status(self, tasks: list[DiagnosticStatus]) -> DiagnosticStatus:
        """Return the health of the module itself: also WARN while its tasks wait for the common clock."""
        config, rack = self._udc.config, self.rack_context.rack
        bank = rack.backplane.bank(config.slot)
        assert bank is not None
        status = super()._module_status(tasks)
        for name, register in _SHOWN.items():
            status.values.append(KeyValue(key=name, value=str(rack.memory.read_now(bank.view, register))))
        if rack.clock_since_ns is None and status.level == DiagnosticStatus.OK:
            status.level, status.message = DiagnosticStatus.WARN, "tasks wait at SCAN_LOOP for the common clock"
        return status
