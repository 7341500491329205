"""How scans take their time: ideal ones take none; ``processor_time`` has those that take the manual's time."""

from __future__ import annotations

from collections.abc import Generator
from typing import Protocol

from automax_ros.running.task import ScanRecord

Steps = Generator[int, int | None, ScanRecord | None]
"""A scan in steps: yields the ns of execution before each access to actual memory, and is sent the time it is then.

Sent None, the time is what it was. Returns the record of the scan, if one is kept.
"""


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
        """Give a job up, wherever it is."""
        ...


class Ideal:
    """A scan takes no time."""

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Execute the job at once."""
        job.whole(now_ns, skipped)

    def busy(self, job: Job) -> bool:  # noqa: ARG002
        """Return False: jobs are done when they are begun."""
        return False

    def drop(self, job: Job) -> None:
        """Nothing is under way."""


IDEAL = Ideal()
