"""Parses the simple statements: all but IF, FOR and their ends; among them CALL of a control block (3.1)."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.diagnostics import Note
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.declarations import declaration, event, event_word
from automax_ros.language.parse.expressions import constant, expression, target
from automax_ros.language.text.tokens import Kind, Token
from automax_ros.language.tree.tree import (
    Argument,
    Assignment,
    Call,
    ClearErrorLog,
    Data,
    End,
    Expression,
    Gosub,
    Goto,
    IoWrite,
    OnJump,
    Print,
    Read,
    Restore,
    Return,
    SetEvent,
    Statement,
    Stop,
)


def call(cursor: Cursor, start: Token) -> Call:
    """Read block(KEYWORD = value, ...), after CALL."""
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


def line_number(cursor: Cursor, word: str) -> int:
    """Read the line number that a jump names."""
    token = cursor.current
    if token.kind is not Kind.INTEGER or not token.text.isdigit() or not isinstance(token.value, int):
        cursor.fail("AMX0062", f"{word} needs a line number, not {cursor.found()}")
    cursor.advance()
    cursor.reporter.report_token(token)
    return token.value


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


def _set(cursor: Cursor, start: Token) -> SetEvent:
    del start
    return SetEvent(event_word(cursor))


def assignment(cursor: Cursor) -> Assignment:
    """Read target = value; LET has already been read."""
    left = target(cursor, "an assignment")
    if not cursor.at("="):
        hint = "names have no blanks" if cursor.current.is_name else None
        cursor.fail("AMX0035", f"`=` is missing: {cursor.found()} stands where it should be", hint)
    cursor.advance()
    return Assignment(left, expression(cursor))


def _line_numbers(cursor: Cursor, word: str) -> tuple[int, ...]:
    lines = [line_number(cursor, word)]
    while cursor.accept(","):
        lines.append(line_number(cursor, word))
    if cursor.current.kind is Kind.INTEGER:
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    return tuple(lines)


def _let(cursor: Cursor, start: Token) -> Assignment:
    del start
    return assignment(cursor)


def _goto(cursor: Cursor, start: Token) -> Goto:
    return Goto(line_number(cursor, start.text))


def _gosub(cursor: Cursor, start: Token) -> Gosub:
    return Gosub(line_number(cursor, start.text))


def _on(cursor: Cursor, start: Token) -> OnJump:
    if cursor.at("ERROR"):
        cursor.fail("AMX0032", "ON ERROR is not part of the language", "test the error log with TST_ERRLOG@")
    selector = expression(cursor)
    if not cursor.at("GOTO", "GOSUB"):
        cursor.fail("AMX0063", f"GOTO or GOSUB is missing after {start.text}", "ON value GOTO line, line, ...")
    word = cursor.advance().text
    return OnJump(selector, _line_numbers(cursor, word), word == "GOSUB")


def _return(cursor: Cursor, start: Token) -> Return:
    del cursor, start
    return Return()


def _stop(cursor: Cursor, start: Token) -> Stop:
    del cursor, start
    return Stop()


def _end(cursor: Cursor, start: Token) -> End:
    del cursor, start
    return End()


def _clear_error_log(cursor: Cursor, start: Token) -> ClearErrorLog:
    del cursor, start
    return ClearErrorLog()


def _read(cursor: Cursor, start: Token) -> Read:
    targets = [target(cursor, start.text)]
    while cursor.accept(","):
        targets.append(target(cursor, start.text))
    return Read(tuple(targets))


def _data(cursor: Cursor, start: Token) -> Data:
    values = [constant(cursor, start.text)]
    while cursor.accept(","):
        values.append(constant(cursor, start.text))
    return Data(tuple(values))


def _restore(cursor: Cursor, start: Token) -> Restore:
    return Restore() if cursor.at_end() or cursor.at("ELSE") else Restore(line_number(cursor, start.text))


def _print(cursor: Cursor, start: Token) -> Print:
    del start
    if cursor.at("#", ":"):
        hint = "PRINT without # writes to the task's log"
        cursor.fail("AMX0031", "PRINT to a port or channel belongs to BASIC tasks: it can suspend the task", hint)
    return print_items(cursor)


def _io_write(cursor: Cursor, start: Token) -> IoWrite:
    form = f"a comma is missing: {start.text} slot, register, value"
    slot = expression(cursor)
    cursor.expect(",", "AMX0071", form)
    register = expression(cursor)
    cursor.expect(",", "AMX0071", form)
    return IoWrite(slot, register, expression(cursor))


SIMPLE_STATEMENTS: dict[str, Callable[[Cursor, Token], Statement]] = {
    "LET": _let,
    "GOTO": _goto,
    "GOSUB": _gosub,
    "ON": _on,
    "RETURN": _return,
    "STOP": _stop,
    "END": _end,
    "CLR_ERRLOG": _clear_error_log,
    "READ": _read,
    "DATA": _data,
    "RESTORE": _restore,
    "PRINT": _print,
    "IOWRITE": _io_write,
    "LOCAL": declaration,
    "COMMON": declaration,
    "GLOBAL": declaration,
    "EVENT": event,
    "CALL": call,
    "SET": _set,
}
"""The parser of each simple statement, called after its first word; SET may also be the name of a variable."""
