"""Open IF and FOR blocks: they receive the statements, and report ends that do not match."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Note, Span
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.text.reporter import Reporter
from automax_ros.language.text.tokens import SourceFault
from automax_ros.language.tree.tree import NO_SPAN, End, For, If, Label, Reference, Statement

NESTING_LIMIT = 16
"""Deepest nesting of IF and FOR together, one-line IFs included (decision)."""


@dataclass
class OpenBlock:
    """A block whose end has not been read yet.

    ``node`` is its IF or FOR without a body, None where the head was wrong: then ``body`` is the list of the block
    around it. A ``doubtful`` block may not have an end: its wrong head does not show whether it begins a block.
    """

    word: str
    node: If | For | None
    span: Span = NO_SPAN
    number: int | None = None
    body: list[Statement] = field(default_factory=list)
    otherwise: list[Statement] | None = None
    doubtful: bool = False

    @property
    def statements(self) -> list[Statement]:
        """The list for the next statement."""
        return self.body if self.otherwise is None else self.otherwise

    def closed(self) -> list[Statement]:
        """Return the statement made of the block, none where its head was wrong."""
        if isinstance(self.node, If):
            return [dataclasses.replace(self.node, then=tuple(self.body), otherwise=tuple(self.otherwise or ()))]
        if isinstance(self.node, For):
            return [dataclasses.replace(self.node, body=tuple(self.body))]
        return []


class FrameStack:
    """The open blocks of a task, innermost last, and the pending line number of the next statement."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter
        self._module = OpenBlock("TASK", None)
        self._frames: list[OpenBlock] = []
        self._number: int | None = None
        self._crossed: set[str] = set()

    @property
    def depth(self) -> int:
        """Number of open blocks."""
        return len(self._frames)

    @property
    def _top(self) -> OpenBlock:
        return self._frames[-1] if self._frames else self._module

    def begin_line(self, number: int | None) -> None:
        """Give the next statement a line number."""
        self._number = number

    def end_line(self, span: Span) -> None:
        """Add a label if no statement of the line could be read, so that jumps to it cause no further errors."""
        if self._number is not None:
            self.add(Label(span=span))

    def add(self, statement: Statement) -> None:
        """Add a statement to the innermost block, with the pending line number."""
        self._top.statements.append(dataclasses.replace(statement, number=self._number))
        self._number = None

    def open(self, cursor: Cursor, node: If | For, span: Span) -> None:
        """Begin a block; a nesting too deep is reported once."""
        word = "IF" if isinstance(node, If) else "FOR"
        frame = OpenBlock(
            word, dataclasses.replace(node, number=self._number, span=span), span, self._reporter.statement
        )
        if self.depth >= NESTING_LIMIT:
            frame.node, frame.body = None, self._top.statements
            if self.depth == NESTING_LIMIT:
                self._reporter.report(too_deep(word), cursor.tokens[max(cursor.position - 1, 0)].span)
            self.end_line(span)
        self._number = None
        self._frames.append(frame)

    def open_wrong(self, word: str, span: Span, doubtful: bool) -> None:
        """Begin a block whose head was wrong."""
        self.end_line(span)
        around = self._top.statements
        self._frames.append(OpenBlock(word, None, span, self._reporter.statement, around, doubtful=doubtful))

    def close_all(self) -> None:
        """Report and close every block that is still open at the end of the text; an END there belongs to the task."""
        ends: list[Statement] = []
        while self._frames:
            statements = self._top.statements
            if statements and isinstance(statements[-1], End):
                ends.append(statements.pop())
            self._close_unended()
            self._top.statements.extend(ends)
            ends.clear()

    def abandon(self) -> list[Statement]:
        """Close all open blocks silently and return the task's statements."""
        while self._frames:
            self._pop()
        return self._module.body

    def begin_else(self, cursor: Cursor, span: Span) -> None:
        """Begin the ELSE branch, for an ELSE alone on its line."""
        self._close_inner("IF")
        frame = self._top
        if frame.word != "IF" or frame.otherwise is not None:
            self._refuse_else(cursor, frame)
        self._label(span)
        _turn_to_else(frame)

    def end_if(self, cursor: Cursor, span: Span) -> None:
        """Close an IF; the line number of END_IF becomes a label after the block."""
        self._close_inner("IF")
        if self._top.word != "IF":
            cursor.position -= 1
            cursor.fail("AMX0052", "END_IF without IF", self._one_line_hint())
        self._pop()
        self._label(span)

    def next(self, cursor: Cursor, variable: Reference, span: Span) -> None:
        """Close a FOR; the line number of NEXT becomes a label at the end of the loop's body."""
        matching = next((frame for frame in reversed(self._frames) if _loops_over(frame, variable.name)), None)
        if matching is not None:
            while self._top is not matching:
                self._close_unended()
        elif variable.name in self._crossed:
            self._crossed.discard(variable.name)
            self._label(span)
            return
        elif self._top.word == "FOR":
            self._refuse_next(cursor, variable)
        else:
            cursor.position -= 1
            cursor.fail("AMX0056", f"NEXT {variable.name[:20]} without FOR")
        self._label(span)
        self._pop()

    def close_quietly(self, word: str, span: Span) -> None:
        """Treat a misspelt ELSE, END_IF or NEXT as the correct one, if it fits."""
        frame = self._top
        if frame.word == "IF" and word == "ELSE" and frame.otherwise is None:
            self._label(span)
            _turn_to_else(frame)
        elif (frame.word, word) == ("IF", "END_IF"):
            self._pop()
            self._label(span)
        elif (frame.word, word) == ("FOR", "NEXT"):
            self._label(span)
            self._pop()

    def _label(self, span: Span) -> None:
        if self._number is not None:
            self.add(Label(span=span))

    def _pop(self) -> None:
        frame = self._frames.pop()
        self._top.statements.extend(frame.closed())

    def _close_inner(self, word: str) -> None:
        if any(frame.word == word for frame in reversed(self._frames)):
            while self._top.word != word:
                self._close_unended()

    def _close_unended(self) -> None:
        frame = self._top
        if not frame.doubtful:
            code, end = ("AMX0054", "END_IF") if frame.word == "IF" else ("AMX0055", "NEXT")
            hint = f"close the block with {end}"
            if isinstance(frame.node, For):
                hint = f"close the loop with NEXT {frame.node.variable.name[:20]}, before the end of a block around it"
                self._crossed.add(frame.node.variable.name)
            in_force, self._reporter.statement = self._reporter.statement, frame.number
            self._reporter.report(SourceFault(code, f"{frame.word} without {end}", hint), frame.span)
            self._reporter.statement = in_force
        self._pop()
        if frame.doubtful:
            # The end that closed the doubtful block may have been that of the block around it.
            self._top.doubtful = True

    def _refuse_else(self, cursor: Cursor, frame: OpenBlock) -> None:
        cursor.position -= 1
        if frame.word == "IF":
            cursor.fail("AMX0051", "a second ELSE in one IF", None, (Note("the IF stands here", frame.span),))
        hint = self._one_line_hint()
        self.open_wrong("IF", cursor.here(), doubtful=True)
        _turn_to_else(self._top)
        cursor.fail("AMX0051", "ELSE without IF", hint)

    def _refuse_next(self, cursor: Cursor, variable: Reference) -> None:
        frame = self._top
        assert isinstance(frame.node, For)
        cursor.position -= 1
        note = Note("the innermost FOR stands here", frame.span)
        message = f"NEXT {variable.name[:20]} does not belong to FOR {frame.node.variable.name[:20]}"
        cursor.fail("AMX0057", message, f"write NEXT {frame.node.variable.name[:20]}", (note,))

    def _one_line_hint(self) -> str | None:
        last = self._top.statements[-1] if self._top.statements else None
        if isinstance(last, If) and last.one_line:
            return "an IF with a statement after THEN ends on its line; for a block put nothing after THEN"
        return None


def _turn_to_else(frame: OpenBlock) -> None:
    frame.otherwise = [] if frame.node is not None else frame.body


def _loops_over(frame: OpenBlock, name: str) -> bool:
    if frame.word != "FOR":
        return False
    return not isinstance(frame.node, For) or frame.node.variable.name == name


def too_deep(word: str) -> SourceFault:
    """Return the fault of a block nested too deep."""
    return SourceFault(
        "AMX0058", f"{word} nested more than {NESTING_LIMIT} deep", "move the inner part into a subroutine"
    )
