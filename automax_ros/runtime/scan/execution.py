"""How scans take their time: ideal ones take none; ``processor_time`` has those that take the manual's time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from automax_ros.runtime.scan.scan_record import ScanRecord, Steps

__all__ = ["IDEAL", "Execution", "IdealExecution", "Job", "Place", "ScanRecord", "Steps"]

Place = Mapping[str, Any]
"""How far a job is that is under way, in numbers: ``left_ns`` before its next step, what it ``skipped``."""


class Job(Protocol):
    """What a Processor executes: a scan of a task, or what a BASIC task does from one suspension to the next."""

    @property
    def name(self) -> str:
        """The task's name: the order among equal priorities."""
        ...

    @property
    def priority(self) -> int:
        """4 (first) to 11."""
        ...

    def whole(self, now_ns: int, skipped: int) -> None:
        """Execute it at one instant and tell of it; ``skipped`` deadlines were missed before."""
        ...

    def steps(self, now_ns: int, skipped: int) -> Steps:
        """Execute it in steps, beginning at an instant."""
        ...

    def done(self, record: ScanRecord | None) -> None:
        """Tell that all steps were made."""
        ...


class Execution(Protocol):
    """Executes jobs: at once, or as a Processor has time."""

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Let a job be executed from now on; it must not be under way."""
        ...

    def busy(self, job: Job) -> bool:
        """Return whether a job that was begun is not done yet."""
        ...

    def drop(self, job: Job) -> None:
        """Give a job up, wherever it is; nothing is executed by this."""
        ...

    def place(self, job: Job) -> Place | None:
        """Return how far a job is, None where it is not under way."""
        ...

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:
        """Go on with a job from the place where it was; ``steps`` have come as far, None if it had not begun."""
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
        """Nothing is under way."""

    def place(self, job: Job) -> Place | None:  # noqa: ARG002
        """Return None: nothing is under way."""
        return None

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:  # noqa: ARG002
        """Refuse: nothing takes time.

        Raises:
            ValueError: always.
        """
        raise ValueError(f"task {job.name} was in the middle of a scan: the state is that of modeled execution")


IDEAL = IdealExecution()
