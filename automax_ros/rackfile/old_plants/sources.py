"""Makes task sources of an old plant acceptable: replaces remnants of DOS editors and older Executives, in place.

Line numbers stay, and so does the number of lines, but for include files, which are written into the task. Text that is
not understood is not changed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.text import count_of
from automax_ros.core.types import MAX_STRING_LENGTH
from automax_ros.language.text.constants import STRING_LIMIT
from automax_ros.language.text.lexer import END_OF_FILE, LineReader
from automax_ros.language.text.reporter import Reporter, TooManyProblemsError
from automax_ros.language.text.tokens import Token, TokenKind
from automax_ros.rackfile.old_plants.decoding import ONE_BYTE, decoded
from automax_ros.rackfile.old_plants.includes import Included, ReadInclude, with_includes

Check = Callable[[str], Iterable[Diagnostic]]
"""Returns the diagnostics of a task's text."""
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f]")
_WHOLE_NUMBER = re.compile(r"([-+ \t]*[0-9]+)([Ee][-+]?[0-9]+)?")
_PRINT = re.compile(r"[ ]*[0-9]+[ ]+PRINT(?![A-Z0-9_%!@$])")
_LENGTH = re.compile(r"(\$)[ \t]*:[ \t]*([0-9]+)")
_TAB = 8
"""Columns from one tab stop to the next, as DOS has them."""
_MOST_ROUNDS = 50
"""Most passes over a text until nothing changes any more (decision: a bound on untrusted texts)."""
_Cure = Callable[[str, str], str | None]


