"""Splits characters into tokens, one physical line at a time, and joins physical lines to logical ones.

The time is linear in the length of the line, whatever its content. A `!` directly after a name is its type character,
otherwise it begins a remark; lower case is read as upper case (decisions).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Note, SourceText, Span
from automax_ros.core.text import printable
from automax_ros.language.text.constants import hexadecimal_fault, integer_value, real_fault, string_fault
from automax_ros.language.text.reporter import Reporter
from automax_ros.language.text.tokens import OPERATOR_WORDS, STATEMENT_WORDS, SourceFault, Token, TokenKind

BLANKS = " \t\f"
_TOKEN = re.compile(
    r"""
      (?P<blank>[ \t\f]+)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*[%!@$]?)
    | (?P<hex>[0-9][0-9A-Fa-f]*[Hh](?![A-Za-z0-9_.]))
    | (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[Ee][+-]?[0-9]+)?)
    | (?P<string>"[^"]*"|'[^']*')
    | (?P<foreign>==|=[ \t]*[<>]|&&|\|\||:=|\^|\+\+|<<|>>)
    | (?P<operator>\*\*|<[ \t]*[>=]|>[ \t]*[<=]|[-+*/=<>])
    | (?P<mark>[()\[\],;:\#])
    | (?P<separator>\\)
    """,
    re.VERBOSE,
)
_WORD_TAIL = re.compile(r"[A-Za-z0-9_.]*")
_STRANGE = re.compile(r"[^\x20-\x7e\t\f]+")
_FOREIGN = {
    "==": "equality is written `=`",
    "=<": "write `<=`",
    "=>": "write `>=`",
    "&&": "write AND",
    "||": "write OR",
    ":=": "an assignment is written `=`",
    "^": "a power is written `**`, an exclusive or XOR",
    "++": "write A% = A% + 1",
    "<<": "write SHIFTL%(value, places)",
    ">>": "write SHIFTR%(value, places)",
    "!=": "`not equal` is written `<>`",
}
_PLAIN = {"mark": TokenKind.MARK, "separator": TokenKind.SEPARATOR}
TYPE_CHARACTERS = "%!@$"
BROKEN_END = "&!"
"""Text of an ERROR token after which the statement still continues in the next line."""


class LineLexer:
    """Splits physical lines into tokens and stores the place of the first lower-case letter of the text."""

    def __init__(self) -> None:
        self.lower_case: Span | None = None

    def tokens(self, text: str, line: int, start: int, offset: int) -> list[Token]:
        """Return the tokens of ``text`` from index ``start`` on.

        ``line`` counts from 1; ``offset`` is the number of characters that the logical line has before this line.
        A ``&`` at the end becomes a CONTINUE token; the ``&`` that ends a remark stays in the remark's value.
        """
        result: list[Token] = []
        position, length = start, len(text)
        match_at = _TOKEN.match
        while position < length:
            match = match_at(text, position)
            if match is None:
                token = self._other(text, Span(line, position + 1, position + 2), result)
                result.append(token._replace(offset=offset + position))
                position = token.end_column - 1
                continue
            group, end = match.lastgroup, match.end()
            kind = _PLAIN.get(group or "")
            if kind is not None:
                result.append(Token(kind, match.group(), line, position + 1, end + 1, offset + position))
            elif group != "blank":
                token = self._token(match, line, result)
                result.append(token._replace(offset=offset + position))
                end = token.end_column - 1
            position = end
        return result

    def remark(self, text: str, line: int, start: int, mark: str) -> Token:
        """Return the remark from index ``start`` to the end of the line; its text begins after ``mark``."""
        body = text[start + len(mark) :].strip(BLANKS)
        end = len(text.rstrip(BLANKS))
        return Token(TokenKind.REMARK, mark.upper(), line, start + 1, max(end, start + 1) + 1, value=body)

    def _token(self, match: re.Match[str], line: int, before: list[Token]) -> Token:
        group, text = match.lastgroup, match.group()
        column, end_column = match.start() + 1, match.end() + 1
        if group == "name":
            return self._name(match, line, before)
        if group == "operator":
            sign = text if len(text) == 1 else text[0] + text[-1]
            return Token(TokenKind.OPERATOR, "<>" if sign == "><" else sign, line, column, end_column)
        if group == "string":
            return Token(
                TokenKind.STRING, text, line, column, end_column, value=text[1:-1], fault=string_fault(text[1:-1])
            )
        if group == "foreign":
            return _foreign(text[0] + text[-1] if len(text) > 1 else text, Span(line, column, end_column))
        return self._number(match, Span(line, column, end_column))

    def _name(self, match: re.Match[str], line: int, before: list[Token]) -> Token:
        text = match.group()
        upper = text.upper()
        column, end_column = match.start() + 1, match.end() + 1
        if upper != text:
            self._saw_lower(text, Span(line, column, end_column))
        if upper == "REM" and _begins_statement(before):
            return self.remark(match.string, line, match.start(), text)
        return Token(
            TokenKind.NAME if upper[-1] in TYPE_CHARACTERS else TokenKind.WORD, upper, line, column, end_column
        )

    def _number(self, match: re.Match[str], span: Span) -> Token:
        text, source, end = match.group(), match.string, match.end()
        place = (span.line, span.column, span.end_column)
        tail = _WORD_TAIL.match(source, end)
        if tail is not None and tail.group():
            return _bad_number(text, tail.group(), Span(span.line, span.column, tail.end() + 1))
        upper = text.upper()
        if upper != text:
            self._saw_lower(text, span)
        if match.lastgroup == "hex":
            value, fault = hexadecimal_fault(upper)
            return Token(TokenKind.INTEGER, upper, *place, value=value, fault=fault)
        if upper.isdigit():
            value, fault = integer_value(upper)
            return Token(TokenKind.INTEGER, upper, *place, value=value, fault=fault)
        return Token(TokenKind.REAL, upper, *place, value=float(upper), fault=real_fault(upper))

    def _other(self, text: str, here: Span, before: list[Token]) -> Token:
        position = here.column - 1
        char = text[position]
        if char == "!":
            unequal = text[position : position + 2] == "!=" and text[position + 2 : position + 3] != "="
            if unequal and not _begins_statement(before):
                return _foreign("!=", Span(here.line, position + 1, position + 3))
            return self.remark(text, here.line, position, "!")
        if char == "&":
            return _ampersand(text, here)
        if char in "\"'":
            return _open_string(text, here)
        if char in "%@$" and before and before[-1].is_name:
            name = before[-1]
            hint = f"write {name.text[:40]}{char} without a blank" if name.kind is TokenKind.WORD else None
            return _error(char, here, "AMX0029", f"the type character `{char}` is apart from its name", hint)
        strange = _STRANGE.match(text, position)
        if strange is not None:
            here = Span(here.line, position + 1, strange.end() + 1)
        shown = f"`{char}`" if char.isprintable() else f"with the code {ord(char):02X} hex"
        return _error(char, here, "AMX0004", f"character {shown} has no meaning here", _CHARACTER_HINTS.get(char))

    def _saw_lower(self, text: str, span: Span) -> None:
        if self.lower_case is None:
            first = next(index for index, char in enumerate(text) if char.islower())
            self.lower_case = Span(span.line, span.column + first, span.end_column)


def _begins_statement(before: list[Token]) -> bool:
    return not before or before[-1].kind is TokenKind.SEPARATOR or before[-1].text in ("THEN", "ELSE")


def _error(text: str, span: Span, code: str, message: str, hint: str | None) -> Token:
    return Token(TokenKind.ERROR, text, span.line, span.column, span.end_column, fault=SourceFault(code, message, hint))


def _foreign(text: str, span: Span) -> Token:
    return _error(text, span, "AMX0038", f"`{text}` is not an operator of this language", _FOREIGN[text])


def _bad_number(text: str, tail: str, span: Span) -> Token:
    word = printable(text[:40] + tail[:40])
    word = word if len(word) <= 40 else word[:40] + "..."
    hint = "put a blank between a number and a word"
    if all(char in "0123456789ABCDEFabcdef" for char in text + tail):
        hint = "a hexadecimal constant ends with H: " + (text + tail)[:40].upper() + "H"
    elif tail[0] == ".":
        hint = "a constant has one decimal point"
    return _error(word, span, "AMX0023", f"`{word}` is not a number", hint)


def _ampersand(text: str, here: Span) -> Token:
    rest = text[here.column : here.column + 200].strip(BLANKS) or text[here.column :].strip(BLANKS)
    if not rest:
        return Token(TokenKind.CONTINUE, "&", here.line, here.column, here.end_column)
    remark = rest[0] == "!"
    hint = "a remark may stand on the statement's first or last line" if remark else "`and` is written AND"
    if rest[0] in "Hh":
        hint = "a hexadecimal constant is written 0FFH"
    # A remark after the `&` shows that a continuation was meant: the statement continues, with this one fault.
    end = len(text) + 1 if remark else here.end_column
    span = Span(here.line, here.column, end)
    return _error(BROKEN_END if remark else "&", span, "AMX0015", "`&` is not the last character of its line", hint)


def _open_string(text: str, here: Span) -> Token:
    quote = text[here.column - 1]
    continues = text.rstrip(BLANKS).endswith("&")
    span = Span(here.line, here.column, len(text) + 1)
    hint = f"end it with {quote} on the same line; a remark begins with `!`"
    return _error(BROKEN_END if continues else quote, span, "AMX0020", "the string is not closed", hint)


_CHARACTER_HINTS = {
    "%": "`%` is the type character of an INTEGER and stands directly after a name",
    "@": "`@` is the type character of a BOOLEAN and stands directly after a name",
    "$": "`$` is the type character of a STRING and stands directly after a name",
    "?": "write PRINT",
    "|": "write OR",
    "~": "write NOT",
    "{": "subscripts stand in ( ) or [ ]",
    "}": "subscripts stand in ( ) or [ ]",
    ".": "a real constant needs a digit: 0.5",
    "`": "strings stand in \" or '",
    "\N{LEFT DOUBLE QUOTATION MARK}": "strings stand in \" or '",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "strings stand in \" or '",
    "\N{LEFT SINGLE QUOTATION MARK}": "strings stand in \" or '",
    "\N{RIGHT SINGLE QUOTATION MARK}": "strings stand in \" or '",
    "\N{EN DASH}": "a minus sign is `-`",
    "\N{MINUS SIGN}": "a minus sign is `-`",
}


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

    Every line begins with a line number, 1 to 32767, in ascending order (decision). A line whose last character is
    ``&`` continues in the next physical line that is not blank, which has no number.

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
        if first.kind is TokenKind.ERROR and first.fault is not None:
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
                if tokens and tokens[-1].kind is TokenKind.REMARK:
                    remark.append(str(tokens[-1].value))
            start = 0
            written = len(text.rstrip(BLANKS))
            end = Span(row, written + 1, written + 2)
            if not self._goes_on(line, remark, nesting, end):
                break
            offset += len(text) + 1
        if remark:
            tokens[-1] = tokens[-1]._replace(value="\n".join(remark))
        tokens.append(Token(TokenKind.END, "", end.line, end.column, end.end_column, offset + written))

    def _goes_on(self, line: LogicalLine, remark: list[str], nesting: _Nesting, end: Span) -> bool:
        last = line.tokens[-1] if line.tokens else None
        following = self._next_written(self._index)
        mark = Span(end.line, max(end.column - 1, 1), end.column)
        if remark:
            continues = remark[-1].endswith("&")
            if continues:
                remark[-1] = remark[-1][:-1].strip(BLANKS)
        else:
            continues = last is not None and (last.kind is TokenKind.CONTINUE or last.text == BROKEN_END)
            if last is not None and last.kind is TokenKind.CONTINUE:
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
            if token.kind is TokenKind.SEPARATOR:
                self._depth, self._first = 0, None
            else:
                self._first = self._first or token
                self._depth += (token.text in ("(", "[")) - (token.text in (")", "]"))
            self._last = token

    @property
    def unfinished(self) -> bool:
        if self._last is None or self._last.kind is TokenKind.REMARK:
            return False
        if self._last.text == ",":
            return self._first is not None and self._first.text != "PRINT"
        return self._depth > 0 or self._last.kind is TokenKind.OPERATOR or self._last.text in OPERATOR_WORDS
