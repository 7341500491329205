"""The time that scans take: ideal ones take none; ``processor_time`` has those that take the manual's time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from automax_ros.runtime.scan.scan_record import ScanRecord, Steps

__all__ = ["IDEAL", "Execution", "IdealExecution", "Job", "Place", "ScanRecord", "Steps"]

Place = Mapping[str, Any]
"""The progress of a job in numbers: ``left_ns`` before its next step, and what it ``skipped``."""


class Job(Protocol):
    """A unit of work for a Processor: a scan of a task, or what a BASIC task does from one suspension to the next."""

    @property
    def name(self) -> str:
        """The task's name: the order among equal priorities."""
        ...

    @property
    def priority(self) -> int:
        """4 (first) to 11."""
        ...

    def whole(self, now_ns: int, skipped: int) -> None:
        """Execute it at one instant and report it; ``skipped`` deadlines were missed before."""
        ...

    def steps(self, now_ns: int, skipped: int) -> Steps:
        """Execute it in steps, beginning at an instant."""
        ...

    def done(self, record: ScanRecord | None) -> None:
        """Note that all steps were executed."""
        ...


class Execution(Protocol):
    """Executes jobs: at once, or as a Processor has time."""

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Begin to execute a job, which must not be in progress."""
        ...

    def busy(self, job: Job) -> bool:
        """Return whether a job that was begun is not done yet."""
        ...

    def drop(self, job: Job) -> None:
        """Abandon a job, at whatever step; nothing is executed by this."""
        ...

    def place(self, job: Job) -> Place | None:
        """Return the progress of a job; None if it is not in progress."""
        ...

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:
        """Continue a job from its place; ``steps`` are at this place, None if it had not begun."""
        ...


class IdealExecution:
    """A scan takes no time."""

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Execute the job at once."""
        job.whole(now_ns, skipped)

    def busy(self, job: Job) -> bool:  # noqa: ARG002
        """Return False: jobs are done when they are begun."""
        return False

    def drop(self, job: Job) -> None:
        """Do nothing: no job is in progress."""

    def place(self, job: Job) -> Place | None:  # noqa: ARG002
        """Return None: no job is in progress."""
        return None

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:  # noqa: ARG002
        """Refuse: no job takes time.

        Raises:
            ValueError: always.
        """
        raise ValueError(f"task {job.name} was in the middle of a scan: the state is that of modeled execution")


IDEAL = IdealExecution()
