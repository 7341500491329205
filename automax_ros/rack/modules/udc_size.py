"""An estimate of what a task takes on a UDC: no source tells the size of compiled statements (decision)."""

from __future__ import annotations

from automax_ros.core.types import DataType
from automax_ros.language.program import Program, Symbol
from automax_ros.language.syntax.tree import Scope
from automax_ros.language.syntax.walk import arguments_of, expressions_of, parts, statements_in_order

MAX_BYTES = 20 * 1024
"""Largest UDC task (2.3)."""
STATEMENT_BYTES = 8
"""Estimate for a statement, a CALL included, without what stands in it (decision)."""
TERM_BYTES = 6
"""Estimate for each variable, constant, operator, function and parameter: a call and an address (decision)."""
_VALUE_BYTES = {DataType.BOOLEAN: 1, DataType.INTEGER: 2, DataType.DOUBLE: 4, DataType.REAL: 4}
_STATE_BYTES = 4


def estimated_bytes(program: Program) -> int:
    """Return about how large a task is, in bytes: its code, its locals, and what its blocks keep."""
    statements = list(statements_in_order((*program.startup, *program.scan)))
    terms = 0
    for statement, _ in statements:
        given = (*expressions_of(statement), *(argument.value for argument in arguments_of(statement)))
        terms += sum(1 for expression in given for _ in parts(expression))
    code = STATEMENT_BYTES * len(statements) + TERM_BYTES * terms
    variables = sum(_variable_bytes(symbol) for symbol in program.symbols.values() if symbol.scope is Scope.LOCAL)
    return code + variables + _STATE_BYTES * _states(program)


def _variable_bytes(symbol: Symbol) -> int:
    size = symbol.length + 1 if symbol.type is DataType.STRING else _VALUE_BYTES[symbol.type]
    return size * symbol.elements


def _states(program: Program) -> int:
    """Return how many values the blocks keep."""
    return sum(
        1 if state.size is None else state.size(bound.facts)
        for bound in program.calls.values()
        for state in bound.block.states
    )
