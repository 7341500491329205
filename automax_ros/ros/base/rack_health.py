"""The health of a rack as a whole on ``/diagnostics``: ``pm1/rack: PM1``.

In a rack of several processes each other process has its own status instead: ``pm1/processor_3: process``.
"""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus

from automax_ros.core.text import count_of
from automax_ros.rack.operator.halting import is_halted
from automax_ros.ros.base.diagnostics import status_of
from automax_ros.ros.base.node import RackContext
from automax_ros.runtime.tasks.task import Status

OVERRUNS = "overruns"


class RackHealth:
    """Reports the state of one rack, and the problems around it, for the part in this process.

    ERROR while a fault has stopped it; WARN while it is halted, without power or stopped by command, and if scans
    were skipped or something was refused since the last report; else OK.
    """

    def __init__(self, rack_context: RackContext, part: str) -> None:
        self._rack_context, self._part = rack_context, part

    def statuses(self, now_ns: int) -> list[DiagnosticStatus]:
        """Return the rack's status."""
        rack, operations = self._rack_context.rack, self._rack_context.rack.operations
        counts = self._rack_context.health.counts
        skipped = sum(item.skipped for item in rack.statistics.values())
        level, text = self._judge(skipped, sum(counts.values()))
        cause = operations.stopped
        values = {
            "time_s": f"{now_ns / 1e9:.3f}",
            "run_id": str(self._rack_context.stream.run_id),
            "powered": str(operations.powered),
            "halted": str(is_halted(self._rack_context.pacer)),
            "tasks": str(len(rack.tasks)),
            "running": str(sum(task.status is Status.RUNNING for task in rack.tasks)),
            "forced": str(len(rack.forces())),
            "errors": str(sum(task.errors.count for task in rack.tasks)),
            OVERRUNS: str(skipped),
            "stopped_reason": cause.reason if cause is not None else "",
            "stopped_code": (cause.code or "") if cause is not None else "",
            "stopped_by": cause.task if cause is not None else "",
        }
        values |= {kind: str(number) for kind, number in sorted(counts.items())}
        name = f"{rack.config.namespace}/{self._part}"
        return [status_of(name, rack.config.name, level, text, values)]

    def _judge(self, skipped: int, troubles: int) -> tuple[bytes, str]:
        operations, diagnostics = self._rack_context.rack.operations, self._rack_context.diagnostics
        newly_skipped = diagnostics.newly(OVERRUNS, skipped)
        newly_troubled = diagnostics.newly("troubles", troubles)
        cause = operations.stopped
        if cause is not None and cause.is_fault:
            return DiagnosticStatus.ERROR, f"{cause.title}: {cause.reason}"
        if not operations.powered:
            return DiagnosticStatus.WARN, "the power is off"
        if is_halted(self._rack_context.pacer):
            return DiagnosticStatus.WARN, "halted: rack time is frozen"
        if cause is not None:
            return DiagnosticStatus.WARN, f"{cause.title}: {cause.reason}"
        if newly_skipped:
            return DiagnosticStatus.WARN, f"{count_of(newly_skipped, 'scan')} skipped since the last report"
        if newly_troubled:
            kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(self._rack_context.health.counts.items()))
            return DiagnosticStatus.WARN, f"since the start: {kinds}"
        return DiagnosticStatus.OK, "running"
