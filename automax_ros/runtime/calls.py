"""Lowering of CALL statements: bind parameters, compute coefficients, inline the step, store outputs.

Block statements work on the latch: a simple common INTEGER, DOUBLE INTEGER or BOOLEAN is the Python local that the scan
filled at its start. REALs, strings and array elements are read and written in actual memory (3.3).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.blocks.coefficients import evaluate, evaluate_noting
from automax_ros.blocks.declaration import Block, Output
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.language.program import BoundCall
from automax_ros.language.tree import (
    BooleanLiteral,
    Element,
    Expression,
    IntegerLiteral,
    RealLiteral,
    Unary,
    Variable,
)
from automax_ros.runtime import build
from automax_ros.runtime.emitter import Emitter
from automax_ros.runtime.expressions import SUBSCRIPT, lower_element, lower_index
from automax_ros.runtime.inline import inline
from automax_ros.runtime.layout import Field, Role
from automax_ros.runtime.pynames import variable_name
from automax_ros.runtime.simplify import log_in_place

COEFFICIENT_LIMIT = 7004


@dataclass(frozen=True)
class BlockInstance:
    """One CALL in one task: its name in the layout, the prefix of its Python names, its state fields in order."""

    bound: BoundCall
    label: str
    prefix: str
    variable_coefficients: tuple[str, ...]

    @property
    def fields(self) -> list[tuple[str, Field]]:
        """The state fields with their Python names: the block's states, then those of variable coefficients."""
        block = self.bound.block
        entries: list[tuple[str, DataType, Value]] = [(state.name, state.type, state.initial) for state in block.states]
        if self.variable_coefficients and block.coefficients is not None:
            entries += [(f"seen_{name.lower()}", DataType.REAL, math.inf) for name in self.variable_coefficients]
            entries += [(name, DataType.REAL, 0.0) for name in block.coefficients.names]
            entries.append(("limited", DataType.DOUBLE, 0))
        return [
            (self.prefix + name, Field(f"{self.label}.{name}", kind, Role.BLOCK, initial))
            for name, kind, initial in entries
        ]


def instance_of(bound: BoundCall, prefix: str, occurrence: int) -> BlockInstance:
    """Return the instance that a CALL makes; ``occurrence`` counts the calls of one line from 0."""
    declared = bound.block.coefficients
    variable = tuple(
        name
        for name in (declared.parameters if declared else ())
        if name in bound.arguments and not isinstance(bound.arguments[name], RealLiteral)
    )
    place = f"{bound.line}" if occurrence == 0 else f"{bound.line}.{occurrence + 1}"
    return BlockInstance(bound, f"{place} {bound.block.name}", prefix, variable)


def lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    """Emit one block."""
    emitter.in_block = True
    _lower_block(emitter, instance)
    emitter.in_block = False


def _lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    bound, block = instance.bound, instance.bound.block
    bindings = {
        item.variable: _input(emitter, bound, item.name) for item in block.inputs if _is_bound(bound, item.name)
    }
    bindings["period"] = build.constant(emitter.program.period_ns / NS_PER_S)
    _bind_coefficients(emitter, instance, bindings)
    held: dict[str, ast.expr] = {}
    for output in block.outputs:
        if output.holds and output.name in bound.arguments:
            held[output.name] = bindings[output.variable] = _block_value(emitter, bound.arguments[output.name])
    wanted = {
        output.name: _direct_name(emitter, bound.arguments[output.name])
        for output in block.outputs
        if output.name in bound.arguments
    }
    inlined = inline(block, instance.prefix, bindings, wanted, _free(bindings, wanted, held))
    body = inlined.body
    emitter.emit(*(log_in_place(body, inlined.error, emitter.log_call) if inlined.error is not None else body))
    for output in block.outputs:
        if output.name in wanted:
            _store_output(emitter, output, bound.arguments[output.name], inlined.outputs[output.name], held)


def _is_bound(bound: BoundCall, keyword: str) -> bool:
    declared = bound.block.coefficients
    if declared and keyword in declared.parameters:
        return False
    return keyword in bound.arguments or keyword in bound.defaults


def _input(emitter: Emitter, bound: BoundCall, keyword: str) -> ast.expr:
    given = bound.arguments.get(keyword)
    if given is None:
        return build.constant(bound.defaults[keyword])
    return _block_value(emitter, given)


def _block_value(emitter: Emitter, given: Expression) -> ast.expr:
    """Return what a block sees of a parameter."""
    if isinstance(given, (IntegerLiteral, RealLiteral, BooleanLiteral)):
        return build.constant(given.value)
    if isinstance(given, Unary):
        return build.inverse(_block_value(emitter, given.operand))
    if isinstance(given, Element):
        return lower_element(emitter, given).node
    assert isinstance(given, Variable)
    return emitter.read(given.name)