@dataclass(frozen=True)
class Converted:
    """A source before and after its conversion: texts, and ``data``, the bytes to store; ``notes`` list the changes.

    Lines of ``before`` end like those of ``after``, so that the two can be compared line by line. ``refused`` says
    which include files are not in it, and why.
    """

    before: str
    after: str
    data: bytes
    notes: tuple[str, ...]
    refused: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether anything changed, ends of lines included."""
        return bool(self.notes)


def convert(data: bytes, check: Check, read_include: ReadInclude | None = None, code_page: str = ONE_BYTE) -> Converted:
    """Return a source made acceptable; ``check`` finds what is left to change, ``read_include`` reads include files.

    UTF-16, and a text of a ``code_page`` that is given, become UTF-8; a byte order mark, and Ctrl-Z with all that
    follows, where DOS stops reading, are left out; CR LF and CR become LF. Control characters become blanks. Outside of
    texts between quotes tabs become blanks up to the next multiple of 8 columns, and, outside of remarks, lower case
    becomes upper case. REAL constants of blocks get their decimal point, lengths of strings above 255 become 255 and a
    length of 0, which meant the default, is removed; a text of PRINT with more than 132 characters is printed in parts
    (decision: what an old Executive took, and the file of a DOS editor).
    """
    text, encoding, notes = decoded(data, code_page)
    text, end, rest = text.partition(END_OF_FILE)
    if end:
        notes.append(f"Ctrl-Z and the {count_of(len(rest), 'character')} after it left out")
    ends = text.count("\r\n") + text.replace("\r\n", "").count("\r")
    before = text.replace("\r\n", "\n").replace("\r", "\n")
    if ends:
        notes.append(f"{count_of(ends, 'line end')} written as LF")
    counts: Counter[str] = Counter()
    included = Included(before) if read_include is None else with_includes(before, read_include)
    notes += [f"{name} written in place of its INCLUDE" for name in included.files]
    after = included.text
    for _ in range(_MOST_ROUNDS):
        changed = _with_constants(_in_upper_case(_without_control(after, counts), counts), check, counts)
        if changed == after:
            break
        after = changed
    notes += [count_of(number, thing) for thing, number in counts.items()]
    return Converted(before, after, _encoded(after, encoding), tuple(notes), tuple(included.refused))


def _encoded(text: str, encoding: str) -> bytes:
    """Return a text as bytes; in UTF-8 where an include file has letters that its own encoding lacks."""
    try:
        return text.encode(encoding)
    except UnicodeEncodeError:
        return text.encode()


def _without_control(text: str, counts: Counter[str]) -> str:
    lines = text.split("\n")
    quoted, _ = _ranges(text)
    for row, line in enumerate(lines):
        if _CONTROL.search(line) or "\t" in line:
            lines[row] = _plain(line, quoted.get(row, []), counts)
    return "\n".join(lines)


def _plain(line: str, quoted: list[range], counts: Counter[str]) -> str:
    result: list[str] = []
    width = 0
    for column, char in enumerate(line):
        text = char
        if _CONTROL.match(char):
            text = " "
            counts["control character"] += 1
        elif char == "\t" and not any(column in part for part in quoted):
            text = " " * (_TAB - width % _TAB)
            counts["tab"] += 1
        result.append(text)
        width += len(text)
    return "".join(result)


def _in_upper_case(text: str, counts: Counter[str]) -> str:
    lines = text.split("\n")
    quoted, remarks = _ranges(text)
    for row, line in enumerate(lines):
        if line == line.upper():
            continue
        kept = quoted.get(row, []) + remarks.get(row, [])
        upper = "".join(
            char.upper() if char.isascii() and not any(column in part for part in kept) else char
            for column, char in enumerate(line)
        )
        if upper != line:
            counts["lower-case line"] += 1
            lines[row] = upper
    return "\n".join(lines)


def _ranges(text: str) -> tuple[dict[int, list[range]], dict[int, list[range]]]:
    """Return, by row from 0, the columns of texts between quotes, and those of remarks without their first word."""
    quoted: dict[int, list[range]] = {}
    remarks: dict[int, list[range]] = {}
    rows = text.split("\n")
    for tokens, last_row in _logical_lines(text):
        for token in tokens:
            row = token.line - 1
            if token.kind is TokenKind.STRING or (token.fault is not None and token.fault.code == "AMX0020"):
                quoted.setdefault(row, []).append(range(token.column - 1, token.end_column - 1))
            elif token.kind is TokenKind.REMARK:
                first = token.column - 1 + len(token.text)
                remarks.setdefault(row, []).append(range(first, len(rows[row])))
                for after in range(row + 1, last_row + 1):
                    remarks.setdefault(after, []).append(range(len(rows[after])))
    return quoted, remarks


def _logical_lines(text: str) -> Iterable[tuple[list[Token], int]]:
    """Return the tokens of each numbered line, and the row from 0 on which it ends, as far as they can be read."""
    try:
        for line in LineReader(SourceText("", text), _Silent()):
            yield line.tokens, line.tokens[-1].line - 1
    except TooManyProblemsError:  # pragma: no cover - a silent reporter has no limit
        return


class _Silent(Reporter):
    """Discards the diagnostics of a text."""

    def report(self, *_: object) -> None:
        """Discard a diagnostic."""


def _with_constants(text: str, check: Check, counts: Counter[str]) -> str:
    lines = text.split("\n")
    found = [item for item in check(text) if item.code in _CURES]
    for item in sorted(found, key=lambda item: item.span, reverse=True):
        row, start, end = item.span.line - 1, item.span.column - 1, item.span.end_column - 1
        thing, cure = _CURES[item.code]
        cured = cure(lines[row][start:end], lines[row][:start])
        if cured is not None:
            lines[row] = lines[row][:start] + cured + lines[row][end:]
            counts[thing] += 1
    return "\n".join(lines)


def _with_point(constant: str, _: str) -> str | None:
    match = _WHOLE_NUMBER.fullmatch(constant)
    return None if match is None else f"{match[1]}.0{match[2] or ''}"


def _with_length(declared: str, _: str) -> str | None:
    match = _LENGTH.search(declared)
    if match is None:
        return None
    length = "" if not int(match[2][:9]) else f":{MAX_STRING_LENGTH}"
    return declared[: match.start()] + match[1] + length + declared[match.end() :]


def _in_parts(constant: str, before: str) -> str | None:
    """Return a long text of PRINT as several, each printed directly after the last; other texts cannot be divided."""
    if not _PRINT.match(before):
        return None
    quote, text = constant[0], constant[1:-1]
    parts = (text[place : place + STRING_LIMIT] for place in range(0, len(text), STRING_LIMIT))
    return "; ".join(f"{quote}{part}{quote}" for part in parts)


_CURES: dict[str, tuple[str, _Cure]] = {
    "AMX0021": ("text in parts", _in_parts),
    "AMX2016": ("decimal point", _with_point),
    "AMX4008": ("string length", _with_length),
}
"""Changes by the problem's code of the check: made from the text at fault and the text before it."""
