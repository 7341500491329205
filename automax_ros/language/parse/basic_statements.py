"""Parses the statements of events, times, channels and ports after their first word (J-3675 6.6 to 6.8).

No source shows the place of the number in the EMPTY= and FULL= forms; ours is INPUT:EMPTY=line #n, list (decision).
The number after # is a constant, so that a check knows what each one is (decision).
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.text import did_you_mean
from automax_ros.core.types import DataType
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.declarations import event_word
from automax_ros.language.parse.expressions import expression, target
from automax_ros.language.parse.statements import line_number, print_items
from automax_ros.language.text.tokens import Token, TokenKind
from automax_ros.language.tree import tree

_FORM = "AMX4110"
ACCESSES = ("EXCLUSIVE", "NON_EXCLUSIVE")
_OPEN_CHANNEL = "OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I, R), DEPTH = 8"
_OPEN_PORT = 'OPEN "PORTB" AS FILE #1, SETUP = 0D00H, 9600'


def _wait(cursor: Cursor, start: Token) -> tree.WaitOn:
    _word(cursor, "ON", f"ON is missing after {start.text}", "WAIT ON event")
    return tree.WaitOn(event_word(cursor))


def _start(cursor: Cursor, start: Token) -> tree.StartEvery:
    _word(cursor, "EVERY", f"EVERY is missing after {start.text}", "START EVERY 10 SECONDS")
    return tree.StartEvery(expression(cursor), _unit(cursor, "START EVERY"))


def _unit(cursor: Cursor, word: str) -> tree.Unit:
    units = [unit.value for unit in tree.Unit]
    if cursor.current.text not in units:
        hint = did_you_mean(cursor.current.text, units) or f"write {word} 10 TICKS; units are plural"
        cursor.fail(_FORM, f"{word} needs TICKS, SECONDS, MINUTES or HOURS, not {cursor.found()}", hint)
    return tree.Unit(cursor.advance().text)


def _word(cursor: Cursor, word: str, message: str, form: str) -> None:
    near = did_you_mean(cursor.current.text, (word,)) if cursor.current.kind is TokenKind.WORD else None
    cursor.expect(word, _FORM, f"{message}: {cursor.found()} stands there", near or form)


def _file(cursor: Cursor, word: str) -> int:
    """Read # and the number of a channel or port."""
    if not cursor.accept("#"):
        cursor.fail(_FORM, f"{word} needs # and a number, not {cursor.found()}", f"{word} #1, ...")
    token = cursor.current
    if token.kind is not TokenKind.INTEGER or not token.text.isdigit() or not isinstance(token.value, int):
        cursor.fail(_FORM, f"the number after # is an integer constant, not {cursor.found()}")
    cursor.advance()
    cursor.reporter.report_token(token)
    return token.value


def _comma(cursor: Cursor, form: str) -> None:
    cursor.expect(",", "AMX0071", f"a comma is missing before {cursor.found()}", form)


def _open(cursor: Cursor, start: Token) -> tree.Statement:
    if cursor.current.kind is TokenKind.STRING:
        return _open_port(cursor)
    _word(cursor, "CHANNEL", f"{start.text} needs CHANNEL or the name of a port", f"{_OPEN_CHANNEL}, or {_OPEN_PORT}")
    _word(cursor, "FOR", "FOR is missing after CHANNEL", _OPEN_CHANNEL)
    if not cursor.at("INPUT", "OUTPUT"):
        cursor.fail(_FORM, f"a channel is opened FOR INPUT or FOR OUTPUT, not {cursor.found()}", _OPEN_CHANNEL)
    direction = tree.Direction(cursor.advance().text)
    file = _as_file(cursor, _OPEN_CHANNEL)
    _comma(cursor, _OPEN_CHANNEL)
    _key(cursor, "TYPE", _OPEN_CHANNEL)
    types = _types(cursor)
    depth: tree.Expression | None = None
    if direction is tree.Direction.INPUT:
        _comma(cursor, _OPEN_CHANNEL)
        _key(cursor, "DEPTH", _OPEN_CHANNEL)
        depth = expression(cursor)
    return tree.OpenChannel(direction, file, types, depth)


