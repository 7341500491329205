"""Parses the simple statements: all but IF, FOR and their ends; among them CALL of a control block (3.1)."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.diagnostics import Note
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.declarations import declaration, event, event_word
from automax_ros.language.parse.expressions import constant, expression, target
from automax_ros.language.text.tokens import Token, TokenKind
from automax_ros.language.tree import tree


def call(cursor: Cursor, start: Token) -> tree.Call:
    """Read block(KEYWORD = value, ...), after CALL."""
    if cursor.current.kind is not TokenKind.WORD:
        cursor.fail("AMX0070", f"{start.text} needs the name of a block, not {cursor.found()}")
    block = cursor.advance()
    if not cursor.at("("):
        hint = f"CALL {block.text[:20]}(INPUT = ..., OUTPUT = ...)"
        if cursor.current.kind is TokenKind.WORD:
            hint = f"names of blocks have no blanks: CALL {block.text[:20]}_{cursor.current.text[:20]}("
        cursor.fail("AMX0070", f"`(` is missing after {block.text[:20]}", hint)
    opening = cursor.advance()
    arguments: list[tree.Argument] = []
    if not cursor.accept(")"):
        arguments.append(_argument(cursor))
        while not cursor.accept(")"):
            _expect_comma(cursor, opening)
            arguments.append(_argument(cursor))
    return tree.Call(block.text, tuple(arguments))


def _argument(cursor: Cursor) -> tree.Argument:
    key = cursor.current
    if cursor.at(")"):
        cursor.fail("AMX0070", "a parameter is missing between `,` and `)`", "remove the comma")
    if key.kind is TokenKind.END:
        cursor.fail("AMX0042", "`)` is missing at the end of the parameters", "a line that goes on ends with `&`")
    if key.kind is not TokenKind.WORD:
        hint = f"write KEYWORD = {key.text[:20]}" if key.is_name else None
        cursor.fail("AMX0070", f"a parameter begins with its keyword, not with {cursor.found()}", hint)
    cursor.advance()
    if not cursor.at("="):
        if cursor.at(",", ")"):
            hint = f"write KEYWORD = {key.text[:20]}"
            cursor.fail("AMX0070", f"`=` and a value are missing after {key.text[:20]}", hint)
        cursor.fail("AMX0035", f"`=` is missing after {key.text[:20]}")
    cursor.advance()
    value = expression(cursor)
    return tree.Argument(key.text, value, span=key.span.to(value.span))


def _expect_comma(cursor: Cursor, opening: Token) -> None:
    if cursor.accept(","):
        return
    note = (Note("the parameters begin here", opening.span),)
    if cursor.current.kind is TokenKind.WORD and cursor.following.text == "=":
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    if cursor.at_end():
        cursor.fail("AMX0042", "`)` is missing at the end of the parameters", "a line that goes on ends with `&`", note)
    cursor.fail("AMX0071", f"a comma or `)` is missing before {cursor.found()}", None, note)


def line_number(cursor: Cursor, word: str) -> int:
    """Read the line number that a jump names."""
    token = cursor.current
    if token.kind is not TokenKind.INTEGER or not token.text.isdigit() or not isinstance(token.value, int):
        cursor.fail("AMX0062", f"{word} needs a line number, not {cursor.found()}")
    cursor.advance()
    cursor.reporter.report_token(token)
    return token.value


def print_items(cursor: Cursor) -> tree.Print:
    """Read items with `,` or `;` between them, to the end of the statement."""
    if cursor.at("USING"):
        cursor.fail("AMX0032", "PRINT USING is not part of the language", "print the values as they are")
    items: list[tree.Expression] = []
    separators: list[str] = []
    while not cursor.at_end() and not cursor.at("ELSE"):
        items.append(expression(cursor))
        if cursor.at(",", ";"):
            separators.append(cursor.advance().text)
            continue
        separators.append("")
        named = cursor.current.is_name and not cursor.at("ELSE", "REM")
        if named or cursor.current.kind is TokenKind.STRING:
            cursor.fail("AMX0071", f"`,` or `;` is missing before {cursor.found()}")
        break
    return tree.Print(tuple(items), tuple(separators))


def assignment(cursor: Cursor) -> tree.Assignment:
    """Read target = value; LET has already been read."""
    left = target(cursor, "an assignment")
    if not cursor.at("="):
        hint = "names have no blanks" if cursor.current.is_name else None
        cursor.fail("AMX0035", f"`=` is missing: {cursor.found()} stands where it should be", hint)
    cursor.advance()
    return tree.Assignment(left, expression(cursor))


def _on(cursor: Cursor, start: Token) -> tree.OnJump:
    if cursor.at("ERROR"):
        cursor.fail("AMX0032", "ON ERROR is not part of the language", "test the error log with TST_ERRLOG@")
    selector = expression(cursor)
    if not cursor.at("GOTO", "GOSUB"):
        cursor.fail("AMX0063", f"GOTO or GOSUB is missing after {start.text}", "ON value GOTO line, line, ...")
    word = cursor.advance().text
    lines = cursor.separated(lambda: line_number(cursor, word))
    if cursor.current.kind is TokenKind.INTEGER:
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    return tree.OnJump(selector, lines, word == "GOSUB")


def _restore(cursor: Cursor, start: Token) -> tree.Restore:
    return tree.Restore() if cursor.at_end() or cursor.at("ELSE") else tree.Restore(line_number(cursor, start.text))


def _print(cursor: Cursor, _start: Token) -> tree.Print:
    if cursor.at("#", ":"):
        hint = "PRINT without # writes to the task's log"
        cursor.fail("AMX0031", "PRINT to a port or channel belongs to BASIC tasks: it can suspend the task", hint)
    return print_items(cursor)


def _io_write(cursor: Cursor, start: Token) -> tree.IoWrite:
    form = f"a comma is missing: {start.text} slot, register, value"
    slot = expression(cursor)
    cursor.expect(",", "AMX0071", form)
    register = expression(cursor)
    cursor.expect(",", "AMX0071", form)
    return tree.IoWrite(slot, register, expression(cursor))


SIMPLE_STATEMENTS: dict[str, Callable[[Cursor, Token], tree.Statement]] = {
    "LET": lambda cursor, _: assignment(cursor),
    "GOTO": lambda cursor, start: tree.Goto(line_number(cursor, start.text)),
    "GOSUB": lambda cursor, start: tree.Gosub(line_number(cursor, start.text)),
    "ON": _on,
    "RETURN": lambda _, __: tree.Return(),
    "STOP": lambda _, __: tree.Stop(),
    "END": lambda _, __: tree.End(),
    "CLR_ERRLOG": lambda _, __: tree.ClearErrorLog(),
    "READ": lambda cursor, start: tree.Read(cursor.separated(lambda: target(cursor, start.text))),
    "DATA": lambda cursor, start: tree.Data(cursor.separated(lambda: constant(cursor, start.text))),
    "RESTORE": _restore,
    "PRINT": _print,
    "IOWRITE": _io_write,
    "LOCAL": declaration,
    "COMMON": declaration,
    "GLOBAL": declaration,
    "EVENT": event,
    "CALL": call,
    "SET": lambda cursor, _: tree.SetEvent(event_word(cursor)),
}
"""The parser of each simple statement, called after its first word; SET may also be the name of a variable."""
