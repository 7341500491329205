"""Further simplification of an inlined step: literals and copies carried on, errors logged where they arise."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Mapping

from automax_ros.blocks.declaration import HELPERS
from automax_ros.compile import build
from automax_ros.compile.folding import Fold, fold_body, value_of

MOST_ROUNDS = 8
"""Rounds of carrying on; step functions need two or three."""


def carry_on(
    body: list[ast.stmt], outputs: Mapping[str, ast.expr], own: frozenset[str]
) -> tuple[list[ast.stmt], dict[str, ast.expr]]:
    """Put literals, and names that the body does not set, in the place of ``own`` locals that are set once to them."""
    results = dict(outputs)
    for _ in range(MOST_ROUNDS):
        bindings = _carried(body, own)
        if not bindings:
            break
        fold = Fold(bindings, HELPERS)
        body = fold_body(_without(body, bindings), fold)
        results = {name: fold.visit(value) for name, value in results.items()}
    return body, results


def _carried(body: list[ast.stmt], own: frozenset[str]) -> dict[str, ast.expr]:
    stores = _stores(body)
    bindings: dict[str, ast.expr] = {}
    for part in body:
        for node in build.nodes(part):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                name, value = node.targets[0].id, node.value
                if name not in own or stores[name] != 1:
                    continue
                if value_of(value) is not None or (isinstance(value, ast.Name) and not stores[value.id]):
                    bindings[name] = value
    return {
        name: value for name, value in bindings.items() if not isinstance(value, ast.Name) or value.id not in bindings
    }


def _stores(body: list[ast.stmt]) -> Counter[str]:
    return Counter(
        node.id for node in build.nodes(*body) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    )


def _without(body: list[ast.stmt], names: Mapping[str, ast.expr]) -> list[ast.stmt]:
    """Return the body without the assignments to names."""
    kept: list[ast.stmt] = []
    for statement in body:
        if isinstance(statement, ast.If):
            kept.append(ast.If(statement.test, _without(statement.body, names), _without(statement.orelse, names)))
        elif isinstance(statement, ast.While):
            kept.append(build.loop(statement.test, _without(statement.body, names)))
        elif not (
            isinstance(statement, ast.Assign)
            and isinstance(statement.targets[0], ast.Name)
            and statement.targets[0].id in names
        ):
            kept.append(statement)
    return kept


def log_in_place(body: list[ast.stmt], error: ast.expr, log: Callable[[ast.expr], ast.stmt]) -> list[ast.stmt]:
    """Return the body with an error logged where it arises, or after the body where more than one may arise."""
    if isinstance(error, ast.Name) and _only_literals(body, error.id) and _most_errors(body, error.id) <= 1:
        return _logging(body, error.id, log)
    return [*body, build.when(error, [log(error)])]


def _only_literals(body: list[ast.stmt], name: str) -> bool:
    """Return whether a local is set to literals only and read nowhere."""
    nodes = list(build.nodes(*body))
    if any(isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Load) for node in nodes):
        return False
    assignments = [node for node in nodes if isinstance(node, ast.Assign) and _sets(node, name)]
    return _stores(body)[name] == len(assignments) and all(value_of(node.value) is not None for node in assignments)


def _sets(statement: ast.Assign, name: str) -> bool:
    return isinstance(statement.targets[0], ast.Name) and statement.targets[0].id == name


def _most_errors(body: list[ast.stmt], name: str) -> int:
    """Return how often at most one pass sets the error to a problem."""
    most = 0
    for statement in body:
        if isinstance(statement, ast.If):
            most += max(_most_errors(statement.body, name), _most_errors(statement.orelse, name))
        elif isinstance(statement, ast.While):
            most += 2 * _most_errors(statement.body, name)
        elif isinstance(statement, ast.Assign) and _sets(statement, name):
            most += value_of(statement.value) != 0
    return most


def _logging(body: list[ast.stmt], name: str, log: Callable[[ast.expr], ast.stmt]) -> list[ast.stmt]:
    kept: list[ast.stmt] = []
    for statement in body:
        if isinstance(statement, ast.If):
            then = _logging(statement.body, name, log)
            otherwise = _logging(statement.orelse, name, log)
            kept.append(ast.If(statement.test, then or [ast.Pass()], otherwise))
        elif isinstance(statement, ast.Assign) and _sets(statement, name):
            if value_of(statement.value) != 0:
                kept.append(log(statement.value))
        else:
            kept.append(statement)
    return kept
