"""Parses a text to a syntax tree: reads statement by statement and continues after a wrong one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from automax_ros.core.diagnostics import Diagnostic, SourceText, Span
from automax_ros.core.text import did_you_mean
from automax_ros.language.parse.basic_statements import WAITING_STATEMENTS
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.expressions import expression, variable
from automax_ros.language.parse.open_blocks import NESTING_LIMIT, FrameStack, too_deep
from automax_ros.language.parse.statements import SIMPLE_STATEMENTS, assignment
from automax_ros.language.parse.unknown import refuse_statement, refuse_word
from automax_ros.language.text.lexer import END_OF_FILE, LineReader, LogicalLine
from automax_ros.language.text.reporter import Reporter, SyntaxFaultError, TooManyProblemsError
from automax_ros.language.text.tokens import RESERVED_WORDS, STATEMENT_WORDS, SourceFault, Token, TokenKind
from automax_ros.language.tree.task_kind import TaskKind, kind_of_source
from automax_ros.language.tree.tree import Expression, For, Goto, If, Label, Module, Remark, Statement

_BLOCK_WORDS = ("FOR", "NEXT", "END_IF", "ENDIF")
_STATEMENTS = {TaskKind.CONTROL_BLOCK: SIMPLE_STATEMENTS, TaskKind.BASIC: {**SIMPLE_STATEMENTS, **WAITING_STATEMENTS}}
_ELSE_IF = ("ELSEIF", "ELSIF", "ELSE_IF")


class StatementReader:
    """Reads statements into the open blocks of a task."""

    def __init__(self, frames: FrameStack, kind: TaskKind) -> None:
        self._frames = frames
        self._kind = kind

    def read(self, cursor: Cursor) -> None:
        """Read one statement; raises SyntaxFaultError."""
        token = cursor.current
        if token.kind is TokenKind.WORD:
            self._refuse_misspelt(cursor)
            if token.text == "IF":
                return self._if(cursor)
            if token.text == "FOR":
                return self._for(cursor)
            if token.text == "NEXT":
                return self._next(cursor)
            if token.text == "ELSE":
                return self._frames.begin_else(cursor, cursor.advance().span)
            if token.text == "END_IF":
                cursor.advance()
                return self._frames.end_if(cursor, token.span)
        return self._frames.add(self._simple(cursor))

    def recover(self, cursor: Cursor, start: int) -> None:
        """Move past a statement that could not be read, and open or close the block that was meant."""
        first = cursor.tokens[start]
        failed, cursor.position = cursor.position, start
        word = first.text if first.kind is TokenKind.WORD else ""
        if word == "IF":
            self._recover_if(cursor, first, failed)
            return
        following = cursor.following
        assigns = following.kind is TokenKind.OPERATOR
        cursor.skip_statement()
        if word == "FOR" or (word and not assigns and _is_meant(word, "FOR")):
            self._frames.open_wrong("FOR", first.span, doubtful=word != "FOR")
        elif word in ("ENDIF", "ENDFI") or (word == "END" and following.text == "IF"):
            self._frames.close_quietly("END_IF", first.span)
        elif word in _ELSE_IF or (word == "ELSE" and not following.kind.ends_statement):
            self._frames.close_quietly("ELSE", first.span)
            cursor.skip_line()
        elif word == "NEXT":
            self._frames.close_quietly("NEXT", first.span)
        elif word and not assigns:
            for end in ("ELSE", "END_IF", "NEXT"):
                if _is_meant(word, end):
                    self._frames.close_quietly(end, first.span)

    def _recover_if(self, cursor: Cursor, first: Token, failed: int) -> None:
        """Decide by the rest of its line whether a wrong IF begins a block, and open it."""
        assigns = cursor.tokens[failed].is_name and cursor.tokens[min(failed + 1, len(cursor.tokens) - 1)].text == "="
        texts = []
        while not cursor.at_end():
            texts.append(cursor.advance().text)
        if texts[-1] == "THEN":
            self._frames.open_wrong("IF", first.span, doubtful=texts.count("THEN") > 1)
            return
        if "THEN" not in texts and not assigns and STATEMENT_WORDS.isdisjoint(texts[1:]):
            self._frames.open_wrong("IF", first.span, doubtful=True)
        cursor.skip_line()

    def _refuse_misspelt(self, cursor: Cursor) -> None:
        refuse_word(cursor, self._kind)
        word = cursor.current.text
        if cursor.following.text == "=":
            return
        if word == "ENDIF" or (word == "END" and cursor.following.text == "IF"):
            cursor.fail("AMX0053", "the end of an IF is written END_IF", "write END_IF as one word with `_`")
        if word in _ELSE_IF or (word == "ELSE" and not cursor.following.kind.ends_statement):
            hint = "write a second IF on the next line and close it with an END_IF of its own"
            cursor.fail("AMX0059", "ELSE stands alone on its line in the block form of IF", hint)

    def _simple(self, cursor: Cursor) -> Statement:
        start = cursor.position
        token = cursor.current
        read = self._reader(cursor) if token.kind is TokenKind.WORD else None
        if read is not None:
            statement = read(cursor, cursor.advance())
        elif token.kind is TokenKind.NAME or (token.kind is TokenKind.WORD and _assigns(cursor)):
            _check_glued_remark(cursor)
            statement = assignment(cursor)
        else:
            refuse_statement(cursor)
        return dataclasses.replace(statement, span=_span(cursor, start))

    def _reader(self, cursor: Cursor) -> Callable[[Cursor, Token], Statement] | None:
        """Return the reader of the statement that a word begins, None where the word names a variable or nothing."""
        word = cursor.current.text
        table = _STATEMENTS[self._kind]
        if word in RESERVED_WORDS:
            return table.get(word)
        if cursor.following.text == "=" or (
            cursor.following.text in ("(", "[") and _assigned_behind_parenthesis(cursor)
        ):
            return None
        return table.get(word)

    def _if(self, cursor: Cursor) -> None:
        start = cursor.position
        condition = self._condition(cursor)
        if cursor.at_end():
            self._frames.open(cursor, If(condition, ()), _span(cursor, start))
            return
        statement = self._one_line(cursor, start, condition, 1)
        cursor.expect_end()
        self._frames.add(statement)

    def _condition(self, cursor: Cursor) -> Expression:
        cursor.advance()
        condition = expression(cursor)
        if cursor.at("="):
            cursor.fail("AMX0040", "a value is missing before `=`")
        cursor.expect("THEN", "AMX0050", f"THEN is missing before {cursor.found()}")
        return condition

    def _one_line(self, cursor: Cursor, start: int, condition: Expression, depth: int) -> If:
        if self._frames.depth + depth > NESTING_LIMIT:
            raise SyntaxFaultError(too_deep("IF"), cursor.tokens[start].span)
        then = self._branch(cursor, depth)
        otherwise: tuple[Statement, ...] = ()
        if cursor.accept("ELSE"):
            otherwise = self._branch(cursor, depth)
        return If(condition, then, otherwise, True, span=_span(cursor, start))

    def _branch(self, cursor: Cursor, depth: int) -> tuple[Statement, ...]:
        """Read a branch after THEN or ELSE on one line: a line number, or statements up to ELSE or the end."""
        statements: list[Statement] = []
        while True:
            statements.append(self._branch_statement(cursor, depth))
            if cursor.at_separator():
                if cursor.following.kind is TokenKind.END:
                    return tuple(statements)
                cursor.advance()
                if cursor.current.kind is TokenKind.REMARK or cursor.at("ELSE"):
                    return tuple(statements)
            elif cursor.at("ELSE"):
                return tuple(statements)
            else:
                cursor.expect_end()
                return tuple(statements)

    def _branch_statement(self, cursor: Cursor, depth: int) -> Statement:
        token = cursor.current
        start = cursor.position
        if cursor.at_end():
            cursor.fail("AMX0036", f"a statement is missing after {cursor.previous.text}")
        if token.kind is TokenKind.INTEGER and token.text.isdigit() and isinstance(token.value, int):
            cursor.advance()
            return Goto(token.value, span=token.span)
        if token.kind is TokenKind.WORD:
            self._refuse_behind_then(cursor)
        if token.text == "IF":
            condition = self._condition(cursor)
            if cursor.at_end():
                cursor.fail("AMX0060", "a block IF cannot stand after THEN", "give it a line of its own")
            return self._one_line(cursor, start, condition, depth + 1)
        return self._simple(cursor)

    def _refuse_behind_then(self, cursor: Cursor) -> None:
        word = cursor.current.text
        if word in _BLOCK_WORDS and cursor.following.text != "=":
            hint = "put nothing after THEN and the statements on separate lines, closed by END_IF"
            cursor.fail("AMX0060", f"{word} cannot stand after THEN on one line", hint)
        refuse_word(cursor, self._kind)

    def _for(self, cursor: Cursor) -> None:
        start = cursor.position
        cursor.advance()
        form = "FOR variable = first TO last [STEP step]"
        control = variable(cursor, "FOR")
        if cursor.at("(", "["):
            cursor.fail("AMX0077", "FOR needs a simple variable, not an array element")
        cursor.expect("=", "AMX0035", f"`=` is missing after FOR {control.name[:20]}", form)
        first = expression(cursor)
        hint = (did_you_mean(cursor.current.text, ("TO",)) or form) if cursor.current.kind is TokenKind.WORD else form
        cursor.expect("TO", "AMX0061", f"TO is missing before {cursor.found()}", hint)
        last = expression(cursor)
        step = expression(cursor) if cursor.accept("STEP") else None
        if cursor.current.kind is TokenKind.WORD and step is None:
            near = did_you_mean(cursor.current.text, ("STEP",))
            cursor.fail("AMX0036", f"{cursor.found()} is not expected here", near)
        cursor.expect_end()
        self._frames.open(cursor, For(control, first, last, step, ()), _span(cursor, start))

    def _next(self, cursor: Cursor) -> None:
        start = cursor.advance()
        if cursor.at_end():
            cursor.fail("AMX0057", "NEXT needs the variable of its FOR", "NEXT I%")
        control = variable(cursor, "NEXT")
        if cursor.at(","):
            cursor.fail("AMX0057", "NEXT ends one loop", "write a NEXT for each FOR")
        cursor.expect_end()
        self._frames.next(cursor, control, start.span)


def _span(cursor: Cursor, start: int) -> Span:
    """Return the span from a token to the last read one on the same physical line."""
    first = cursor.tokens[start].span
    index = max(cursor.position - 1, start)
    if cursor.tokens[index].span.line != first.line:
        index = start
        while cursor.tokens[index + 1].span.line == first.line:
            index += 1
    return first.to(cursor.tokens[index].span)


def _assigns(cursor: Cursor) -> bool:
    """Return whether a word is the name of a REAL variable that is assigned, or an element of a REAL array."""
    if cursor.current.text in RESERVED_WORDS:
        return False
    if cursor.following.text not in ("(", "["):
        return cursor.following.text == "="
    inside = cursor.tokens[cursor.position + 2 : cursor.position + 4]
    if len(inside) < 2 or inside[0].kind is not TokenKind.WORD or inside[1].text != "=":
        return True
    return _assigned_behind_parenthesis(cursor)


def _assigned_behind_parenthesis(cursor: Cursor) -> bool:
    """Return whether `=` follows the closing parenthesis: else NAME(WORD = ... is a block without its CALL."""
    depth = 0
    for index in range(cursor.position + 1, len(cursor.tokens) - 1):
        token = cursor.tokens[index]
        depth += (token.text in ("(", "[")) - (token.text in (")", "]"))
        if depth == 0:
            return cursor.tokens[index + 1].text == "="
        if token.kind.ends_segment:
            break
    return False


def _check_glued_remark(cursor: Cursor) -> None:
    text = cursor.current.text
    if text.endswith("!") and text[:-1] in STATEMENT_WORDS and cursor.following.text not in ("=", "(", "["):
        hint = f"put a blank between {text[:-1]} and the `!` of a remark"
        cursor.fail("AMX0035", f"`=` is missing: `{text}` is read as a DOUBLE INTEGER variable", hint)


def _is_meant(word: str, meant: str) -> bool:
    hint = did_you_mean(word, STATEMENT_WORDS)
    return word not in STATEMENT_WORDS and hint == f"did you mean {meant}?"


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
            if cursor.current.kind is TokenKind.REMARK:
                token = cursor.advance()
                self._frames.add(Remark(str(token.value), token.text == "!", span=token.span))
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