def _direct_name(emitter: Emitter, target: Expression) -> str:
    """Return the Python local that an output may be computed in, "" where it has none."""
    if isinstance(target, Variable):
        symbol = emitter.symbol(target.name)
        if symbol.latched or target.name not in emitter.views:
            return variable_name(target.name)
    return ""


def _free(bindings: dict[str, ast.expr], wanted: dict[str, str], held: dict[str, ast.expr]) -> frozenset[str]:
    """Return the targets that no input reads and no other output is computed in."""
    own = {id(node) for node in held.values()}
    read = {
        node.id
        for binding in bindings.values()
        if id(binding) not in own
        for node in ast.walk(binding)
        if isinstance(node, ast.Name)
    }
    targets = list(wanted.values())
    return frozenset(target for target in targets if target and target not in read and targets.count(target) == 1)


def _store_output(
    emitter: Emitter, output: Output, target: Expression, value: ast.expr, held: dict[str, ast.expr]
) -> None:
    """Emit the store of an output; one that holds is not written where it did not change."""
    direct = _direct_name(emitter, target)
    if direct:
        if not (isinstance(value, ast.Name) and value.id == direct):
            emitter.emit(build.assign(direct, value))
        return
    value = emitter.keep(value)
    emitter.book_cost()
    with emitter.suite() as store:
        _write_actual(emitter, target, value)
    if output.name in held:
        emitter.emit(build.when(build.compare(value, "<>", held[output.name]), store))
    else:
        emitter.emit(*store)


def _write_actual(emitter: Emitter, target: Expression, value: ast.expr) -> None:
    if isinstance(target, Variable):
        emitter.write(target.name, value)
        return
    assert isinstance(target, Element)
    write_element(emitter, target, value)


def write_element(emitter: Emitter, target: Element, value: ast.expr) -> None:
    """Emit the store of a value into an array element; out of range it is logged and nothing is written."""
    index, in_range = lower_index(emitter, target)
    if in_range is None:
        emitter.write(target.name, value, index)
        return
    emitter.book_cost()
    with emitter.suite() as inside:
        emitter.write(target.name, value, index)
    emitter.emit(build.when(in_range, inside, [emitter.log_call(build.constant(SUBSCRIPT))]))


def _bind_coefficients(emitter: Emitter, instance: BlockInstance, bindings: dict[str, ast.expr]) -> None:
    bound, declared = instance.bound, instance.bound.block.coefficients
    if declared is None:
        return
    period_s = emitter.program.period_ns / NS_PER_S
    literals = {
        name: given.value for name in declared.parameters if isinstance(given := bound.arguments.get(name), RealLiteral)
    }
    if not instance.variable_coefficients:
        values, _ = evaluate(bound.block, period_s, literals)
        bindings.update((name, build.constant(value)) for name, value in zip(declared.names, values, strict=True))
        return
    prefix = instance.prefix
    now = [emitter.keep(_block_value(emitter, bound.arguments[name])) for name in instance.variable_coefficients]
    seen = [f"{prefix}seen_{name.lower()}" for name in instance.variable_coefficients]
    function = f"{prefix}coefficients"
    emitter.extra_globals[function] = coefficient_function(
        bound.block, period_s, literals, instance.variable_coefficients
    )
    was, targets = f"{prefix}was_limited", [prefix + name for name in declared.names]
    changed = [build.compare(build.name(old), "<>", new) for old, new in zip(seen, now, strict=True)]
    not_before = ast.UnaryOp(ast.Invert(), build.name(was))
    news = build.binary(build.name(f"{prefix}limited"), "AND", not_before)
    recompute: list[ast.stmt] = [
        *(build.assign(old, new) for old, new in zip(seen, now, strict=True)),
        build.assign(was, build.name(f"{prefix}limited")),
        build.assign_all([*targets, f"{prefix}limited"], build.call(function, *now)),
        build.when(news, [emitter.log_call(build.constant(COEFFICIENT_LIMIT))]),
    ]
    emitter.emit(build.when(changed[0] if len(changed) == 1 else build.either(*changed), recompute))
    bindings.update((name, build.name(prefix + name)) for name in declared.names)


def coefficient_function(
    block: Block, period_s: float, literals: dict[str, float], variable: tuple[str, ...]
) -> Callable[..., tuple[float, ...]]:
    """Return what computes a block's coefficients from its variable parameters, and a bit for each that is limited."""

    def coefficients(*values: float) -> tuple[float, ...]:
        results, limited = evaluate_noting(block, period_s, {**literals, **dict(zip(variable, values, strict=True))})
        return (*results, limited)

    return coefficients
