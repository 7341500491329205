"""The time that scans take: ideal ones take none; ``ModeledExecution`` has those that take the manual's time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from automax_ros.runtime.scan.scan_record import ScanRecord, Steps

__all__ = ["IDEAL", "Execution", "IdealExecution", "Place", "ScanJob", "ScanRecord", "Steps"]

Place = Mapping[str, Any]
"""The progress of a job in numbers: ``left_ns`` before its next step, and what it ``skipped``."""


class ScanJob(Protocol):
    """A unit of work for a Processor: a scan of a task, or a burst of a BASIC task.

    ``priority`` is 4 (first) to 11; ``name``, the task's, is the order among equals.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def priority(self) -> int: ...  # noqa: D102

    def whole(self, now_ns: int, skipped: int) -> None:
        """Execute it at one instant and report it; ``skipped`` deadlines were missed before."""

    def steps(self, now_ns: int, skipped: int) -> Steps:
        """Execute it in steps, beginning at an instant."""
        ...

    def done(self, record: ScanRecord | None) -> None:
        """Note that all steps were executed."""


class Execution(Protocol):
    """Executes jobs: at once, as the methods of this class do, or as a Processor has time."""

    def begin(self, job: ScanJob, now_ns: int, skipped: int) -> None:
        """Begin to execute a job, which must not be in progress."""
        job.whole(now_ns, skipped)

    def busy(self, job: ScanJob) -> bool:  # noqa: ARG002
        """Return whether a job that was begun is not done yet."""
        return False

    def drop(self, job: ScanJob) -> None:
        """Abandon a job, at whatever step; nothing is executed by this."""

    def place(self, job: ScanJob) -> Place | None:  # noqa: ARG002
        """Return the progress of a job; None if it is not in progress."""
        return None

    def resume(self, job: ScanJob, place: Place, steps: Steps | None) -> None:  # noqa: ARG002
        """Continue a job from its place, with ``steps`` if it had begun; ValueError if jobs take no time."""
        raise ValueError(f"task {job.name} was in the middle of a scan: the state is that of modeled execution")


class IdealExecution(Execution):
    """A scan takes no time."""

    def drop(self, job: ScanJob) -> None:
        """Do nothing: no job is in progress."""


IDEAL = IdealExecution()