def _open_port(cursor: Cursor) -> tree.OpenPort:
    port = str(cursor.advance().value)
    file = _as_file(cursor, _OPEN_PORT)
    _comma(cursor, _OPEN_PORT)
    if cursor.at("ACCESS"):
        _key(cursor, "ACCESS", _OPEN_PORT)
        if not cursor.at(*ACCESSES):
            hint = did_you_mean(cursor.current.text, ACCESSES)
            cursor.fail(_FORM, f"ACCESS is EXCLUSIVE or NON_EXCLUSIVE, not {cursor.found()}", hint)
        return tree.OpenPort(port, file, access=cursor.advance().text)
    _key(cursor, "SETUP", _OPEN_PORT)
    setup = expression(cursor)
    return tree.OpenPort(port, file, setup, expression(cursor) if cursor.accept(",") else None)


def _as_file(cursor: Cursor, form: str) -> int:
    _word(cursor, "AS", "AS FILE is missing", form)
    _word(cursor, "FILE", "FILE is missing after AS", form)
    return _file(cursor, "AS FILE")


def _key(cursor: Cursor, key: str, form: str) -> None:
    _word(cursor, key, f"{key} is missing", form)
    cursor.expect("=", "AMX0035", f"`=` is missing after {key}", form)


def _types(cursor: Cursor) -> tuple[DataType, ...]:
    hint = "TYPE = (I, D, R, S, B): INTEGER, DOUBLE INTEGER, REAL, string, BOOLEAN"

    def kind() -> DataType:
        if cursor.current.text not in tree.ITEM_TYPES:
            cursor.fail(_FORM, f"{cursor.found()} is not a type of a channel", hint)
        return tree.ITEM_TYPES[cursor.advance().text]

    cursor.expect("(", _FORM, f"the list of TYPE stands in parentheses, {cursor.found()} does not", hint)
    types = cursor.separated(kind)
    cursor.expect(")", _FORM, f"`)` is missing before {cursor.found()}", hint)
    return types


def _branch_line(cursor: Cursor, word: str, key: str) -> int | None:
    if not cursor.accept(":"):
        return None
    form = f"{word}:{key}=100 #1, ..."
    _word(cursor, key, f"{key} is missing after {word}:", form)
    cursor.expect("=", "AMX0035", f"`=` is missing after {key}", form)
    line = line_number(cursor, key)
    cursor.accept(",")
    return line


def _input(cursor: Cursor, start: Token) -> tree.InputFile:
    empty = _branch_line(cursor, start.text, "EMPTY")
    if not cursor.at("#"):
        hint = "open a channel or a port and write INPUT #1, A%"
        cursor.fail(_FORM, f"{start.text} needs # and the number of a channel or port, not {cursor.found()}", hint)
    file = _file(cursor, start.text)
    _comma(cursor, "INPUT #1, A%, B%")
    return tree.InputFile(file, cursor.separated(lambda: target(cursor, start.text)), empty)


def _get(cursor: Cursor, start: Token) -> tree.Get:
    empty = _branch_line(cursor, start.text, "EMPTY")
    file = _file(cursor, start.text)
    _comma(cursor, "GET #1, A$")
    return tree.Get(file, target(cursor, start.text), empty)


def _put(cursor: Cursor, start: Token) -> tree.Put:
    file = _file(cursor, start.text)
    _comma(cursor, "PUT #1, A$")
    return tree.Put(file, expression(cursor))


def _print(cursor: Cursor, start: Token) -> tree.Statement:
    if not cursor.at("#", ":"):
        return print_items(cursor)
    full = _branch_line(cursor, start.text, "FULL")
    file = _file(cursor, start.text)
    if not cursor.accept(","):
        return tree.PrintFile(file, full=full)
    printed = print_items(cursor)
    return tree.PrintFile(file, printed.items, printed.separators, full)


WAITING_STATEMENTS: dict[str, Callable[[Cursor, Token], tree.Statement]] = {
    "WAIT": _wait,
    "DELAY": lambda cursor, start: tree.Delay(expression(cursor), _unit(cursor, start.text)),
    "START": _start,
    "OPEN": _open,
    "CLOSE": lambda cursor, start: tree.Close(_file(cursor, start.text)),
    "INPUT": _input,
    "GET": _get,
    "PUT": _put,
    "PRINT": _print,
}
"""The parser of each statement that only a BASIC task has, called after its first word; PRINT has more forms there."""
