"""CALL of a control block (3.1)."""

from __future__ import annotations

from automax_ros.core.diagnostics import Note
from automax_ros.language.syntax.cursor import Cursor
from automax_ros.language.syntax.expressions import expression
from automax_ros.language.syntax.tokens import Kind, Token
from automax_ros.language.syntax.tree import Argument, Call


def call(cursor: Cursor, start: Token) -> Call:
    """Read block(KEYWORD = value, ...)."""
    if cursor.current.kind is not Kind.WORD:
        cursor.fail("AMX0070", f"{start.text} needs the name of a block, not {cursor.found()}")
    block = cursor.advance()
    if not cursor.at("("):
        hint = f"CALL {block.text[:20]}(INPUT = ..., OUTPUT = ...)"
        if cursor.current.kind is Kind.WORD:
            hint = f"names of blocks have no blanks: CALL {block.text[:20]}_{cursor.current.text[:20]}("
        cursor.fail("AMX0070", f"`(` is missing after {block.text[:20]}", hint)
    opening = cursor.advance()
    arguments: list[Argument] = []
    if not cursor.accept(")"):
        arguments.append(_argument(cursor))
        while not cursor.accept(")"):
            _expect_comma(cursor, opening)
            arguments.append(_argument(cursor))
    return Call(block.text, tuple(arguments))


def _argument(cursor: Cursor) -> Argument:
    key = cursor.current
    if cursor.at(")"):
        cursor.fail("AMX0070", "a parameter is missing between `,` and `)`", "remove the comma")
    if key.kind is Kind.END:
        cursor.fail("AMX0042", "`)` is missing at the end of the parameters", "a line that goes on ends with `&`")
    if key.kind is not Kind.WORD:
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
    return Argument(key.text, value, span=key.span.to(value.span))


def _expect_comma(cursor: Cursor, opening: Token) -> None:
    if cursor.accept(","):
        return
    note = (Note("the parameters begin here", opening.span),)
    if cursor.current.kind is Kind.WORD and cursor.following.text == "=":
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    if cursor.at_end():
        cursor.fail("AMX0042", "`)` is missing at the end of the parameters", "a line that goes on ends with `&`", note)
    cursor.fail("AMX0071", f"a comma or `)` is missing before {cursor.found()}", None, note)
