"""What stands on lines that the parser could not read, so that one broken line causes no second error elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.problems.problem import Severity

_WORD = re.compile(r"[A-Z_][A-Z0-9_]*[%!@$]?")
_NUMBER = re.compile(r"\s*([0-9]{1,9})(?![0-9])")
_BLOCK_WORDS = frozenset({"IF", "ELSE", "END_IF", "FOR", "NEXT"})
_DECLARING = frozenset({"LOCAL", "COMMON", "GLOBAL", "EVENT"})


@dataclass(frozen=True)
class BrokenLines:
    """The logical lines with a syntax error.

    ``words`` stand on any of them, ``declared`` on those that declare something; ``numbers`` are their line numbers.
    """

    words: frozenset[str] = frozenset()
    declared: frozenset[str] = frozenset()
    numbers: frozenset[int] = frozenset()

    @property
    def blocks(self) -> bool:
        """TRUE where an IF or FOR may begin or end on a broken line, so that blocks are not where they seem to be."""
        return not _BLOCK_WORDS.isdisjoint(self.words)

    def may_declare(self, name: str) -> bool:
        """Return whether a broken declaration mentions a variable of this full name."""
        return name in self.declared


def broken_lines(source: SourceText, diagnostics: Iterable[Diagnostic]) -> BrokenLines:
    """Return what stands on the lines on which the parser reported errors, physical lines joined by ``&``."""
    lines = source.lines
    begins = _beginnings(lines)
    words: set[str] = set()
    declared: set[str] = set()
    numbers: set[int] = set()
    faulty = {begins[item.span.line - 1] for item in diagnostics if _stops(item) and item.span.line <= len(lines)}
    for index, line in enumerate(lines):
        if begins[index] not in faulty:
            continue
        found = _WORD.findall(line.upper())
        words.update(found)
        logical = begins[index]
        if any(word in _DECLARING for word in _WORD.findall(lines[logical].upper())):
            declared.update(found)
        number = _NUMBER.match(line)
        if index == logical and number:
            numbers.add(int(number.group(1)))
    return BrokenLines(frozenset(words), frozenset(declared), frozenset(numbers))


def _stops(diagnostic: Diagnostic) -> bool:
    return diagnostic.severity is Severity.ERROR and diagnostic.span.line >= 1


def _beginnings(lines: list[str]) -> list[int]:
    """Return for each physical line the index of the first line of its logical line."""
    begins: list[int] = []
    for index in range(len(lines)):
        continued = index > 0 and lines[index - 1].rstrip().endswith("&")
        begins.append(begins[-1] if continued else index)
    return begins
