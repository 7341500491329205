"""The line number that a jump names."""

from __future__ import annotations

from automax_ros.language.syntax.cursor import Cursor
from automax_ros.language.syntax.tokens import Kind


def line_number(cursor: Cursor, word: str) -> int:
    """Read the line number that a jump names."""
    token = cursor.current
    if token.kind is not Kind.INTEGER or not token.text.isdigit() or not isinstance(token.value, int):
        cursor.fail("AMX0062", f"{word} needs a line number, not {cursor.found()}")
    cursor.advance()
    cursor.reporter.report_token(token)
    return token.value
