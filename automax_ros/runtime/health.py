"""Problems of a running rack: counted where they are detected, reported in words the first time each occurs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

_MAX_KEYS = 1000
"""Most keys of one kind that are reported once each (decision: a bound, and one kind does not silence another)."""
FROM_STRANGERS = 20
"""Most keys of a kind that are reported if other programs choose them (decision): a forger has any number of them."""


@dataclass
class Health:
    """``counts`` of problems by their kind in words, such as ``run-time error``."""

    counts: Counter[str] = field(default_factory=Counter)
    _keys: dict[str, set[Hashable]] = field(default_factory=dict)
    _news: list[str] = field(default_factory=list)

    def note(self, kind: str, key: Hashable, text: Callable[[], str], *, times: int = 1, most: int = _MAX_KEYS) -> None:
        """Count a problem of a kind; its text is news if none of this kind and key was, of at most ``most`` keys."""
        self.counts[kind] += times
        known = self._keys.setdefault(kind, set())
        if key not in known and len(known) < most:
            known.add(key)
            self._news.append(text())

    def news(self) -> list[str]:
        """Return the texts since the last call."""
        texts, self._news = self._news, []
        return texts
