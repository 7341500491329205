"""The time of one Processor: its jobs take the manual's execution times, and higher priorities pre-empt lower ones."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.running.execution import Job, Steps
from automax_ros.running.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler


@dataclass
class _Frame:
    """A job under way: ``remaining_ns`` of execution before its next step; ``steps`` None before its first."""

    job: Job
    skipped: int
    steps: Steps | None = None
    remaining_ns: int = 0


class ProcessorTime:
    """Executes jobs one at a time: the highest priority first, equals in alphabetical order.

    A job of higher priority suspends a lower one, which goes on after it (PC3000 manual p. 15-2). Equals do not suspend
    each other (decision: no source tells of time-slicing).
    """

    def __init__(self, scheduler: Scheduler, name: str) -> None:
        """Take the scheduler; ``name`` orders Processors at one instant."""
        self._scheduler = scheduler
        self._key = EventKey(EventClass.EXECUTE, 0, name)
        self._frames: list[_Frame] = []
        self._event: ScheduledEvent | None = None
        self._stepping: _Frame | None = None
        self._since_ns = 0
        self._going = False

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Let a job be executed as soon as nothing goes before it."""
        self._book(now_ns)
        frames = self._frames
        place = 0
        while place < len(frames) and not _goes_before(job, frames[place]):
            place += 1
        frames.insert(place, _Frame(job, skipped))
        self._go(now_ns)

    def busy(self, job: Job) -> bool:
        """Return whether a job that was begun is not done yet."""
        return any(frame.job is job for frame in self._frames)

    def drop(self, job: Job) -> None:
        """Give a job up; what it has written so far stays written."""
        self._book(self._scheduler.now_ns)
        dropped = [frame for frame in self._frames if frame.job is job]
        self._frames = [frame for frame in self._frames if frame.job is not job]
        for frame in dropped:
            if frame.steps is not None and frame is not self._stepping:
                frame.steps.close()
        self._go(self._scheduler.now_ns)

    def _book(self, now_ns: int) -> None:
        """Suspend the job that is executed: it has used the time up to now."""
        if self._event is not None:
            self._event.cancel()
            self._event = None
            self._frames[0].remaining_ns -= now_ns - self._since_ns

    def _go(self, now_ns: int) -> None:
        """Execute what is first, until it takes time that something else comes into."""
        if self._going:
            return
        self._going = True
        try:
            while self._frames:
                frame = self._frames[0]
                if frame.remaining_ns:
                    end_ns = now_ns + frame.remaining_ns
                    if not self._scheduler.advance_to(end_ns, self._key):
                        self._since_ns = now_ns
                        self._event = self._scheduler.at(end_ns, self._key, self._goes_on)
                        return
                    now_ns, frame.remaining_ns = end_ns, 0
                self._step(frame, now_ns)
        finally:
            self._going = False

    def _goes_on(self, now_ns: int) -> None:
        self._event = None
        self._frames[0].remaining_ns = 0
        self._go(now_ns)

    def _step(self, frame: _Frame, now_ns: int) -> None:
        self._stepping = frame
        try:
            if frame.steps is None:
                frame.steps = frame.job.steps(now_ns, frame.skipped)
                frame.remaining_ns = next(frame.steps)
            else:
                frame.remaining_ns = frame.steps.send(now_ns)
        except StopIteration as end:
            self._stepping = None
            if frame in self._frames:
                self._frames.remove(frame)
                frame.job.done(end.value)


def _goes_before(job: Job, frame: _Frame) -> bool:
    """Return whether a new job is executed before one that is under way or waits."""
    if job.priority != frame.job.priority:
        return job.priority < frame.job.priority
    return frame.steps is None and job.name < frame.job.name
