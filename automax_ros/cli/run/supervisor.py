"""Supervises the processes of a distributed rack: starts them, restarts those that died, ends all cleanly."""

from __future__ import annotations

import queue
import signal
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from automax_ros.cli.run.child_process import Child
from automax_ros.cli.run.process_messages import ProcessMessage, Reported, parse_message
from automax_ros.cli.run.status import Progress
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S

BACKOFFS_NS = (100 * NS_PER_MS, NS_PER_S)
"""Delay before a process is restarted after its first and its second death within ``WINDOW_NS`` (decision)."""
MOST_DEATHS = 3
"""A process that died this many times within ``WINDOW_NS`` is given up: it would die again (decision)."""
WINDOW_NS = 10 * NS_PER_S
"""Time within which deaths are counted together (decision)."""


_POLL_S = 0.05
_MOST_LINES = 1000
"""Lines that wait to be shown; children that write more wait."""
STAGE_NS = 800 * NS_PER_MS
"""Time that the processes of a stage have to end before those of the next are asked to."""
END_NS = 30 * NS_PER_S
"""A process that runs this long after the run was asked to end is killed; the longest ``after_ns`` is added (decision).

A process has to save its state on a busy disk, and may take ``LEAVE_S`` to leave the graph.
"""
GRACE_NS = 2 * NS_PER_S
"""Time that the other processes have to end by themselves after the first one has."""


class Restarts:
    """The deaths of one process; times are ns of any one clock."""

    def __init__(self) -> None:
        """Create the record of a process that has not died."""
        self.count = 0
        self.given_up = False
        self._recent: deque[int] = deque(maxlen=MOST_DEATHS)

    def died(self, now_ns: int) -> int | None:
        """Count a death; return the time of the restart, None if the process is given up."""
        self.count += 1
        self._recent.append(now_ns)
        recent = sum(now_ns - died_ns < WINDOW_NS for died_ns in self._recent)
        self.given_up = recent >= MOST_DEATHS
        return None if self.given_up else now_ns + BACKOFFS_NS[recent - 1]


@dataclass(frozen=True)
class ProcessSpec:
    """A process to keep running.

    Processes of the lowest ``stage`` are ended first, each at the earliest ``after_ns`` after the stage before. All end
    when one with ``ends_run`` has ended; those cannot begin without one that ``begins_run``. A process ``reports`` when
    it ends cleanly; one that does not is never restarted.
    """

    name: str
    command: Sequence[str]
    stage: int = 0
    ends_run: bool = False
    reports: bool = True
    begins_run: bool = False
    after_ns: int = STAGE_NS


@dataclass
class _Supervised:
    """The state of one supervised process.

    ``start_ns`` is when to start it, None where it is not to be started. ``code`` is the exit code of one that has
    ended for good. ``has_begun``: it has sent its progress at least once. ``reported``: it has sent its report.
    """

    post: ProcessSpec
    start_ns: int | None = 0
    child: Child | None = None
    restarts: Restarts = field(default_factory=Restarts)
    has_begun: bool = False
    reported: bool = False
    code: int | None = None


