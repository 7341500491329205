"""Did you mean ...? The nearest known word to an unknown one."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from automax_ros.core.types import bare_name

COMPARISONS = 50_000
"""Most pairs of names that one check compares to suggest one (decision: a bound on time for hostile sources)."""


class Suggester:
    """Finds near words until the check's budget of comparisons is spent."""

    def __init__(self) -> None:
        self._left = COMPARISONS

    def nearest(self, word: str, known: Iterable[str]) -> str | None:
        """Return the known word that looks most like ``word``, None where none is near.

        The same name with another type character is the nearest; then the one with most letters in common.
        """
        candidates = sorted(known)
        self._left -= len(candidates)
        if self._left < 0:
            return None
        bare = bare_name(word)
        twins = [name for name in candidates if name != word and bare_name(name) == bare]
        if twins:
            return twins[0]
        found = difflib.get_close_matches(word, candidates, n=1, cutoff=0.65)
        return found[0] if found else None

    def hint(self, word: str, known: Iterable[str]) -> str | None:
        """Return the hint ``did you mean X?``, None where no known word is near."""
        found = self.nearest(word, known)
        return f"did you mean {found}?" if found else None
