"""Parses a text to a syntax tree: reads statement by statement and continues after a wrong one."""

from __future__ import annotations

from automax_ros.core.diagnostics import Diagnostic, SourceText, Span
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.open_blocks import FrameStack
from automax_ros.language.parse.statement_reader import StatementReader
from automax_ros.language.text.lines import END_OF_FILE, LineReader, LogicalLine
from automax_ros.language.text.reporter import Reporter, SyntaxFaultError, TooManyProblemsError
from automax_ros.language.text.tokens import Kind, SourceFault, Token
from automax_ros.language.tree.task_kind import TaskKind, kind_of_source
from automax_ros.language.tree.tree import Label, Module, Remark, Statement

SOURCE_LIMIT = 1_000_000
"""Largest source, in characters (decision: a bound on untrusted texts)."""
STATEMENT_LIMIT = 8192
"""Longest statement with its continuation lines, in characters (decision: a bound on untrusted texts)."""


def parse(source: SourceText) -> tuple[Module, list[Diagnostic]]:
    """Return the tree of a task and the problems of its text; never raises, whatever the text.

    Where there are errors the tree has the statements that could be read. The source's name gives the kind of task.
    """
    reporter = Reporter()
    if len(source.text) > SOURCE_LIMIT:
        message = f"the text has {len(source.text)} characters, more than {SOURCE_LIMIT}"
        return Module(()), [Diagnostic("AMX0001", message, Span(1, 1, 2), hint="divide the task")]
    if source.text.partition(END_OF_FILE)[0].count("\0") * 4 > len(source.text):
        hint = "save it as ANSI, ASCII or UTF-8"
        return Module(()), [Diagnostic("AMX0006", "the file is not plain text but UTF-16", Span(1, 1, 2), hint=hint)]
    return _TaskParser(source, reporter, kind_of_source(source.name)).module(), reporter.diagnostics


class _TaskParser:
    def __init__(self, source: SourceText, reporter: Reporter, kind: TaskKind) -> None:
        self._reporter = reporter
        self._reader = LineReader(source, reporter)
        self._frames = FrameStack(reporter)
        self._statements = StatementReader(self._frames, kind)
        self._long_names: set[str] = set()

    def module(self) -> Module:
        try:
            for line in self._reader:
                self._line(line)
            self._frames.close_all()
            self._report_lower_case()
        except TooManyProblemsError:
            pass
        return Module(tuple(self._frames.abandon()))

    def _line(self, line: LogicalLine) -> None:
        self._frames.begin_line(line.number)
        cursor = Cursor(line.tokens, self._reporter, self._long_names)
        if cursor.at_line_end():
            if not line.faulty:
                hint = "remove the line, or put a REM after its number"
                self._reporter.report(SourceFault("AMX0014", "the line has no statement", hint), line.number_span)
            self._frames.add(Label(span=line.number_span))
            return
        while not cursor.at_line_end():
            self._statement(cursor, line)
        self._frames.end_line(line.number_span)

    def _statement(self, cursor: Cursor, line: LogicalLine) -> None:
        """Read one statement and the separator after it; report at most one syntax error."""
        start = cursor.position
        if self._too_long(cursor, line):
            cursor.skip_statement()
            cursor.accept("\\")
            return
        try:
            if cursor.current.kind is Kind.REMARK:
                self._frames.add(_remark(cursor.advance()))
                return
            self._statements.read(cursor)
            cursor.expect_end()
        except SyntaxFaultError as error:
            self._report(line, error)
            self._statements.recover(cursor, start)
        if cursor.at_separator():
            after = cursor.advance().span
            if cursor.at_line_end():
                fault = SourceFault("AMX0036", "a statement is missing after `\\`", "remove the `\\`")
                self._report(line, SyntaxFaultError(fault, after))

    def _report(self, line: LogicalLine, error: SyntaxFaultError) -> None:
        if not line.faulty:
            self._reporter.report(error.fault, error.span, error.notes)

    def _too_long(self, cursor: Cursor, line: LogicalLine) -> bool:
        first = cursor.current
        index = cursor.position
        while not cursor.tokens[index].kind.ends_segment:
            index += 1
        if cursor.tokens[index].offset - first.offset <= STATEMENT_LIMIT:
            return False
        message = f"the statement has more than {STATEMENT_LIMIT} characters"
        fault = SourceFault("AMX0005", message, "divide it over several statements")
        self._report(line, SyntaxFaultError(fault, first.span))
        return True

    def _report_lower_case(self) -> None:
        span = self._reader.lexer.lower_case
        if span is not None:
            self._reporter.statement = None
            fault = SourceFault("AMX0003", "lower case is read as upper case", "the real compiler wants upper case")
            self._reporter.report(fault, span)


def _remark(token: Token) -> Statement:
    return Remark(str(token.value), token.text == "!", span=token.span)
