"""Finds the forms of a task that no source confirms, so that ``automax check --json`` can mark them."""

from __future__ import annotations

from automax_ros.core.diagnostics import Span
from automax_ros.language.syntax.task_kind import TaskKind
from automax_ros.language.syntax.tree import (
    Call,
    Declaration,
    Expression,
    FunctionCall,
    IoWrite,
    Module,
    SetEvent,
    Statement,
)
from automax_ros.language.syntax.unconfirmed import UNCONFIRMED_FUNCTIONS, UNCONFIRMED_STATEMENTS
from automax_ros.language.syntax.waiting_tree import Get, InputFile, PrintFile, Put
from automax_ros.language.syntax.walk import arguments_of, expressions_of, jumps_of, parts, statements_in_order


def find_unconfirmed(module: Module, kind: TaskKind) -> list[tuple[Span, str]]:
    """Return the places of unconfirmed forms in the order of the text, each with what is not confirmed of it."""
    found: list[tuple[Span, str]] = []
    for statement, _ in statements_in_order(module.statements):
        found += _of_statement(statement, kind)
        arguments = tuple(argument.value for argument in arguments_of(statement))
        for expression in (*expressions_of(statement), *arguments):
            found += _of_expression(expression)
    return found


def _of_statement(statement: Statement, kind: TaskKind) -> list[tuple[Span, str]]:
    if isinstance(statement, Call) and statement.number is None:
        return [(statement.span, UNCONFIRMED_STATEMENTS["CALL"])]
    if isinstance(statement, IoWrite):
        return [(statement.span, UNCONFIRMED_STATEMENTS["IOWRITE"])]
    if isinstance(statement, (InputFile, Get, PrintFile)) and jumps_of(statement):
        return [(statement.span, UNCONFIRMED_STATEMENTS["EMPTY"])]
    if isinstance(statement, (Get, Put)):
        return [(statement.span, UNCONFIRMED_STATEMENTS["GET"])]
    if isinstance(statement, SetEvent) and kind is not TaskKind.BASIC:
        return [(statement.span, UNCONFIRMED_STATEMENTS["SET"])]
    if isinstance(statement, Declaration):
        tunings = [item.tuning for item in statement.variables if item.tuning is not None]
        return [(tuning.span, UNCONFIRMED_STATEMENTS["TUNABLE"]) for tuning in tunings]
    return []


def _of_expression(expression: Expression) -> list[tuple[Span, str]]:
    calls = [part for part in parts(expression) if isinstance(part, FunctionCall)]
    return [(call.span, UNCONFIRMED_FUNCTIONS[call.name]) for call in calls if call.name in UNCONFIRMED_FUNCTIONS]
