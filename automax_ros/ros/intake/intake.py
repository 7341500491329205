"""Receives all messages and requests of a rack in one thread, a bounded number at a time.

They wait in DDS, as many of each topic or service as its quality of service keeps; older ones are dropped there. The
thread is woken by counters that DDS's own threads increment (no Python runs for a message that only waits), takes at
most ``MOST_A_ROUND`` in turn, gives way to scans (``RackLock``), and rests a millisecond. A separate thread takes them,
not callbacks of an executor or polling between scans (decision: EventsExecutor queues an event for each
message without bound; a message of 10 MB holds up the thread that takes it for 10 to 70 ms; a look at a topic costs
1.5 us, half a core with 300 topics each millisecond). All measured on two cores of a virtual machine (docs/ros.md).
"""

from __future__ import annotations

import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.impl.implementation_singleton import rclpy_implementation

from automax_ros.ros.intake.rcl import library

MOST_A_ROUND = 16
"""Most messages and requests that are taken per round, in total."""
MOST_OF_ONE = 4
"""Most messages and requests of one topic or service that are taken per round."""
MOST_ROUNDS_FIRST = 16
"""Most rounds of other entrances before the last one is read (decision: a flood does not hold it up for long)."""
REST_S = 0.001
"""Seconds of rest after a round: at most 16,000 messages are taken per second (decision), without those of shares."""
_GROUPS = 64
"""Number of counters; more topics and services share them (a process has 1024 descriptors or so)."""
_PATIENCE_S = 0.2
_LOOK_S = 0.002
"""Seconds between two polls where nothing wakes the thread."""

InvalidHandle: type[Exception] = rclpy_implementation.InvalidHandle


class Entrance(Protocol):
    """A subscription or service that ``MessageIntake`` reads."""

    name: str
    handle: Any
    """The handle of rclpy's subscription or service."""

    def take(self) -> bool:
        """Take one message and process it; return False if there is none.

        Raises:
            InvalidHandle: it was destroyed.
        """

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Set the C function that rcl calls for each arrival (None for none); return rcl's result."""


class MessageIntake:
    """Takes messages and requests from its entrances, on a separate thread between ``open`` and ``close``."""

    def __init__(self, report: Callable[[str, Exception], None]) -> None:
        self._report = report
        self._lock = threading.Lock()
        self._entrances: list[Entrance] = []
        self._groups: list[_Group] = []
        self._thread: threading.Thread | None = None
        self._closing = False
        self._last: Entrance | None = None
        self._shares: dict[Entrance, int] = {}
        self._poll = select.epoll() if library() is not None else None

    def add(self, entrance: Entrance, *, last: bool = False, share: int = 0) -> None:
        """Register an entrance. The one registered with ``last=True`` is read after all others.

        ``share``: most of its messages per round, if it has its own limit and no part of the common one.
        """
        with self._lock:
            if share:
                self._shares[entrance] = share
            self._last = entrance if last else self._last
            place = len(self._entrances)
            self._entrances.append(entrance)
            if self._poll is None:
                return
            if len(self._groups) < _GROUPS:
                self._groups.append(_Group())
                self._poll.register(self._groups[-1].counter, select.EPOLLIN)
            group = self._groups[place % _GROUPS]
            group.entrances.append(entrance)
            group.watch(entrance)

    def open(self) -> None:
        """Start the thread; a second call does nothing."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="intake", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """End the thread, after the message that is being processed."""
        self._closing = True
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def close(self) -> None:
        """Release the counters, once the nodes have left the graph: DDS increments them as long as it has readers."""
        self.stop()
        with self._lock:
            for group in self._groups:
                group.close()
            self._groups.clear()
            self._entrances.clear()
            self._shares.clear()
            if self._poll is not None:
                self._poll.close()
                self._poll = None

    def _run(self) -> None:
        ready: deque[Entrance] = deque()
        last, rounds = False, 0
        while not self._closing:
            for entrance in self._woken(_PATIENCE_S if not (ready or last) else 0.0):
                if entrance is self._last:
                    last = True
                elif entrance not in ready:
                    ready.append(entrance)
            if ready:
                self._round(ready)
                rounds += 1
                time.sleep(REST_S)
            if last and self._last is not None and (not ready or rounds >= MOST_ROUNDS_FIRST):
                last, rounds = self._some(self._last, 1)[1], 0

    def _woken(self, patience_s: float) -> list[Entrance]:
        if self._poll is None:
            time.sleep(_LOOK_S)
            with self._lock:
                return list(self._entrances)
        rung = {counter for counter, _ in self._poll.poll(patience_s)}
        if not rung:
            return []
        with self._lock:
            groups = [group for group in self._groups if group.counter in rung]
            return [entrance for group in groups for entrance in group.rung()]

    def _round(self, ready: deque[Entrance]) -> None:
        room = MOST_A_ROUND
        for _ in range(len(ready)):
            if not room or self._closing:
                return
            entrance = ready.popleft()
            share = self._shares.get(entrance, 0)
            taken, more = self._some(entrance, share or min(room, MOST_OF_ONE))
            room -= 0 if share else taken
            if more:
                ready.append(entrance)

    def _some(self, entrance: Entrance, most: int) -> tuple[int, bool]:
        """Take at most this many; return how many were taken, and whether there may be more."""
        for taken in range(most):
            try:
                if not entrance.take():
                    return taken, False
            except InvalidHandle:
                self._remove(entrance)
                return taken, False
            except Exception as error:
                self._report(f"{entrance.name}: dropped", error)
        return most, True

    def _remove(self, entrance: Entrance) -> None:
        with self._lock:
            for group in self._groups:
                if entrance in group.entrances:
                    group.entrances.remove(entrance)
            if entrance in self._entrances:
                self._entrances.remove(entrance)
            self._shares.pop(entrance, None)


class _Group:
    """Entrances that share one counter."""

    def __init__(self) -> None:
        self.counter = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.entrances: list[Entrance] = []

    def watch(self, entrance: Entrance) -> None:
        """Count the arrivals of an entrance.

        Raises:
            RuntimeError: the middleware refuses.
        """
        rcl = library()
        assert rcl is not None
        with entrance.handle:
            result = entrance.wake(entrance.handle.pointer, rcl.count_in, self.counter)
        if result:
            rcl.reset_error()
            raise RuntimeError(f"{entrance.name} cannot be watched: rcl returns {result}")

    def rung(self) -> list[Entrance]:
        try:
            os.eventfd_read(self.counter)
        except BlockingIOError:
            return []
        return list(self.entrances)

    def close(self) -> None:
        rcl = library()
        assert rcl is not None
        for entrance in self.entrances:
            try:
                with entrance.handle:
                    entrance.wake(entrance.handle.pointer, None, None)
                    rcl.reset_error()
            except InvalidHandle:
                continue  # destroyed: it does not count any more
        os.close(self.counter)
