"""What goes wrong in a rack that runs: counted, and told in words the first time it happens.

Whoever notices it counts, whoever runs the rack shows it: nobody reads /rosout while the rack runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

_MAX_KEYS = 1000
"""Most things that are told once each (decision: a bound; counts go on)."""


@dataclass
class Health:
    """``counts`` of trouble by its kind in words, such as ``run-time error``."""

    counts: Counter[str] = field(default_factory=Counter)
    _keys: set[tuple[str, Hashable]] = field(default_factory=set)
    _news: list[str] = field(default_factory=list)

    def note(self, kind: str, key: Hashable, text: Callable[[], str], *, times: int = 1) -> None:
        """Count something of a kind; its text is news if nothing of this kind and key was noted before."""
        self.counts[kind] += times
        known = (kind, key)
        if known not in self._keys and len(self._keys) < _MAX_KEYS:
            self._keys.add(known)
            self._news.append(text())

    def news(self) -> list[str]:
        """Return the texts since the last call."""
        texts, self._news = self._news, []
        return texts
