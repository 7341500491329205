"""Joins physical lines to logical lines: line numbers and `&` continuation.

Every line begins with a line number, 1 to 32767, in ascending order (decision). A line whose last character is
`&` continues in the next physical line that is not blank, which has no number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Note, SourceText, Span
from automax_ros.language.text.lexer import BLANKS, BROKEN_END, LineLexer
from automax_ros.language.text.reporter import Reporter
from automax_ros.language.text.tokens import OPERATOR_WORDS, STATEMENT_WORDS, Kind, SourceFault, Token

LAST_LINE_NUMBER = 32767
_NUMBER = re.compile(r"[ \t\f]*([0-9]+)")
_FIRST_WORDS = "|".join(sorted(STATEMENT_WORDS - {"ELSE", "ON"}))
_NUMBERED_STATEMENT = re.compile(
    rf"[ \t\f]*[0-9]{{1,5}}[ \t]*(?:(?:{_FIRST_WORDS})(?![A-Z0-9_%!@$])|[A-Z_][A-Z0-9_]*[%!@$]?[ \t]*=)", re.IGNORECASE
)
END_OF_FILE = "\x1a"
"""Ctrl-Z, at which DOS stops reading a text."""


@dataclass
class LogicalLine:
    """One numbered line with its continuations.

    ``number`` is None where it is missing. ``faulty`` means that a fault of the line itself was already reported.
    """

    number: int | None
    number_span: Span
    tokens: list[Token] = field(default_factory=list)
    faulty: bool = False


class LineReader:
    """Reads a text line by line and reports faults of line numbers and continuations."""

    def __init__(self, source: SourceText, reporter: Reporter) -> None:
        text = source.text.partition(END_OF_FILE)[0].rstrip("\r\n")
        self._lines = SourceText(source.name, text).lines
        if self._lines[0].startswith("\N{ZERO WIDTH NO-BREAK SPACE}"):
            self._lines[0] = " " + self._lines[0][1:]
        self._reporter = reporter
        self._seen: dict[int, Span] = {}
        self._previous = 0
        self._index = 0
        self.lexer = LineLexer()

    def __iter__(self) -> Iterator[LogicalLine]:
        """Yield the logical lines; the faults of each are reported before it is yielded."""
        while (index := self._next_written(self._index)) is not None:
            self._index = index
            yield self._logical_line()

    def _next_written(self, index: int) -> int | None:
        while index < len(self._lines):
            if self._lines[index].strip(BLANKS):
                return index
            index += 1
        return None

    def _logical_line(self) -> LogicalLine:
        text = self._lines[self._index]
        match = _NUMBER.match(text)
        if match is None:
            line = LogicalLine(None, Span(self._index + 1, 1, 2))
            self._assemble(line, 0)
            self._report_missing_number(line)
            return line
        span = Span(self._index + 1, match.start(1) + 1, match.end(1) + 1)
        line = LogicalLine(self._checked_number(match.group(1), span), span)
        self._assemble(line, match.end())
        return line

    def _checked_number(self, digits: str, span: Span) -> int | None:
        number = int(digits) if len(digits) <= 9 else None
        self._reporter.statement = number
        if number is None or not 1 <= number <= LAST_LINE_NUMBER:
            self._reporter.report(
                SourceFault("AMX0011", f"line numbers go from 1 to {LAST_LINE_NUMBER}", "renumber this line"), span
            )
            return number
        if number in self._seen:
            note = Note(f"line {number} stands here already", self._seen[number])
            self._reporter.report(SourceFault("AMX0012", f"line number {number} is used twice"), span, (note,))
        elif number < self._previous:
            hint = f"line numbers ascend: use one above {self._previous}"
            fault = SourceFault("AMX0013", f"line number {number} stands after line {self._previous}", hint)
            self._reporter.report(fault, span)
        self._seen.setdefault(number, span)
        self._previous = number
        return number

    def _report_missing_number(self, line: LogicalLine) -> None:
        first = line.tokens[0]
        line.faulty = True
        if first.kind is Kind.ERROR and first.fault is not None:
            self._reporter.report(first.fault, first.span)
            return
        hint = "begin the line with a number, or end the line before it with `&`"
        fault = SourceFault("AMX0010", "the line has no line number", hint)
        self._reporter.report(fault, first.span)

    def _assemble(self, line: LogicalLine, start: int) -> None:
        """Fill in the tokens of a logical line, ended by an END token, and move to the line after it."""
        tokens = line.tokens
        nesting = _Nesting()
        remark: list[str] = []
        offset = 0
        while True:
            text, row = self._lines[self._index], self._index + 1
            self._index += 1
            if remark:
                remark.append(text.strip(BLANKS))
            else:
                found = self.lexer.tokens(text, row, start, offset)
                nesting.add(found)
                tokens.extend(found)
                if tokens and tokens[-1].kind is Kind.REMARK:
                    remark.append(str(tokens[-1].value))
            start = 0
            written = len(text.rstrip(BLANKS))
            end = Span(row, written + 1, written + 2)
            if not self._goes_on(line, remark, nesting, end):
                break
            offset += len(text) + 1
        if remark:
            tokens[-1] = tokens[-1]._replace(value="\n".join(remark))
        tokens.append(Token(Kind.END, "", end.line, end.column, end.end_column, offset + written))

    def _goes_on(self, line: LogicalLine, remark: list[str], nesting: _Nesting, end: Span) -> bool:
        last = line.tokens[-1] if line.tokens else None
        following = self._next_written(self._index)
        mark = Span(end.line, max(end.column - 1, 1), end.column)
        if remark:
            continues = remark[-1].endswith("&")
            if continues:
                remark[-1] = remark[-1][:-1].strip(BLANKS)
        else:
            continues = last is not None and (last.kind is Kind.CONTINUE or last.text == BROKEN_END)
            if last is not None and last.kind is Kind.CONTINUE:
                line.tokens.pop()
        if continues:
            return self._checked_continuation(line, following, mark)
        if remark or following is None or not nesting.unfinished or _NUMBER.match(self._lines[following]):
            return False
        if not line.faulty:
            fault = SourceFault(
                "AMX0016", "the statement ends too early", "end the line with `&` to go on in the next one"
            )
            self._reporter.report(fault, end)
        line.faulty = True
        self._index = following
        return True

    def _checked_continuation(self, line: LogicalLine, following: int | None, mark: Span) -> bool:
        if following is None:
            fault = SourceFault("AMX0017", "nothing follows the `&`", "remove it, or write the rest of the statement")
        elif _NUMBERED_STATEMENT.match(self._lines[following]):
            fault = SourceFault(
                "AMX0017", "the line after this `&` has a line number", "remove the `&` or the line number"
            )
        else:
            self._index = following
            return True
        self._reporter.report(fault, mark)
        line.faulty = True
        return False


class _Nesting:
    """Whether a statement is visibly unfinished: an open parenthesis, or an operator or comma at its end."""

    def __init__(self) -> None:
        self._depth = 0
        self._first: Token | None = None
        self._last: Token | None = None

    def add(self, tokens: list[Token]) -> None:
        for token in tokens:
            if token.kind is Kind.SEPARATOR:
                self._depth, self._first = 0, None
            else:
                self._first = self._first or token
                self._depth += (token.text in ("(", "[")) - (token.text in (")", "]"))
            self._last = token

    @property
    def unfinished(self) -> bool:
        if self._last is None or self._last.kind is Kind.REMARK:
            return False
        if self._last.text == ",":
            return self._first is not None and self._first.text != "PRINT"
        return self._depth > 0 or self._last.kind is Kind.OPERATOR or self._last.text in OPERATOR_WORDS
