"""Events: flags that tasks set, or modules raise, and that other tasks wait for (J-3675 p. 6-17)."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Wake = Callable[[int], None]
"""Resumes a waiting task, given the instant in ns."""


class Event:
    """One event. A ``set`` before any task waits is kept until one waits, once (decision).

    ``skipped`` counts the times left out just before the last one because the host was late.
    """

    def __init__(self, name: str) -> None:
        """Create an event that is not set and that no task waits for."""
        self.name = name
        self.pending = False
        self.skipped = 0
        self._waiting: list[Wake] = []

    @property
    def awaited(self) -> bool:
        """Whether a task waits for it."""
        return bool(self._waiting)

    def set(self, now_ns: int, skipped: int = 0) -> None:
        """Resume all waiting tasks, in the order in which they began to wait; without any, keep it for the next."""
        waiting, self._waiting = self._waiting, []
        self.pending, self.skipped = not waiting, skipped
        for wake in waiting:
            wake(now_ns)

    def wait(self, wake: Wake) -> bool:
        """Wait for the event; return True, without waiting, if it was kept, which uses it up."""
        if self.pending:
            self.pending = False
            return True
        self._waiting.append(wake)
        return False

    def forget(self, wake: Wake) -> None:
        """Cancel a wait."""
        if wake in self._waiting:
            self._waiting.remove(wake)


class Events:
    """The events of a rack by name; a name that two tasks declare is one event (decision: across all Processors)."""

    def __init__(self) -> None:
        self._all: dict[str, Event] = {}

    def event(self, name: str) -> Event:
        """Return the event with a name."""
        return self._all.setdefault(name, Event(name))

    def clear(self) -> None:
        """Clear events that were set and that no task has waited for: STOP ALL and power (decision)."""
        for event in self._all.values():
            event.pending = False

    @property
    def pending(self) -> tuple[str, ...]:
        """The sorted names of events that were set and that no task has waited for."""
        return tuple(sorted(name for name, event in self._all.items() if event.pending))

    def load(self, pending: Iterable[str]) -> None:
        """Restore which events are kept."""
        self.clear()
        for name in pending:
            self.event(name).pending = True
