"""Which variables a straight piece of generated code reads before it sets them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence


def read_first(body: list[ast.stmt], names: Iterable[str]) -> frozenset[str]:
    """Return those of ``names`` whose value on entry counts: read, or left as it was, on some way through ``body``.

    ``body`` holds assignments, ``if`` and expressions; anything else counts as reading all that it names.
    """
    watched = frozenset(names)
    found: set[str] = set()
    always_set = _walk(body, frozenset(), found)
    sometimes_set = _stored(body) - always_set
    return frozenset(watched & (found | sometimes_set))


def _walk(body: list[ast.stmt], known: frozenset[str], found: set[str]) -> frozenset[str]:
    """Add what is read before it is set to ``found``; return what is set on every way, ``known`` included."""
    for statement in body:
        if isinstance(statement, ast.Assign):
            found |= _loaded([statement]) - known
            known |= {target.id for target in _targets(statement) if isinstance(target, ast.Name)}
        elif isinstance(statement, ast.If):
            found |= _loaded([statement.test]) - known
            known = _walk(statement.body, known, found) & _walk(statement.orelse, known, found)
        else:
            found |= (_loaded([statement]) | _stored([statement])) - known
    return known


def _targets(statement: ast.Assign) -> list[ast.expr]:
    target = statement.targets[0]
    return list(target.elts) if isinstance(target, ast.Tuple) else [target]


def _loaded(parts: Sequence[ast.AST]) -> set[str]:
    return _names(parts, ast.Load)


def _stored(parts: Sequence[ast.AST]) -> set[str]:
    return _names(parts, ast.Store)


def _names(parts: Sequence[ast.AST], context: type[ast.expr_context]) -> set[str]:
    nodes = (node for part in parts for node in ast.walk(part))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, context)}