class Supervisor:
    """Runs the processes of one run."""

    def __init__(
        self,
        posts: Sequence[ProcessSpec],
        on_message: Callable[[str, ProcessMessage], None],
        on_stderr: Callable[[str, str], None],
        on_death: Callable[[str, str, float | None], None],
        *,
        restart: bool = True,
    ) -> None:
        """Create a supervisor of processes, which are started in this order by ``run``.

        The functions are called in ``run`` with a process's name: ``on_message`` with its message, ``on_stderr`` with a
        line of its standard error, ``on_death`` with how it died and the seconds until its restart (None: no restart).
        """
        self._places = [_Supervised(post) for post in posts]
        self._on_message, self._on_stderr, self._on_death, self._restart = on_message, on_stderr, on_death, restart
        self._lines: queue.Queue[tuple[Callable[[str], None], str]] = queue.Queue(_MOST_LINES)
        self._stage = -1
        self._stage_ns = self._asked_ns = 0
        self._killed: set[str] = set()

    @property
    def codes(self) -> dict[str, int]:
        """Exit codes of ended processes, by name; less than 0 where a signal ended one."""
        return {place.post.name: place.code for place in self._places if place.code is not None}

    @property
    def deaths(self) -> dict[str, int]:
        """Number of deaths of each process that has died, by name."""
        return {place.post.name: place.restarts.count for place in self._places if place.restarts.count}

    @property
    def pids(self) -> dict[str, int]:
        """Ids of running processes, by name."""
        return {place.post.name: place.child.pid for place in self._places if place.child is not None}

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Start the processes and restart those that die, until all have ended by themselves or ``should_stop``."""
        try:
            while any(place.child is not None or place.start_ns is not None for place in self._places):
                if should_stop():
                    self._end(0)
                self._start_due()
                self._receive()
                for place in self._places:
                    if place.child is not None and place.child.code is not None:
                        self._over(place, place.child)
                self._go_on_ending()
        finally:
            for place in self._places:
                if place.child is not None:
                    place.child.close()

    def _start_due(self) -> None:
        for place in self._places:
            if place.start_ns is not None and place.start_ns <= time.monotonic_ns():
                place.start_ns = None
                actions = partial(self._message, place), partial(self._on_stderr, place.post.name)
                on_line, on_stderr = (partial(self._queue, action) for action in actions)
                place.child = Child(place.post.command, on_line, on_stderr)

    def _queue(self, action: Callable[[str], None], line: str) -> None:
        self._lines.put((action, line))

    def _receive(self) -> None:
        """Handle the lines that wait, or the next one within a short time."""
        try:
            action, line = self._lines.get(timeout=_POLL_S)
            action(line)
            for _ in range(self._lines.qsize()):
                action, line = self._lines.get_nowait()
                action(line)
        except queue.Empty:
            pass

    def _message(self, place: _Supervised, line: str) -> None:
        message = parse_message(line)
        place.has_begun = place.has_begun or isinstance(message, Progress)
        place.reported = place.reported or isinstance(message, Reported)
        self._on_message(place.post.name, message)

    def _over(self, place: _Supervised, child: Child) -> None:
        """Handle the end of a process: record its exit code, restart it, or end the run."""
        while not (child.is_read and self._lines.empty()):
            self._receive()
        code, place.child = child.code, None
        assert code is not None
        child.close()
        in_order = place.reported or not place.post.reports
        # A process that cannot begin at all would not begin at another start: wrong usage, a rack with errors.
        refused = code > 0 and not place.has_begun
        if in_order or self._stage >= 0 or refused:
            # A process that got SIGTERM before it had its handler has ended as it should.
            place.code = 0 if code == -signal.SIGTERM and self._stage >= 0 else code
            keeps_from_beginning = place.post.begins_run and not self._has_begun
            if place.post.ends_run or not in_order or keeps_from_beginning:
                self._end(GRACE_NS if in_order and not keeps_from_beginning else 0)
            return
        again_ns = place.restarts.died(time.monotonic_ns())
        place.start_ns = again_ns if self._restart else None
        again_s = None if place.start_ns is None else max(0, place.start_ns - time.monotonic_ns()) / NS_PER_S
        self._on_death(place.post.name, _how(code), again_s)
        if place.start_ns is None:
            place.code = code
            if place.post.ends_run:
                self._end(0)

    @property
    def _has_begun(self) -> bool:
        return any(place.has_begun for place in self._places if place.post.ends_run)

    def _end(self, grace_ns: int) -> None:
        """Begin to end all processes after ``grace_ns``; a second call does nothing."""
        if self._stage < 0:
            self._stage = 0
            self._asked_ns = time.monotonic_ns() + grace_ns
            for place in self._places:
                place.start_ns = None

    def _go_on_ending(self) -> None:
        """Send SIGTERM to a stage once the one before has ended or taken too long; kill processes that remain."""
        now = time.monotonic_ns()
        if self._stage < 0 or now < self._asked_ns:
            return
        alive = [(place.post, place.child) for place in self._places if place.child is not None]
        rest = [(post, child) for post, child in alive if post.stage >= self._stage]
        stage = min((post.stage for post, _ in rest), default=0)
        due = [(post, child) for post, child in rest if post.stage == stage]
        patience_ns = max((post.after_ns for post, _ in due), default=0)
        if due and (self._stage == 0 or now >= self._stage_ns + patience_ns or len(rest) == len(alive)):
            for _, child in due:
                child.send(signal.SIGTERM)
            self._stage, self._stage_ns = stage + 1, now
        limit_ns = END_NS + max((post.after_ns for post, _ in alive), default=0)
        if now >= self._asked_ns + limit_ns:
            for post, child in alive:
                child.send(signal.SIGKILL)
                if post.name not in self._killed:
                    late = f"{limit_ns / NS_PER_S:g} s after the run was asked to end"
                    self._on_stderr(post.name, f"still runs {late}: it is killed")
                self._killed.add(post.name)


def _how(code: int) -> str:
    """Return the cause of a process's death in words."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
