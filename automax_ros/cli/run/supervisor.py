"""Keeps the processes of a distributed rack running: starts them, starts again what died, ends all in order."""

from __future__ import annotations

import selectors
import signal
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from automax_ros.cli.run.child_process import Child, Lines
from automax_ros.cli.run.process_messages import ProcessMessage, Reported, heard
from automax_ros.cli.run.status import Progress
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S

BACKOFFS_NS = (100 * NS_PER_MS, NS_PER_S)
"""How long after its death a process is started again: the first one in ``WINDOW_NS``, the second (decision)."""
MOST_DEATHS = 3
"""This many deaths within ``WINDOW_NS`` and a process is given up: it would die again (decision)."""
WINDOW_NS = 10 * NS_PER_S
"""The time in which deaths count together (decision)."""


class Restarts:
    """The deaths of one process; times are ns of any one clock.

    Attributes:
        count: how many there were.
        given_up: whether it is not started again.
    """

    def __init__(self) -> None:
        """Begin with a process that has never died."""
        self.count = 0
        self.given_up = False
        self._recent: deque[int] = deque(maxlen=MOST_DEATHS)

    def died(self, now_ns: int) -> int | None:
        """Count a death; return when to start the process again, None where it is given up."""
        self.count += 1
        self._recent.append(now_ns)
        recent = sum(now_ns - died_ns < WINDOW_NS for died_ns in self._recent)
        self.given_up = recent >= MOST_DEATHS
        return None if self.given_up else now_ns + BACKOFFS_NS[recent - 1]


_LOOK_S = 0.05
STAGE_NS = 800 * NS_PER_MS
"""How long those who end first may take before the next are asked to, so that all have ended within 2 s."""
END_NS = 10 * NS_PER_S
"""Who has not ended so long after it was asked to is killed."""
GRACE_NS = 2 * NS_PER_S
"""How long the others may take to reach the end that the first process has reached by itself."""


@dataclass(frozen=True)
class ProcessSpec:
    """A process to keep running.

    Attributes:
        name: what it is called.
        command: starts it.
        stage: those of the lowest stage end first; all others end when one of ``ends_run`` has.
        ends_run: whether the run ends with it.
        reports: whether it tells a report when it ends in order; without one it is never started again.
        begins_run: whether the run, which ``ends_run`` tells of, cannot begin without it.
    """

    name: str
    command: Sequence[str]
    stage: int = 0
    ends_run: bool = False
    reports: bool = True
    begins_run: bool = False


class Listener(Protocol):
    """Who is told what processes say and how they fare."""

    def heard(self, name: str, told: ProcessMessage) -> None:
        """A process has said something."""
        ...

    def complained(self, name: str, line: str) -> None:
        """A process has written a line on standard error."""
        ...

    def died(self, name: str, how: str, again_s: float | None) -> None:
        """A process has died; it is started again after a time (s), or not."""
        ...


@dataclass
class _Supervised:
    """A post and who holds it.

    ``start_ns`` is when it is to be started, None where it is not. ``code`` is the exit code of one that is over.
    ``has_begun``: it has told how it stands, once. ``reported``: it ends in order.
    """

    post: ProcessSpec
    start_ns: int | None = 0
    child: Child | None = None
    restarts: Restarts = field(default_factory=Restarts)
    has_begun: bool = False
    reported: bool = False
    code: int | None = None


