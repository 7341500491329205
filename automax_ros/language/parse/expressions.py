"""Parses expressions: precedence, subscripts and function calls.

Precedence, high to low: parentheses; unary - +; ** ; * / ; + - ; relational; NOT; AND; OR XOR. Equal levels go from
left to right (J-3675, 5). Relational operators bind closer than NOT, NOT than AND, AND than OR and XOR (decision).
"""

from __future__ import annotations

from typing import NoReturn

from automax_ros.core.diagnostics import Span
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.text.constants import LARGEST_REAL, SMALLEST_POSITIVE
from automax_ros.language.text.tokens import BOOLEAN_WORDS, RESERVED_WORDS, Kind, SourceFault, Token
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS, REFUSED_FUNCTIONS

DEPTH_LIMIT = 64
"""Deepest nesting of operations and parentheses in an expression (decision: a bound for untrusted sources)."""
NOT_LEVEL = 3
RELATIONAL = ("=", "<>", "<", ">", "<=", ">=")
LEVELS: dict[str, int] = {
    "OR": 1,
    "XOR": 1,
    "AND": 2,
    **dict.fromkeys(RELATIONAL, 4),
    "+": 5,
    "-": 5,
    "*": 6,
    "/": 6,
    "**": 7,
}
"""Binary operators by precedence; NOT is between AND and the relational ones, a sign above all."""
_CLOSING = {"(": ")", "[": "]"}
_Measured = tuple[tree.Expression, int]


def expression(cursor: Cursor) -> tree.Expression:
    """Read an expression."""
    return _operation(cursor, 1, 1)[0]


def variable(cursor: Cursor, what: str) -> tree.Reference:
    """Read the name of a simple variable; ``what`` says in a message what needs one."""
    token = _variable_name(cursor, what)
    return tree.Reference(cursor.check_name(token), span=token.span)


def target(cursor: Cursor, what: str) -> tree.Target:
    """Read a variable or an array element; ``what`` says in a message what needs one."""
    token = _variable_name(cursor, what)
    name = cursor.check_name(token)
    if cursor.at("(", "["):
        return tree.Element(name, _arguments(cursor, 1)[0], span=token.span.to(cursor.previous.span))
    return tree.Reference(name, span=token.span)


def constant(cursor: Cursor, what: str) -> tree.Expression:
    """Read a constant, possibly with a sign; ``what`` says in a message what needs one."""
    sign = cursor.advance() if cursor.at("-", "+") else None
    token = cursor.current
    boolean = token.kind is Kind.WORD and token.text in BOOLEAN_WORDS
    if not (token.kind in (Kind.INTEGER, Kind.REAL) or (sign is None and (token.kind is Kind.STRING or boolean))):
        hint = "a string stands in quotes" if token.is_name and not boolean else None
        cursor.fail("AMX0073", f"{what} needs a constant, not {cursor.found()}", hint)
    value, _ = _literal(cursor, sign is not None and sign.text == "-")
    return value if sign is None else tree.Unary(sign.text, value, span=sign.span.to(value.span))


def _variable_name(cursor: Cursor, what: str) -> Token:
    token = cursor.current
    if not token.is_name:
        cursor.fail("AMX0077", f"{what} needs a variable, not {cursor.found()}")
    if token.text in RESERVED_WORDS or token.text in FUNCTIONS or token.text in REFUSED_FUNCTIONS:
        cursor.fail("AMX0034", f"`{token.text}` is a word of the language and cannot name a variable")
    return cursor.advance()


def _operation(cursor: Cursor, level: int, depth: int) -> _Measured:
    """Read operands joined by operators of ``level`` and above; return the tree and its height."""
    _check_depth(cursor, depth)
    if cursor.at("NOT"):
        left, height = _negation(cursor, level, depth)
    else:
        left, height = _parse_signed(cursor, depth)
    while True:
        operator = cursor.current.text
        operator_level = LEVELS.get(operator, 0)
        if operator_level < level:
            return left, height
        cursor.advance()
        right, right_height = _operation(cursor, operator_level + 1, depth + 1)
        height = max(height, right_height) + 1
        _check_depth(cursor, height)
        left = tree.Binary(operator, left, right, span=left.span.to(right.span))


def _negation(cursor: Cursor, level: int, depth: int) -> _Measured:
    if level > NOT_LEVEL:
        hint = "put parentheses around NOT and its operand"
        cursor.fail("AMX0041", f"NOT cannot stand directly after `{cursor.previous.text}`", hint)
    start = cursor.advance()
    if cursor.at("NOT"):
        cursor.fail("AMX0041", "two operators in a row", "NOT NOT cancels out: remove both")
    operand, height = _operation(cursor, NOT_LEVEL + 1, depth + 1)
    _check_depth(cursor, height + 1)
    return tree.Unary("NOT", operand, span=start.span.to(operand.span)), height + 1


