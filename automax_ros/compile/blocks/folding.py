"""Constant folding and removal of dead code in Python syntax trees of step functions.

A name may also be bound to a table: ``Fold`` then requests the expression of each of its elements.
"""

from __future__ import annotations

import ast
import contextlib
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from automax_ros.compile.base import build
from automax_ros.core.types import Value

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.BitAnd: operator.and_,
}
TableReader = Callable[[ast.expr], ast.expr]
"""Returns the expression that reads a table's element at an index."""

_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def value_of(expression: ast.expr) -> Value | None:
    """Return the value of a literal with or without a sign; None for anything else."""
    if isinstance(expression, ast.Constant) and isinstance(expression.value, (int, float, bool, str)):
        return expression.value
    if isinstance(expression, ast.UnaryOp) and isinstance(expression.op, ast.USub):
        inner = value_of(expression.operand)
        if isinstance(inner, (int, float)) and not isinstance(inner, bool):
            return -inner
    return None


class Fold(ast.NodeTransformer):
    """Replaces names by expressions and folds constants.

    ``helpers`` may be called with constant arguments while folding.
    """

    def __init__(
        self,
        bindings: Mapping[str, ast.expr],
        helpers: Mapping[str, Callable[..., object]],
        tables: Mapping[str, TableReader] | None = None,
    ) -> None:
        self._bindings = bindings
        self._helpers = helpers
        self._tables = tables or {}

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Read the element of a table; in one of a buffer only replace the names."""
        index = self.visit(node.slice)
        if isinstance(node.value, ast.Name) and node.value.id in self._tables:
            return self._tables[node.value.id](index)
        return ast.Subscript(self.visit(node.value), index, node.ctx)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace a bound name, wherever it is read or written."""
        bound = self._bindings.get(node.id)
        if bound is None:
            return node
        if isinstance(node.ctx, ast.Store):
            assert isinstance(bound, ast.Name)
            return ast.Name(bound.id, build.STORE)
        return bound

    def visit_Tuple(self, node: ast.Tuple) -> ast.expr:
        """Create a new tuple: the given one is shared by all calls of the block."""
        return ast.Tuple([self.visit(item) for item in node.elts], node.ctx)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        """Fold NOT and the sign of constants."""
        node = ast.UnaryOp(node.op, self.visit(node.operand))
        value = value_of(node.operand)
        if isinstance(node.op, ast.Not):
            if value is not None:
                return ast.Constant(not value)
            if isinstance(node.operand, ast.UnaryOp) and isinstance(node.operand.op, ast.Not):
                return node.operand.operand
        elif isinstance(node.op, ast.USub) and isinstance(value, (int, float)):
            return build.constant(-value)
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """Fold + - * of constants."""
        node = ast.BinOp(self.visit(node.left), node.op, self.visit(node.right))
        left, right = value_of(node.left), value_of(node.right)
        fold = _BINARY.get(type(node.op))
        if fold is not None and left is not None and right is not None:
            with contextlib.suppress(ArithmeticError):
                return build.constant(fold(left, right))
        if right == 0 and type(right) is int and isinstance(node.op, (ast.Add, ast.Sub)):
            return node.left
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """Fold a comparison of two constants."""
        node = ast.Compare(self.visit(node.left), node.ops, [self.visit(item) for item in node.comparators])
        if len(node.ops) == 1:
            left, right = value_of(node.left), value_of(node.comparators[0])
            if left is not None and right is not None:
                return ast.Constant(bool(_COMPARE[type(node.ops[0])](left, right)))
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        """Remove operands that cannot decide the result, and those after one that does."""
        neutral = isinstance(node.op, ast.And)
        kept: list[ast.expr] = []
        for operand in (self.visit(item) for item in node.values):
            value = value_of(operand)
            if value is None:
                kept.append(operand)
            elif bool(value) is not neutral:
                if not kept:
                    return ast.Constant(not neutral)
                kept.append(ast.Constant(not neutral))
                break
        if not kept:
            return ast.Constant(neutral)
        return kept[0] if len(kept) == 1 else ast.BoolOp(node.op, kept)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """Choose at compile time where the test is constant."""
        test: ast.expr = self.visit(node.test)
        value = value_of(test)
        if value is not None:
            chosen: ast.expr = self.visit(node.body if value else node.orelse)
            return chosen
        return ast.IfExp(test, self.visit(node.body), self.visit(node.orelse))

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Execute a helper whose arguments are all constant; a call that fails stays: a test may come before it."""
        arguments = [self.visit(argument) for argument in node.args]
        values = [value_of(argument) for argument in arguments]
        if isinstance(node.func, ast.Name) and node.func.id in self._helpers and None not in values:
            with contextlib.suppress(ArithmeticError, ValueError):
                result = self._helpers[node.func.id](*values)
                if isinstance(result, (int, float, bool)):
                    return build.constant(result)
        return ast.Call(node.func, arguments, [])


def fold_body(body: Iterable[ast.stmt], fold: Fold) -> list[ast.stmt]:
    """Return statements with names replaced, constants folded and unreachable branches removed."""
    folded: list[ast.stmt] = []
    for statement in body:
        if isinstance(statement, ast.If):
            test = fold.visit(statement.test)
            value = value_of(test)
            if value is not None:
                folded.extend(fold_body(statement.body if value else statement.orelse, fold))
                continue
            then, otherwise = fold_body(statement.body, fold), fold_body(statement.orelse, fold)
            if then or otherwise:
                folded.append(_if(test, then, otherwise))
        elif isinstance(statement, ast.While):
            folded.append(build.loop(fold.visit(statement.test), fold_body(statement.body, fold)))
        elif isinstance(statement, ast.Assign):
            assigned = ast.Assign([fold.visit(target) for target in statement.targets], fold.visit(statement.value))
            target, given = assigned.targets[0], assigned.value
            if not (isinstance(target, ast.Name) and isinstance(given, ast.Name) and target.id == given.id):
                folded.append(assigned)
        elif isinstance(statement, ast.AugAssign):
            folded.append(ast.AugAssign(fold.visit(statement.target), statement.op, fold.visit(statement.value)))
        elif not isinstance(statement, ast.Pass):
            raise TypeError(f"a step function may not contain {type(statement).__name__}")
    return folded


def _if(test: ast.expr, then: list[ast.stmt], otherwise: list[ast.stmt]) -> ast.If:
    if not then:
        return ast.If(build.inverse(test), otherwise, [])
    return ast.If(test, then, otherwise)


def without_dead_stores(body: list[ast.stmt], needed: set[str]) -> list[ast.stmt]:
    """Return statements without assignments to names that nothing reads; ``needed`` are read afterwards.

    A name that is read anywhere in the body, except for its own new value, counts as read: safe, and enough for step
    functions.
    """
    count = _count(body)
    while True:
        body = _prune(body, needed | _read(body))
        before, count = count, _count(body)
        if count == before:
            return body


def _read(body: Iterable[ast.stmt]) -> set[str]:
    found: set[str] = set()
    for statement in body:
        if isinstance(statement, (ast.If, ast.While)):
            found |= _names_read(statement.test) | _read(statement.body) | _read(statement.orelse)
            continue
        names = _names_read(statement)
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            names.discard(statement.targets[0].id)
        found |= names
    return found


def _names_read(node: ast.AST) -> set[str]:
    return {item.id for item in build.nodes(node) if isinstance(item, ast.Name) and isinstance(item.ctx, ast.Load)}


def _count(body: list[ast.stmt]) -> int:
    inner = [statement for statement in body if isinstance(statement, (ast.If, ast.While))]
    return len(body) + sum(_count(statement.body) + _count(statement.orelse) for statement in inner)


def _prune(body: list[ast.stmt], read: set[str]) -> list[ast.stmt]:
    kept: list[ast.stmt] = []
    for statement in body:
        if isinstance(statement, ast.If):
            then, otherwise = _prune(statement.body, read), _prune(statement.orelse, read)
            if then or otherwise:
                kept.append(_if(statement.test, then, otherwise))
        elif isinstance(statement, ast.While):
            turn = _prune(statement.body, read | _names_read(statement.test))
            if turn:
                kept.append(build.loop(statement.test, turn))
        elif isinstance(statement, (ast.Assign, ast.AugAssign)):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            if any(node.id in read for target in targets for node in build.nodes(target) if isinstance(node, ast.Name)):
                kept.append(statement)
        else:
            kept.append(statement)
    return kept
