"""Parses LOCAL, COMMON and GLOBAL, with arrays, string lengths and tunables, and EVENT.

Form of a tunable (decision): LOCAL GAIN [CURRENT=1.5, HIGH=10.0, LOW=0.0, STEP=0.1], keys in any order.
"""

from __future__ import annotations

from automax_ros.core.text import did_you_mean
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.parse.expressions import close_parenthesis, constant, variable
from automax_ros.language.text.tokens import RESERVED_WORDS, Kind, Token
from automax_ros.language.tree.functions import FUNCTIONS, REFUSED_FUNCTIONS
from automax_ros.language.tree.tree import Declaration, Declared, Event, Expression, Reference, Scope, Tuning

TUNING_KEYS = ("CURRENT", "HIGH", "LOW", "STEP")
EVENT_KEYS = ("INTERRUPT_STATUS", "TIMEOUT")


def declaration(cursor: Cursor, start: Token) -> Declaration:
    """Read the list after LOCAL, COMMON or GLOBAL."""
    scope = Scope.LOCAL if start.text == "LOCAL" else Scope.COMMON
    variables = cursor.separated(lambda: _parse_declared(cursor, start.text))
    if cursor.current.is_name and not cursor.at("REM", "ELSE"):
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    return Declaration(scope, variables)


def _parse_declared(cursor: Cursor, word: str) -> Declared:
    token = cursor.current
    if not token.is_name:
        cursor.fail("AMX0075", f"{word} needs the name of a variable, not {cursor.found()}")
    if token.text in RESERVED_WORDS or token.text in FUNCTIONS or token.text in REFUSED_FUNCTIONS:
        cursor.fail("AMX0034", f"`{token.text}` is a word of the language and cannot name a variable")
    name = cursor.check_name(cursor.advance())
    length = None
    if cursor.at(":") and cursor.following.kind is Kind.INTEGER:
        if not name.endswith("$"):
            cursor.fail("AMX0075", "only a string has a length", f"write {name} without it")
        cursor.advance()
        length = _count(cursor, "the length of a string")
    subscripts: tuple[int, ...] = ()
    after = cursor.tokens[min(cursor.position + 2, len(cursor.tokens) - 1)]
    begins_tuning = cursor.following.kind is Kind.WORD and after.text == "="
    if cursor.at("(") or (cursor.at("[") and not begins_tuning):
        subscripts = _subscripts(cursor)
    tuning = _tuning(cursor) if cursor.at("[") else None
    if cursor.at("="):
        hint = f"give the value by a statement of its own: {name[:16]} = ..."
        cursor.fail("AMX0075", f"{word} gives no value", hint)
    return Declared(name, subscripts, length, tuning, span=token.span.to(cursor.previous.span))


def _count(cursor: Cursor, what: str) -> int:
    token = cursor.current
    if token.kind is not Kind.INTEGER or not isinstance(token.value, int):
        cursor.fail("AMX0075", f"{what} is an integer constant, not {cursor.found()}")
    cursor.advance()
    cursor.reporter.report_token(token)
    return token.value


def _subscripts(cursor: Cursor) -> tuple[int, ...]:
    opening = cursor.advance()
    counts = cursor.separated(lambda: _count(cursor, "the largest subscript"))
    if not cursor.accept(")" if opening.text == "(" else "]"):
        close_parenthesis(cursor, opening.span, opening.text)
    return counts


def _tuning(cursor: Cursor) -> Tuning:
    opening = cursor.advance()
    given: dict[str, Expression] = {}
    while True:
        key = cursor.current
        if key.text not in TUNING_KEYS:
            hint = did_you_mean(key.text, TUNING_KEYS) or "the keys are CURRENT, HIGH, LOW and STEP"
            cursor.fail("AMX0074", f"{cursor.found()} is not a key of a tunable", hint)
        if key.text in given:
            cursor.fail("AMX0074", f"{key.text} is given twice")
        cursor.advance()
        cursor.expect("=", "AMX0035", f"`=` is missing after {key.text}")
        given[key.text] = constant(cursor, key.text)
        if not cursor.accept(","):
            break
    if not cursor.accept("]"):
        close_parenthesis(cursor, opening.span, "[")
    return Tuning(*(given.get(key) for key in TUNING_KEYS), span=opening.span.to(cursor.previous.span))


def event_word(cursor: Cursor) -> str:
    """Read the name of an event."""
    token = cursor.current
    if token.kind is not Kind.WORD or token.text in RESERVED_WORDS:
        hint = "the name of an event has no type character" if token.kind is Kind.NAME else None
        cursor.fail("AMX0076", f"{cursor.found()} cannot be the name of an event", hint)
    return cursor.check_name(cursor.advance())


def event(cursor: Cursor, _start: Token) -> Event:
    """Read EVENT NAME = event [, INTERRUPT_STATUS = variable, TIMEOUT = count] (section 4)."""
    form = "EVENT NAME = event, INTERRUPT_STATUS = variable, TIMEOUT = count"
    cursor.expect("NAME", "AMX0076", "EVENT needs NAME = and the name of the event", form)
    cursor.expect("=", "AMX0035", "`=` is missing after NAME", form)
    name = event_word(cursor)
    status: Reference | None = None
    timeout: int | None = None
    while cursor.accept(","):
        key = cursor.current
        if key.text not in EVENT_KEYS:
            hint = did_you_mean(key.text, EVENT_KEYS) or form
            cursor.fail("AMX0076", f"{cursor.found()} is not a key of EVENT", hint)
        if (status if key.text == "INTERRUPT_STATUS" else timeout) is not None:
            cursor.fail("AMX0076", f"{key.text} is given twice")
        cursor.advance()
        cursor.expect("=", "AMX0035", f"`=` is missing after {key.text}")
        if key.text == "TIMEOUT":
            if cursor.current.kind is not Kind.INTEGER:
                cursor.fail("AMX0076", f"TIMEOUT needs an integer constant, not {cursor.found()}")
            timeout = _count(cursor, "TIMEOUT")
        else:
            status = variable(cursor, "INTERRUPT_STATUS")
    if cursor.at(*EVENT_KEYS):
        cursor.fail("AMX0071", f"a comma is missing before {cursor.found()}")
    return Event(name, status, timeout)
