"""Events: flags that tasks set, or modules raise, and that other tasks wait for (J-3675 p. 6-17)."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Wake = Callable[[int], None]
"""Goes on with what has waited, given the instant in ns."""


class Event:
    """One event. A ``set`` before anybody waits is kept until one waits, once (decision).

    ``skipped`` is how often it would have been set just before the last time, had the host not been late.
    """

    def __init__(self, name: str) -> None:
        """Begin with an event that nobody has set and nobody waits for."""
        self.name = name
        self.pending = False
        self.skipped = 0
        self._waiting: list[Wake] = []

    @property
    def awaited(self) -> bool:
        """Whether anybody waits for it."""
        return bool(self._waiting)

    def set(self, now_ns: int, skipped: int = 0) -> None:
        """Let all who wait go on, in the order in which they began to wait; without any, keep it for the next."""
        waiting, self._waiting = self._waiting, []
        self.pending, self.skipped = not waiting, skipped
        for wake in waiting:
            wake(now_ns)

    def wait(self, wake: Wake) -> bool:
        """Wait for the event; return True, with nothing to wait for, if a kept one is used up by this."""
        if self.pending:
            self.pending = False
            return True
        self._waiting.append(wake)
        return False

    def forget(self, wake: Wake) -> None:
        """Wait no longer."""
        if wake in self._waiting:
            self._waiting.remove(wake)


class Events:
    """The events of a rack by name; a name that two tasks declare is one event (decision: across all Processors)."""

    def __init__(self) -> None:
        """Begin with none."""
        self._all: dict[str, Event] = {}

    def event(self, name: str) -> Event:
        """Return the event of a name."""
        return self._all.setdefault(name, Event(name))

    def clear(self) -> None:
        """Forget what was set and nobody has waited for: STOP ALL and power (decision)."""
        for event in self._all.values():
            event.pending = False

    @property
    def pending(self) -> tuple[str, ...]:
        """The names of events that were set and that nobody has waited for, in order."""
        return tuple(sorted(name for name, event in self._all.items() if event.pending))

    def load(self, pending: Iterable[str]) -> None:
        """Take over which events are kept."""
        self.clear()
        for name in pending:
            self.event(name).pending = True
