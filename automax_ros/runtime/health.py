"""What goes wrong in a rack that runs: counted, and told in words the first time it happens.

Whoever notices it counts, whoever runs the rack shows it: nobody reads /rosout while the rack runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

_MAX_KEYS = 1000
"""Most things of one kind that are told once each (decision: a bound, and one kind does not silence another)."""
FROM_STRANGERS = 20
"""Most things of a kind that are told where strangers choose the keys (decision): who forges has any number of them."""


@dataclass
class Health:
    """``counts`` of trouble by its kind in words, such as ``run-time error``."""

    counts: Counter[str] = field(default_factory=Counter)
    _keys: dict[str, set[Hashable]] = field(default_factory=dict)
    _news: list[str] = field(default_factory=list)

    def note(self, kind: str, key: Hashable, text: Callable[[], str], *, times: int = 1, most: int = _MAX_KEYS) -> None:
        """Count something of a kind; its text is news if nothing of this kind and key was noted before.

        At most ``most`` keys of a kind are told.
        """
        self.counts[kind] += times
        known = self._keys.setdefault(kind, set())
        if key not in known and len(known) < most:
            known.add(key)
            self._news.append(text())

    def news(self) -> list[str]:
        """Return the texts since the last call."""
        texts, self._news = self._news, []
        return texts