class Supervisor:
    """The processes of one run."""

    def __init__(
        self,
        posts: Sequence[ProcessSpec],
        listener: Listener,
        *,
        restart: bool = True,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Take what to keep running, first things first; nothing is started yet."""
        self._places = [_Supervised(post) for post in posts]
        self._listener, self._restart, self._clock = listener, restart, clock
        self._selector = selectors.DefaultSelector()
        self._stage = -1
        self._stage_ns = self._asked_ns = 0

    @property
    def codes(self) -> dict[str, int]:
        """The exit codes of processes that are over, by name: less than 0 where a signal has ended one."""
        return {place.post.name: place.code for place in self._places if place.code is not None}

    @property
    def deaths(self) -> dict[str, int]:
        """How often processes have died, by name."""
        return {place.post.name: place.restarts.count for place in self._places if place.restarts.count}

    @property
    def pids(self) -> dict[str, int]:
        """The ids of processes that live, by name."""
        return {place.post.name: place.child.pid for place in self._places if place.child is not None}

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Keep them running until all have ended, by themselves or asked to."""
        try:
            while any(place.child is not None or place.start_ns is not None for place in self._places):
                if should_stop():
                    self._end(0)
                self._start_due()
                self._listen()
                for place in self._places:
                    if place.child is not None and place.child.code is not None:
                        self._over(place, place.child)
                self._go_on_ending()
        finally:
            for place in self._places:
                if place.child is not None:
                    place.child.close()
            self._selector.close()

    def _start_due(self) -> None:
        for place in self._places:
            if place.start_ns is not None and place.start_ns <= self._clock():
                place.start_ns = None
                name = place.post.name
                child = Child(place.post.command, partial(self._hear, place), partial(self._listener.complained, name))
                place.child = child
                for stream in (child.out, child.err):
                    self._selector.register(stream, selectors.EVENT_READ)

    def _listen(self) -> None:
        for key, _ in self._selector.select(_LOOK_S):
            assert isinstance(key.fileobj, Lines)
            if not key.fileobj.read():
                self._selector.unregister(key.fileobj)

    def _hear(self, place: _Supervised, line: str) -> None:
        told = heard(line)
        place.has_begun = place.has_begun or isinstance(told, Progress)
        place.reported = place.reported or isinstance(told, Reported)
        self._listener.heard(place.post.name, told)

    def _over(self, place: _Supervised, child: Child) -> None:
        """Take leave of a process that has ended: in order, or not."""
        for stream in (child.out, child.err):
            while stream in self._selector.get_map() and stream.read():
                pass
            if stream in self._selector.get_map():
                self._selector.unregister(stream)
        code, place.child = child.code, None
        assert code is not None
        child.close()
        in_order = place.reported or not place.post.reports
        # What cannot begin at all is not helped by another start: wrong usage, a rack with errors.
        refused = code > 0 and not place.has_begun
        if in_order or self._stage >= 0 or refused:
            # Who was asked to end before it could heed a signal has ended as it should.
            place.code = 0 if code == -signal.SIGTERM and self._stage >= 0 else code
            keeps_from_beginning = place.post.begins_run and not self._has_begun
            if place.post.ends_run or not in_order or keeps_from_beginning:
                self._end(GRACE_NS if in_order and not keeps_from_beginning else 0)
            return
        again_ns = place.restarts.died(self._clock())
        place.start_ns = again_ns if self._restart else None
        again_s = None if place.start_ns is None else max(0, place.start_ns - self._clock()) / NS_PER_S
        self._listener.died(place.post.name, _how(code), again_s)
        if place.start_ns is None:
            place.code = code
            if place.post.ends_run:
                self._end(0)

    @property
    def _has_begun(self) -> bool:
        return any(place.has_begun for place in self._places if place.post.ends_run)

    def _end(self, grace_ns: int) -> None:
        """Begin to end all, after a grace; a second time this does nothing."""
        if self._stage < 0:
            self._stage = 0
            self._asked_ns = self._stage_ns = self._clock() + grace_ns
            for place in self._places:
                place.start_ns = None

    def _go_on_ending(self) -> None:
        """Ask those of a stage to end once those before have, or have taken too long; kill who does not at all."""
        now = self._clock()
        if self._stage < 0 or now < self._asked_ns:
            return
        alive = [(place.post.stage, place.child) for place in self._places if place.child is not None]
        rest = [stage for stage, _ in alive if stage >= self._stage]
        if rest and (now >= self._stage_ns or len(rest) == len(alive)):
            for stage, child in alive:
                if stage == min(rest):
                    child.send(signal.SIGTERM)
            self._stage, self._stage_ns = min(rest) + 1, now + STAGE_NS
        if now >= self._asked_ns + END_NS:
            for _, child in alive:
                child.send(signal.SIGKILL)


def _how(code: int) -> str:
    """Return in words how a process has died."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
