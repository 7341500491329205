"""Narrows the ranges of values by the result of a test that compares them."""

from __future__ import annotations

import ast
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from automax_ros.compile.native.translate.environment import Environment, joined
from automax_ros.compile.native.translate.ranges import INFINITE, Range

if TYPE_CHECKING:
    from automax_ros.compile.native.translate.frame import Frame

_OPPOSITE: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}
_MIRRORED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
    ast.Eq: ast.Eq,
    ast.NotEq: ast.NotEq,
}


def refined(frame: Frame, test: ast.expr, known: Environment, *, truth: bool) -> Environment | None:
    """Return the known ranges where a test has the result ``truth``; None where it cannot."""
    if isinstance(test, ast.Constant):
        return known if bool(test.value) is truth else None
    if isinstance(test, ast.Name):
        return _truth_of(test.id, known, truth=truth)
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return refined(frame, test.operand, known, truth=not truth)
    if isinstance(test, ast.BoolOp):
        return _all_of(frame, test, known) if isinstance(test.op, ast.And) is truth else _one_of(frame, test, known)
    if isinstance(test, ast.Compare):
        return _compare(frame, test, known, truth=truth)
    return known


def _truth_of(name: str, known: Environment, *, truth: bool) -> Environment | None:
    present = known.get(name)
    if present is None or not present.is_whole:
        return known
    if not truth:
        return known.setting(name, replace(present, low=0, high=0)) if present.low <= 0 <= present.high else None
    low = 1 if present.low == 0 else present.low
    high = -1 if present.high == 0 else present.high
    return known.setting(name, replace(present, low=low, high=high)) if low <= high else None


def _all_of(frame: Frame, test: ast.BoolOp, known: Environment) -> Environment | None:
    truth = isinstance(test.op, ast.And)
    for operand in test.values:
        after = refined(frame, operand, known, truth=truth)
        if after is None:
            return None
        known = after
    return known


def _one_of(frame: Frame, test: ast.BoolOp, known: Environment) -> Environment | None:
    """Return the known ranges where one operand decided: of AND a false one, of OR a true one."""
    decides = isinstance(test.op, ast.Or)
    found: Environment | None = None
    before: Environment | None = known
    for operand in test.values:
        if before is None:
            break
        found = joined(found, refined(frame, operand, before, truth=decides))
        before = refined(frame, operand, before, truth=not decides)
    return found


def _compare(frame: Frame, test: ast.Compare, known: Environment, *, truth: bool) -> Environment | None:
    operands = [test.left, *test.comparators]
    pairs = list(zip(operands, test.ops, operands[1:], strict=False))
    if len(pairs) > 1 and not truth:
        links: list[ast.expr] = [ast.Compare(left, [sign], [right]) for left, sign, right in pairs]
        return _one_of(frame, ast.BoolOp(ast.And(), links), known)
    for left, sign, right in pairs:
        relation = type(sign) if truth else _OPPOSITE[type(sign)]
        for subject, seen, other in ((left, relation, right), (right, _MIRRORED[relation], left)):
            after = _bound(frame, subject, seen, other, known, truth=truth)
            if after is None:
                return None
            known = after
    return known


def _bound(
    frame: Frame, subject: ast.expr, relation: type[ast.cmpop], other: ast.expr, known: Environment, *, truth: bool
) -> Environment | None:
    """Return the known ranges where ``subject relation other`` is true; the subject may be a name or a negated name.

    ``truth`` is False where this is known because the opposite failed. NaN fails every comparison: so the range of a
    REAL never counts as empty, and where the other may be NaN a failed comparison narrows nothing.
    """
    turned = isinstance(subject, ast.UnaryOp) and isinstance(subject.op, ast.USub)
    name = subject.operand if isinstance(subject, ast.UnaryOp) and turned else subject
    if not isinstance(name, ast.Name) or name.id not in known:
        return known
    present, bound = known[name.id], frame.value(other, known).range
    if not truth and not bound.is_number:
        return known
    if turned:
        relation, bound = _MIRRORED[relation], Range(bound.kind, -bound.high, -bound.low)
    low, high = _limits(present, relation, bound)
    if low > high:
        return None if present.is_whole and bound.is_whole else known
    if (low, high) == (present.low, present.high):
        return known
    return known.setting(name.id, replace(present, low=low, high=high))


def _limits(present: Range, relation: type[ast.cmpop], bound: Range) -> tuple[float, float]:
    low, high = present.low, present.high
    beyond = int(present.is_whole and bound.is_whole)
    if relation is ast.Eq:
        low, high = max(low, _least(present, bound.low)), min(high, _most(present, bound.high))
    elif relation is ast.Lt:
        high = min(high, _most(present, bound.high) - beyond)
    elif relation is ast.LtE:
        high = min(high, _most(present, bound.high))
    elif relation is ast.Gt:
        low = max(low, _least(present, bound.low) + beyond)
    elif relation is ast.GtE:
        low = max(low, _least(present, bound.low))
    elif beyond and bound.low == bound.high:
        low += low == bound.low
        high -= high == bound.high
    return low, high


def _least(present: Range, bound: float) -> float:
    if not present.is_whole:
        return float(bound)
    return bound if abs(bound) == INFINITE else math.ceil(bound)


def _most(present: Range, bound: float) -> float:
    if not present.is_whole:
        return float(bound)
    return bound if abs(bound) == INFINITE else math.floor(bound)
