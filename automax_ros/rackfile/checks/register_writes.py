"""Constants that the tasks of a rack write to the registers of its modules, from the tasks' text."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

from automax_ros.language.program import Program
from automax_ros.language.tree.tree import (
    Assignment,
    Expression,
    For,
    IntegerLiteral,
    IoWrite,
    Read,
    Reference,
    Statement,
)
from automax_ros.language.tree.walk import arguments_of, statements_in_order
from automax_ros.rackfile.model.config import RackConfig

Register = tuple[int, int]
"""Slot and register."""
Constants = Mapping[Register, list[int | None]]
"""The values written to each register: a number, or None if it is not known."""


def constant_writes(config: RackConfig, programs: Iterable[Program]) -> Constants:
    """Return the writes of all statements to registers; a block with a register as a parameter may write anything."""
    places = {
        variable.name: (variable.point.slot, variable.point.register)
        for variable in config.declared
        if variable.point is not None
    }
    return _writes(programs, places)


def numbered_writes(programs: Iterable[Program]) -> Constants:
    """Return the writes of IOWRITE statements alone to registers that they name by constants."""
    return _writes(programs, {})


def _writes(programs: Iterable[Program], places: Mapping[str, Register]) -> Constants:
    found: dict[Register, list[int | None]] = defaultdict(list)
    for program in programs:
        for statement, _ in statements_in_order((*program.startup, *program.scan)):
            for register, value in (*_by_name(statement, places), *_by_number(statement)):
                found[register].append(value)
    return found


def _by_name(statement: Statement, places: Mapping[str, Register]) -> Iterator[tuple[Register, int | None]]:
    targets: list[tuple[Expression, int | None]] = [(item.value, None) for item in arguments_of(statement)]
    if isinstance(statement, Assignment):
        targets.append((statement.target, _constant(statement.value)))
    elif isinstance(statement, Read):
        targets += [(target, None) for target in statement.targets]
    elif isinstance(statement, For):
        targets.append((statement.variable, None))
    for target, value in targets:
        if isinstance(target, Reference) and target.name in places:
            yield places[target.name], value


def _by_number(statement: Statement) -> Iterator[tuple[Register, int | None]]:
    if isinstance(statement, IoWrite):
        slot, register = _constant(statement.slot), _constant(statement.register)
        if slot is not None and register is not None:
            yield (slot, register), _constant(statement.value)


def _constant(expression: Expression) -> int | None:
    return expression.value if isinstance(expression, IntegerLiteral) else None
