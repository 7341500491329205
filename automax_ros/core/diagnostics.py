"""Diagnostics: an error, its place and its remedy, for sources and configurations alike."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from functools import cached_property

from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.core.text import printable

LONGEST_EXCERPT = 240
"""Most characters of a source line that are shown: a line of a megabyte must not be printed with every finding."""


@dataclass(frozen=True, order=True)
class Span:
    """A stretch of one physical line of a text; lines and columns count from 1, ``end_column`` is after the last."""

    line: int
    column: int
    end_column: int

    def to(self, other: Span) -> Span:
        """Return the span from here to the end of ``other``; a span never leaves its first line."""
        return self if other.line != self.line else Span(self.line, self.column, max(self.end_column, other.end_column))


@dataclass(frozen=True)
class Note:
    """A second place of a diagnostic, such as an earlier declaration."""

    message: str
    span: Span


@dataclass(frozen=True)
class Diagnostic:
    """One finding. Its severity comes from the table of problems, never from the place that reports it.

    ``statement`` is the BASIC line number of the fault, None if there is none.
    """

    code: str
    message: str
    span: Span
    statement: int | None = None
    hint: str | None = None
    notes: tuple[Note, ...] = ()
    unconfirmed: bool = field(default=False, compare=False)

    @property
    def severity(self) -> Severity:
        """ERROR or WARNING, from the table of problems."""
        return PROBLEMS[self.code].severity


@dataclass(frozen=True)
class SourceText:
    """A text with its name in messages."""

    name: str
    text: str

    @cached_property
    def lines(self) -> list[str]:
        """The physical lines without their ends; CR LF, LF and CR all end a line."""
        return self.text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def render(diagnostic: Diagnostic, source: SourceText) -> str:
    """Return a diagnostic as readable text: place, message, source line, caret, notes and hint."""
    lines = source.lines
    parts = [
        f"{_place(source, diagnostic.span)}: {diagnostic.severity.value}[{diagnostic.code}]: {diagnostic.message}",
        *_excerpt(diagnostic.span, lines),
    ]
    for note in diagnostic.notes:
        parts.append(f"{_place(source, note.span)}: note: {note.message}")
        parts.extend(_excerpt(note.span, lines))
    if diagnostic.hint:
        parts.append(f"  hint: {diagnostic.hint}")
    return "\n".join(parts)


def render_all(diagnostics: Iterable[Diagnostic], source: SourceText) -> str:
    """Return all diagnostics in the order of their places, each ended by a line feed."""
    return "".join(render(item, source) + "\n" for item in in_order(diagnostics))


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return diagnostics sorted by place, then code."""
    return sorted(diagnostics, key=lambda item: (item.span, item.code, item.message))


def as_json(diagnostic: Diagnostic, source: SourceText) -> dict[str, object]:
    """Return the object that ``automax check --json`` prints for a diagnostic."""
    record: dict[str, object] = {
        "file": source.name,
        **asdict(diagnostic.span),
        "statement": diagnostic.statement,
        "severity": diagnostic.severity.value,
        "code": diagnostic.code,
        "message": diagnostic.message,
    }
    if diagnostic.hint:
        record["hint"] = diagnostic.hint
    if diagnostic.unconfirmed:
        record["unconfirmed"] = True
    return record


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Return whether any of the diagnostics is an error."""
    return any(item.severity is Severity.ERROR for item in diagnostics)


def _place(source: SourceText, span: Span) -> str:
    return f"{printable(source.name)}:{span.line}:{span.column}"


def _excerpt(span: Span, lines: list[str]) -> list[str]:
    if not 1 <= span.line <= len(lines):
        return []
    whole = lines[span.line - 1]
    left_out = max(0, min(span.column - LONGEST_EXCERPT // 3, len(whole) - LONGEST_EXCERPT))
    line = printable(whole[left_out : left_out + LONGEST_EXCERPT])
    column, end_column = span.column - left_out, span.end_column - left_out
    start = min(max(column - 1, 0), len(line))
    before, after = "..." if left_out else "", "..." if left_out + len(line) < len(whole) else ""
    length = max(1, min(end_column, len(line) + (1 if after else 2)) - column)
    pad = " " * len(before) + "".join("\t" if char == "\t" else " " for char in line[:start])
    return [f"  {before}{line}{after}", f"  {pad}{'^' * length}"]