def _parse_signed(cursor: Cursor, depth: int) -> _Measured:
    if not cursor.at("-", "+"):
        return _primary(cursor, depth, False)
    sign = cursor.advance()
    if cursor.at("-", "+", "NOT"):
        cursor.fail("AMX0041", "two operators in a row", "put parentheses around the second and its operand")
    operand, height = _primary(cursor, depth + 1, sign.text == "-")
    return tree.Unary(sign.text, operand, span=sign.span.to(operand.span)), height + 1


def _primary(cursor: Cursor, depth: int, negative: bool) -> _Measured:
    _check_depth(cursor, depth)
    token = cursor.current
    if token.kind in (Kind.INTEGER, Kind.REAL, Kind.STRING) or token.text in BOOLEAN_WORDS:
        return _literal(cursor, negative)
    if token.is_name and token.text not in RESERVED_WORDS:
        return _parse_named(cursor, depth)
    if token.text == "(":
        cursor.advance()
        inner = _operation(cursor, 1, depth + 1)
        _close(cursor, token)
        return inner
    return _missing_value(cursor)


def _missing_value(cursor: Cursor) -> NoReturn:
    text, before = cursor.current.text, cursor.previous.text
    if text in LEVELS and (before in LEVELS or before == "NOT"):
        message = f"two operators in a row: `{before}` and `{text}`"
        cursor.fail("AMX0041", message, "only a sign may follow another operator")
    hint = "an expression is grouped by ( )" if text == "[" else None
    cursor.fail("AMX0040", f"a value is missing before {cursor.found()}", hint)


def _literal(cursor: Cursor, negative: bool) -> _Measured:
    token = cursor.advance()
    cursor.reporter.report_token(token)
    value, span = token.value, token.span
    if isinstance(value, int):
        return tree.IntegerLiteral(value, token.text.endswith("H"), span=span), 1
    if isinstance(value, float):
        value = value if token.fault is None else min(value, LARGEST_REAL)
        if not negative and token.fault is None and 0.0 < value < SMALLEST_POSITIVE:
            hint = "the smallest positive REAL is 5.4210107E-20"
            cursor.reporter.report(SourceFault("AMX0026", "the real constant is too small", hint), span)
        return tree.RealLiteral(value, token.text, span=span), 1
    if isinstance(value, str):
        return tree.StringLiteral(value, span=span), 1
    return tree.BooleanLiteral(BOOLEAN_WORDS[token.text], span=span), 1


def _parse_named(cursor: Cursor, depth: int) -> _Measured:
    token = cursor.current
    name = token.text
    if name in REFUSED_FUNCTIONS:
        cursor.fail("AMX0047", f"{name} is left out: {REFUSED_FUNCTIONS[name]}")
    cursor.advance()
    function = FUNCTIONS.get(name)
    if cursor.at("(", "["):
        arguments, height = _arguments(cursor, depth, empty=function is not None)
        span = token.span.to(cursor.previous.span)
        if function is not None:
            return tree.FunctionCall(name, arguments, span=span), height + 1
        return tree.Element(cursor.check_name(token), arguments, span=span), height + 1
    if function is None:
        return tree.Reference(cursor.check_name(token), span=token.span), 1
    if function.arguments:
        cursor.fail("AMX0046", f"the function {name} needs its arguments in parentheses")
    return tree.FunctionCall(name, span=token.span), 1


def _arguments(cursor: Cursor, depth: int, empty: bool = False) -> tuple[tuple[tree.Expression, ...], int]:
    """Read a list in parentheses or brackets; return its expressions and the largest height."""
    opening = cursor.advance()
    arguments: list[tree.Expression] = []
    height = 0
    if empty and cursor.at(_CLOSING[opening.text]):
        cursor.advance()
        return (), 0
    while True:
        item, item_height = _operation(cursor, 1, depth + 1)
        arguments.append(item)
        height = max(height, item_height)
        _check_depth(cursor, height + 1)
        if not cursor.accept(","):
            _close(cursor, opening)
            return tuple(arguments), height


def _close(cursor: Cursor, opening: Token) -> None:
    closing = _CLOSING[opening.text]
    if cursor.accept(closing):
        return
    close_parenthesis(cursor, opening.span, opening.text)


def close_parenthesis(cursor: Cursor, opened: Span, opening: str = "(") -> None:
    """Raise the error for a parenthesis that is not closed here: another token follows, or its end is missing."""
    closing = _CLOSING[opening]
    token = cursor.current
    begins_value = token.is_name or token.kind in (Kind.INTEGER, Kind.REAL, Kind.STRING)
    if begins_value and token.text not in RESERVED_WORDS:
        cursor.fail("AMX0071", f"a comma or an operator is missing before {cursor.found()}")
    column = f"in column {opened.column}" if opened.line == token.span.line else f"in line {opened.line} of the text"
    cursor.fail("AMX0042", f"`{closing}` is missing: the `{opening}` {column} is not closed here")


def _check_depth(cursor: Cursor, depth: int) -> None:
    if depth > DEPTH_LIMIT:
        hint = "compute a part of it in a statement of its own"
        cursor.fail("AMX0045", f"the expression is more than {DEPTH_LIMIT} operations deep", hint)
