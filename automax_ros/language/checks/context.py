"""What the parts of the checker share: the symbols found so far and where findings go."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.blocks.declaration import Block, Platform
from automax_ros.core.diagnostics import Diagnostic, Note, Span
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.problems.problem import Severity
from automax_ros.core.text import Suggester
from automax_ros.language.checks.broken_lines import BrokenLines
from automax_ros.language.program import BoundCall, CommonSpec, DataStructure, OpenedFile, Symbol
from automax_ros.language.syntax.reporter import DIAGNOSTIC_LIMIT, TooManyProblemsError
from automax_ros.language.syntax.task_kind import TaskKind
from automax_ros.language.syntax.tree import Data, Event


@dataclass
class Context:
    """One check of one task.

    ``lines`` are the physical lines of its text; ``line`` is the BASIC line number in force, None before the first.
    ``files`` are what the numbers after # of a BASIC task are. ``scan_block`` is the block that begins its scans, "" as
    long as none is found. ``structures`` are the data structures by name, with the
    span of the name where its SHIFT block makes it.
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
        """The number of errors found so far, warnings left out."""
        return sum(PROBLEMS[item.code].severity is Severity.ERROR for item in self.diagnostics)

    def place_of(self, word: str, span: Span) -> Span:
        """Return where a word stands in a stretch of the text, the stretch itself where it is not on its first line."""
        if not 1 <= span.line <= len(self.lines):
            return span
        pattern = re.compile(rf"(?<![A-Z0-9_]){re.escape(word)}(?![A-Z0-9_])", re.IGNORECASE)
        found = pattern.search(self.lines[span.line - 1], span.column - 1, span.end_column - 1)
        return span if found is None else Span(span.line, found.start() + 1, found.end() + 1)

    @property
    def period_s(self) -> float | None:
        """The scan period T in seconds, None as long as TICKS is not known to be good."""
        return None if self.ticks is None else self.ticks * self.tick_ns / 1e9

    def is_broken(self, blocks: Iterable[Block]) -> bool:
        """Return whether a line that could not be read mentions one of some blocks."""
        return any(block.name in self.broken.words for block in blocks)

    def is_input_point(self, name: str) -> bool:
        """Return whether the rack defines a common as an input, which nothing but the rack writes."""
        spec = self.commons.get(name) if self.commons is not None else None
        symbol = self.symbols.get(name)
        return spec is not None and spec.is_input and symbol is not None and symbol.scope.value == "COMMON"
