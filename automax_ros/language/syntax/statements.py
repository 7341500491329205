"""Simple statements: everything but IF, FOR and their ends."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.language.syntax.calls import call
from automax_ros.language.syntax.cursor import Cursor
from automax_ros.language.syntax.declarations import declaration, event, event_word
from automax_ros.language.syntax.expressions import constant, expression, target
from automax_ros.language.syntax.jumps import line_number
from automax_ros.language.syntax.print_list import print_items
from automax_ros.language.syntax.tokens import Kind, Token
from automax_ros.language.syntax.tree import (
    Assignment,
    ClearErrorLog,
    Data,
    End,
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


def _set(cursor: Cursor, start: Token) -> SetEvent:
    del start
    return SetEvent(event_word(cursor))


def assignment(cursor: Cursor) -> Assignment:
    """Read target = value; LET has been read."""
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
"""How each simple statement is read after its first word; SET may name a variable all the same."""
