"""What PRINT prints."""

from __future__ import annotations

from automax_ros.language.syntax.cursor import Cursor
from automax_ros.language.syntax.expressions import expression
from automax_ros.language.syntax.tokens import Kind
from automax_ros.language.syntax.tree import Expression, Print


def print_items(cursor: Cursor) -> Print:
    """Read items with `,` or `;` between them, to the end of the statement."""
    if cursor.at("USING"):
        cursor.fail("AMX0032", "PRINT USING is not part of the language", "print the values as they are")
    items: list[Expression] = []
    separators: list[str] = []
    while not cursor.at_end() and not cursor.at("ELSE"):
        items.append(expression(cursor))
        if cursor.at(",", ";"):
            separators.append(cursor.advance().text)
            continue
        separators.append("")
        named = cursor.current.is_name and not cursor.at("ELSE", "REM")
        if named or cursor.current.kind is Kind.STRING:
            cursor.fail("AMX0071", f"`,` or `;` is missing before {cursor.found()}")
        break
    return Print(tuple(items), tuple(separators))
