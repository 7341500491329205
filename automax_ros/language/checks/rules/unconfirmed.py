"""Forms of the language that no source confirms: their spelling or meaning is ours (decision).

``automax check --json`` marks their uses in a task, so that users of a real rack know where to be careful.
"""

from __future__ import annotations

from automax_ros.core.diagnostics import Span
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.language.tree.walk import arguments_of, expressions_of, jumps_of, parts, statements_in_order

UNCONFIRMED_STATEMENTS: dict[str, str] = {
    "CALL": "CALL after `\\` or THEN: section 3.1 wants a line number",
    "IOWRITE": "IOWRITE slot, register, value: the name and the order of the operands",
    "EMPTY": "EMPTY= and FULL=: where the number of the channel or port stands",
    "GET": "GET #n, variable and PUT #n, string: the operands",
    "SET": "SET in a control-block task: no source lists it there",
    "TUNABLE": "LOCAL NAME [CURRENT=..., HIGH=..., LOW=..., STEP=...]: the bracket and its keys",
}
"""Statements and parts of statements, with the parts of them that are not confirmed."""

UNCONFIRMED_FUNCTIONS: dict[str, str] = {
    name: f"{name}: the name and its arguments" for name, function in FUNCTIONS.items() if function.unconfirmed
}
"""Functions, with the parts of them that are not confirmed."""


def find_unconfirmed(module: tree.Module, kind: TaskKind) -> list[tuple[Span, str]]:
    """Return the places of unconfirmed forms in the order of the text, each with its unconfirmed part."""
    found: list[tuple[Span, str]] = []
    for statement, _ in statements_in_order(module.statements):
        found += _of_statement(statement, kind)
        arguments = tuple(argument.value for argument in arguments_of(statement))
        for expression in (*expressions_of(statement), *arguments):
            found += _of_expression(expression)
    return found


def _of_statement(statement: tree.Statement, kind: TaskKind) -> list[tuple[Span, str]]:
    if isinstance(statement, tree.Call) and statement.number is None:
        return [(statement.span, UNCONFIRMED_STATEMENTS["CALL"])]
    if isinstance(statement, tree.IoWrite):
        return [(statement.span, UNCONFIRMED_STATEMENTS["IOWRITE"])]
    if isinstance(statement, (tree.InputFile, tree.Get, tree.PrintFile)) and jumps_of(statement):
        return [(statement.span, UNCONFIRMED_STATEMENTS["EMPTY"])]
    if isinstance(statement, (tree.Get, tree.Put)):
        return [(statement.span, UNCONFIRMED_STATEMENTS["GET"])]
    if isinstance(statement, tree.SetEvent) and kind is not TaskKind.BASIC:
        return [(statement.span, UNCONFIRMED_STATEMENTS["SET"])]
    if isinstance(statement, tree.Declaration):
        tunings = [item.tuning for item in statement.variables if item.tuning is not None]
        return [(tuning.span, UNCONFIRMED_STATEMENTS["TUNABLE"]) for tuning in tunings]
    return []


def _of_expression(expression: tree.Expression) -> list[tuple[Span, str]]:
    calls = [part for part in parts(expression) if isinstance(part, tree.FunctionCall)]
    return [(call.span, UNCONFIRMED_FUNCTIONS[call.name]) for call in calls if call.name in UNCONFIRMED_FUNCTIONS]
