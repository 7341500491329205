"""What `automax run` does about values that outlive a run: they come back at the start and are saved as it goes."""

from __future__ import annotations

from pathlib import Path

from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.rack.rack import Rack
from automax_ros.rack.retention import Retention, RetentionFault

SAVE_PERIOD_NS = 5 * NS_PER_S
"""How often a changed state is saved while the rack runs, so that a killed run loses little (decision)."""


class StateKeeping:
    """Keeps a rack's state in a folder, or nowhere if that is None."""

    def __init__(self, rack: Rack, folder: Path | None) -> None:
        """Bring back what a folder holds, before the rack's nodes are made: their parameters begin with it.

        Raises:
            RetentionFault: the folder cannot be read or holds something else.
        """
        self.failed = False
        self.settings: tuple[tuple[str, Value], ...] = ()
        self._retention = Retention(rack, folder) if folder is not None else None
        self._news: list[str] = []
        self._next_ns = SAVE_PERIOD_NS
        if self._retention is not None:
            restored = self._retention.restore()
            self.settings = restored.settings
            if restored.commons or restored.tunables:
                commons, tunables = count_of(restored.commons, "common"), count_of(restored.tunables, "tunable")
                self._news.append(f"kept from the last run: {commons}, {tunables} ({self._retention.path})")

    def news(self) -> list[str]:
        """Return the lines to show since the last call."""
        news, self._news = self._news, []
        return news

    def update(self, now_ns: int) -> None:
        """Save what has changed if it is time to."""
        if now_ns >= self._next_ns:
            self._next_ns = now_ns + SAVE_PERIOD_NS
            self._save(durable=False)

    def end(self) -> None:
        """Save what has changed, down to the disk."""
        self._save(durable=True)

    def _save(self, *, durable: bool) -> None:
        if self._retention is None or self.failed:
            return
        try:
            self._retention.save(durable=durable)
        except RetentionFault as fault:
            self.failed = True
            self._news.append(f"values of this run will not outlive it: {fault.place}: {fault.message}")
