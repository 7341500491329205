"""The time of one Processor: its jobs take the manual's execution times, and higher priorities pre-empt lower ones."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

from automax_ros.runtime.scan.execution import Job, Place, Steps
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler


@dataclass(eq=False)
class _Frame:
    """A job in progress: ``remaining_ns`` of execution before its next step; ``steps`` is None before its first."""

    job: Job
    skipped: int
    steps: Steps | None = None
    remaining_ns: int = 0
    dropped: bool = False


class ModeledExecution:
    """Executes jobs one at a time: the highest priority first, equals in alphabetical order.

    A job of higher priority suspends a lower one, which continues after it (PC3000 manual p. 15-2). Equals do not
    suspend each other (decision: no source mentions time-slicing).
    """

    def __init__(self, scheduler: Scheduler, name: str) -> None:
        """Store the scheduler; ``name`` orders Processors at one instant."""
        self._scheduler = scheduler
        self._key = EventKey(EventClass.EXECUTE, 0, name)
        self._frames: list[_Frame] = []
        self._event: ScheduledEvent | None = None
        self._spare: ScheduledEvent | None = None
        self._since_ns = 0
        self._going = False

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Execute a job as soon as no other precedes it."""
        frame = _Frame(job, skipped)
        place = self._place_of(frame) if self._frames else 0
        if place:
            self._frames.insert(place, frame)
            return
        self._book(now_ns)
        self._frames.insert(0, frame)
        if not self._going:
            self._go(now_ns)

    def busy(self, job: Job) -> bool:
        """Return whether a job that was begun is not done yet."""
        return bool(self._frames) and self._frame(job) is not None

    def drop(self, job: Job) -> None:
        """Abandon a job; what it has written so far stays written. Nothing is executed by this."""
        frame = self._frame(job)
        if frame is None:
            return
        now_ns = self._scheduler.now_ns
        self._book(now_ns)
        self._frames.remove(frame)
        self._wait(now_ns)
        frame.dropped = True
        if frame.steps is not None:
            # ValueError: the job abandons itself, in the middle of a step.
            with contextlib.suppress(ValueError):
                frame.steps.close()

    def place(self, job: Job) -> Place | None:
        """Return the progress of a job; None if it is not in progress."""
        frame = self._frame(job)
        if frame is None:
            return None
        used_ns = self._scheduler.now_ns - self._since_ns if self._event is not None and frame is self._frames[0] else 0
        return {"left_ns": frame.remaining_ns - used_ns, "skipped": frame.skipped}

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:
        """Continue a job from its place; ``steps`` are at this place, None if it had not begun."""
        now_ns = self._scheduler.now_ns
        self._book(now_ns)
        frame = _Frame(job, place["skipped"], steps, place["left_ns"])
        self._frames.insert(self._place_of(frame), frame)
        self._wait(now_ns)

    def _frame(self, job: Job) -> _Frame | None:
        for frame in self._frames:
            if frame.job is job:
                return frame
        return None

    def _place_of(self, frame: _Frame) -> int:
        order, place = _order(frame), 0
        while place < len(self._frames) and _order(self._frames[place]) <= order:
            place += 1
        return place

    def _book(self, now_ns: int) -> None:  # the job that is being executed has used the time up to now
        if self._event is not None:
            self._event.cancel()
            self._event = None
            self._frames[0].remaining_ns -= now_ns - self._since_ns

    def _go(self, now_ns: int) -> None:
        """Execute the first job, until it takes time in which another event is due."""
        frames, advance_to, key = self._frames, self._scheduler.advance_to, self._key
        self._going = True
        try:
            while frames:
                frame = frames[0]
                left_ns = frame.remaining_ns
                if left_ns:
                    if not advance_to(now_ns + left_ns, key):
                        break
                    now_ns += left_ns
                steps = frame.steps
                try:
                    if steps is None:
                        steps = frame.steps = frame.job.steps(now_ns, frame.skipped)
                        frame.remaining_ns = next(steps)
                    else:
                        frame.remaining_ns = steps.send(now_ns)
                except StopIteration as end:
                    if not frame.dropped:
                        frames.remove(frame)
                        frame.job.done(end.value)
                else:
                    if frame.dropped:
                        steps.close()
        finally:
            self._going = False
            if frames:
                self._wait(now_ns)

    def _wait(self, now_ns: int) -> None:
        if self._frames and not self._going:
            self._since_ns = now_ns
            event = self._spare
            self._spare = None
            if event is None:
                event = ScheduledEvent(self._key, self._continue)
            self._event = self._scheduler.post(now_ns + self._frames[0].remaining_ns, event)

    def _continue(self, now_ns: int, _: int) -> None:
        self._spare = self._event
        self._event = None
        self._frames[0].remaining_ns = 0
        self._go(now_ns)


def _order(frame: _Frame) -> tuple[int, bool, str]:
    return frame.job.priority, frame.steps is None, frame.job.name
