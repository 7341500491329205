"""Shared by the parts of the checker: the symbols found so far, the findings, and the content of broken lines.

A broken line is one that the parser could not read; its content is kept so that it causes no second error elsewhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.blocks.declare.declaration import Block, Platform
from automax_ros.core.diagnostics import Diagnostic, Note, SourceText, Span
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.problems.problem import Severity
from automax_ros.core.text import Suggester
from automax_ros.language.program import BoundCall, CommonSpec, DataStructure, OpenedFile, Symbol
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT, TooManyProblemsError
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.language.tree.tree import Call, Data, Event, Statement
from automax_ros.language.tree.walk import statements_in_order

_WORD = re.compile(r"[A-Z_][A-Z0-9_]*[%!@$]?")
_NUMBER = re.compile(r"\s*([0-9]{1,9})(?![0-9])")
_BLOCK_WORDS = frozenset({"IF", "ELSE", "END_IF", "FOR", "NEXT"})
_DECLARING = frozenset({"LOCAL", "COMMON", "GLOBAL", "EVENT"})


@dataclass(frozen=True)
class BrokenLines:
    """The logical lines with a syntax error.

    ``words`` are on any of them, ``declared`` on those that declare something; ``numbers`` are their line numbers.
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
    """Return the content of the lines on which the parser reported errors, physical lines joined by ``&``."""
    lines = source.lines
    begins = _beginnings(lines)
    words: set[str] = set()
    declared: set[str] = set()
    numbers: set[int] = set()
    errors = [item for item in diagnostics if item.severity is Severity.ERROR]
    faulty = {begins[item.span.line - 1] for item in errors if 1 <= item.span.line <= len(lines)}
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


def _beginnings(lines: list[str]) -> list[int]:
    """Return for each physical line the index of the first line of its logical line."""
    begins: list[int] = []
    for index in range(len(lines)):
        continued = index > 0 and lines[index - 1].rstrip().endswith("&")
        begins.append(begins[-1] if continued else index)
    return begins


@dataclass
class Context:
    """One check of one task.

    ``lines`` are the physical lines of its text; ``line`` is the BASIC line number in force, None before the first.
    ``files`` are the ports and channels by their numbers after # in a BASIC task. ``scan_block`` is the block that
    begins its scans, "" as long as none is found. ``structures`` are the data structures by name, with the span of the
    name where its SHIFT block makes it.
    """

    target: Platform
    tick_ns: int
    catalogue: Mapping[str, Block]
    commons: Mapping[str, CommonSpec] | None = None
    lines: Sequence[str] = ()
    broken: BrokenLines = field(default_factory=BrokenLines)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    symbols: dict[str, Symbol] = field(default_factory=dict)
    events: dict[str, Event] = field(default_factory=dict)
    data: list[tuple[int, Data]] = field(default_factory=list)
    calls: dict[Span, BoundCall] = field(default_factory=dict)
    structures: dict[str, tuple[DataStructure, Span]] = field(default_factory=dict)
    suggest: Suggester = field(default_factory=Suggester)
    kind: TaskKind = TaskKind.CONTROL_BLOCK
    files: dict[int, OpenedFile] = field(default_factory=dict)
    line: int | None = None
    ticks: int | None = None
    scan_block: str = ""

    def report(
        self, code: str, message: str, span: Span, hint: str | None = None, notes: tuple[Note, ...] = ()
    ) -> None:
        """Add a finding in the line in force.

        Raises:
            TooManyProblemsError: there are DIAGNOSTIC_LIMIT findings already.
        """
        if len(self.diagnostics) >= DIAGNOSTIC_LIMIT:
            raise TooManyProblemsError
        self.diagnostics.append(Diagnostic(code, message, span, self.line, hint, notes))

    @property
    def task_words(self) -> str:
        """The kind of task, for messages: ``an AUTOMAX task``."""
        article = "an" if self.target is Platform.AUTOMAX else "a"
        return f"{article} {self.target.value.upper()} task"

    @property
    def errors(self) -> int:
        """The number of errors found so far, without warnings."""
        return sum(PROBLEMS[item.code].severity is Severity.ERROR for item in self.diagnostics)

    def place_of(self, word: str, span: Span) -> Span:
        """Return the place of a word in a span of the text, the span itself if the word is not on its first line."""
        if not 1 <= span.line <= len(self.lines):
            return span
        pattern = re.compile(rf"(?<![A-Z0-9_]){re.escape(word)}(?![A-Z0-9_])", re.IGNORECASE)
        found = pattern.search(self.lines[span.line - 1], span.column - 1, span.end_column - 1)
        return span if found is None else Span(span.line, found.start() + 1, found.end() + 1)

    @property
    def period_s(self) -> float | None:
        """The scan period T in seconds, None as long as TICKS is not known to be valid."""
        return None if self.ticks is None else self.ticks * self.tick_ns / 1e9

    def is_broken(self, blocks: Iterable[Block]) -> bool:
        """Return whether a line that could not be read mentions one of these blocks."""
        return any(block.name in self.broken.words for block in blocks)

    def is_input_point(self, name: str) -> bool:
        """Return whether the rack defines a common as an input, which only the rack writes."""
        spec = self.commons.get(name) if self.commons is not None else None
        symbol = self.symbols.get(name)
        return spec is not None and spec.is_input and symbol is not None and symbol.scope.value == "COMMON"


@dataclass(frozen=True)
class TaskLayout:
    """The parts of a task. Without a SCAN_LOOP everything counts as scan, so that it is checked as such."""

    startup: tuple[Statement, ...]
    scan_loop: Call | None
    scan: tuple[Statement, ...]
    scan_loop_line: int | None = None

    def numbered(self) -> Iterator[tuple[Statement, int | None, bool]]:
        """Yield every statement but SCAN_LOOP with the line number in force, and whether it is after SCAN_LOOP."""
        for statement, line in statements_in_order(self.startup):
            yield statement, line, False
        for statement, line in statements_in_order(self.scan, self.scan_loop_line):
            yield statement, line, self.scan_loop is not None
