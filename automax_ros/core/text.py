"""Text for messages: escapes untrusted text, counts things, finds the known word nearest to another."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Container, Iterable, Sequence
from itertools import islice, zip_longest

from automax_ros.core.types import bare_name

MAX_COMPARISONS = 50_000
"""Most pairs of words that one ``Suggester`` compares (decision: a bound on time for hostile sources)."""
_LONGEST_GUESS = 60
_LISTED = 8
"""Most words that a hint lists if none is near."""
_LIKENESS = 0.62
"""Share of letters in common from which a word counts as a misspelling (decision)."""


def printable(text: str) -> str:
    """Return a text with control characters but the tab replaced, so that a hostile source cannot control a terminal.

    These are line ends, C0, DEL, C1, bidirectional controls and all others that Python does not count as printable.
    """
    if text.isprintable():
        return text
    return "".join(char if char == "\t" or char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in text)


def visible(text: str) -> str:
    """Return a text of several lines with the control characters of each replaced; line ends stay."""
    if text.isprintable():
        return text
    return "\n".join(map(printable, text.split("\n")))


def quoted(text: str, *, marks: str = "'", limit: int = 40) -> str:
    """Return a piece of a file for a message: shortened, without control characters or line ends, in quotes."""
    short = text if len(text) <= limit else text[: limit - 3] + "..."
    return f"{marks}{printable(short)}{marks}"


def count_of(number: int, thing: str) -> str:
    """Return a number of things: ``1 scan``, ``2 scans``, ``2 processes``."""
    return f"{number} {thing}{'' if number == 1 else 'es' if thing.endswith('s') else 's'}"


def table(rows: Sequence[Sequence[str]], right: Container[int] = ()) -> list[str]:
    """Return rows as lines with aligned columns, those numbered in ``right`` (from 0) aligned at the right.

    A row may have fewer cells than others.
    """
    widths = [max(map(len, cells)) for cells in zip_longest(*rows, fillvalue="")]
    return [
        "  ".join(
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=False))
        ).rstrip()
        for row in rows
    ]


def did_you_mean(word: str, known: Iterable[str], *, most: int = 1) -> str | None:
    """Return the hint ``did you mean X?`` with the known words nearest to an unknown one, None if none is near.

    At most ``most`` words, ``X or Y``.
    """
    return Suggester().hint(word, known, most=most)


def near_or_listed(word: str, known: Collection[str], prefix: str = "") -> str | None:
    """Return ``did_you_mean``, or a hint with the first known words if none is near; None if there are none.

    ``prefix`` belongs before the word that is meant.
    """
    near = Suggester().nearest(word, known)
    if near is not None:
        return f"did you mean {prefix}{near}?"
    return f"it has {', '.join(islice(known, _LISTED))}{' ...' if len(known) > _LISTED else ''}" if known else None


class Suggester:
    """Finds near words until its budget of comparisons is used up."""

    def __init__(self) -> None:
        self._left = MAX_COMPARISONS

    def hint(self, word: str, known: Iterable[str], *, most: int = 1) -> str | None:
        """Return the hint ``did you mean X?``, None if no known word is near or the budget is used up."""
        found = self._near(word, known, most)
        return f"did you mean {' or '.join(found)}?" if found else None

    def nearest(self, word: str, known: Iterable[str]) -> str | None:
        """Return the known word most similar to ``word``, None if none is near or the budget is used up."""
        return next(iter(self._near(word, known, 1)), None)

    def _near(self, word: str, known: Iterable[str], most: int) -> list[str]:
        """Return near words in any case: the same name with another type character first, then by letters in common."""
        if len(word) > _LONGEST_GUESS:
            return []
        words = list(known)
        self._left -= len(words)
        if self._left < 0:
            return []
        choices = {item.casefold(): item for item in sorted(words, reverse=True)}
        asked = word.casefold()
        bare = bare_name(asked)
        twins = sorted(item for item in choices if bare_name(item) == bare and item != asked)
        alike = difflib.get_close_matches(asked, choices, n=most + len(twins), cutoff=_LIKENESS)
        return [choices[item] for item in dict.fromkeys((*twins, *alike))][:most]
