"""Lowering of CALL statements: bind parameters, compute coefficients, inline the step, store outputs.

Block statements work on the latch: a simple common INTEGER, DOUBLE INTEGER or BOOLEAN is the Python local that the scan
filled at its start. REALs, strings and array elements are read and written in actual memory (3.3).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.coefficients import evaluate, evaluate_noting
from automax_ros.blocks.declaration import (
    CALL_FACTS,
    COEFFICIENT_LIMITED,
    Block,
    Coefficients,
    Form,
    Input,
    Output,
    Special,
    State,
)
from automax_ros.blocks.shift import STRUCTURE_STATES
from automax_ros.compile import build
from automax_ros.compile.emitter import Emitter
from automax_ros.compile.expressions import SUBSCRIPT, lower_element, lower_index
from automax_ros.compile.folding import TableReader
from automax_ros.compile.inline import Binding, inline
from automax_ros.compile.layout import Role, StateField
from automax_ros.compile.pynames import forced_name, latched_name, structure_prefix, variable_name
from automax_ros.compile.simplify import log_in_place
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.language.program import BoundCall
from automax_ros.language.syntax.tree import (
    BooleanLiteral,
    Element,
    Expression,
    IntegerLiteral,
    RealLiteral,
    Scope,
    Unary,
    Variable,
)


@dataclass(frozen=True)
class BlockInstance:
    """One CALL in one task: its name in the layout, the prefix of its Python names, its state fields in order.

    ``evaluated`` are the parameters of coefficients that are evaluated while the task runs; empty where all are fixed.
    """

    bound: BoundCall
    label: str
    prefix: str
    evaluated: tuple[str, ...]

    @property
    def states(self) -> dict[str, str]:
        """The Python name of each state: the block's own, and those of the data structure that it uses."""
        block, structure = self.bound.block, self.bound.structure
        if structure is None:
            return {state.name: self.prefix + state.name for state in block.states}
        return {name: structure_prefix(structure.name) + name for name in STRUCTURE_STATES}

    @property
    def fields(self) -> list[tuple[str, StateField]]:
        """The state fields with their Python names: the block's states, then those of evaluated coefficients."""
        entries = [(self.states[state.name], self._state_field(state)) for state in self.bound.block.states]
        return [*entries, *((self.prefix + name, field) for name, field in self._coefficient_fields())]

    def _state_field(self, state: State) -> StateField:
        structure = self.bound.structure
        label = self.label if structure is None else structure.name
        facts = self.bound.facts
        size = 1 if state.size is None else state.size(facts)
        dimensions = () if state.size is None else (size,)
        return StateField(
            f"{label}.{state.name}",
            state.type,
            Role.BLOCK,
            state.initial,
            size,
            is_array=state.size is not None,
            dimensions=dimensions,
            below=0 if state.below is None else state.below(facts),
        )

    def _coefficient_fields(self) -> Iterator[tuple[str, StateField]]:
        declared = self.bound.block.coefficients
        if declared is None or not self.evaluated:
            return
        kinds: list[tuple[str, DataType, Value]] = [
            *((f"seen_{name.lower()}", DataType.REAL, math.inf) for name in self.evaluated),
            *((name, DataType.REAL, 0.0) for name in declared.names),
            *((name, DataType.REAL, 0.0) for name in kept_names(declared)),
            ("limited", DataType.DOUBLE, 0),
        ]
        for name, kind, initial in kinds:
            yield name, StateField(f"{self.label}.{name}", kind, Role.BLOCK, initial)


def kept_names(declared: Coefficients) -> list[str]:
    """Return the names of the states that hold the last values that met the relation of coefficients."""
    return [] if declared.relation is None else [f"kept_{name.lower()}" for name in declared.relation.parameters]


def instance_of(bound: BoundCall, prefix: str, occurrence: int, period_ns: int) -> BlockInstance:
    """Return the instance that a CALL makes; ``occurrence`` counts the calls of one line from 0."""
    place = f"{bound.line}" if occurrence == 0 else f"{bound.line}.{occurrence + 1}"
    return BlockInstance(bound, f"{place} {bound.block.name}", prefix, _evaluated(bound, period_ns))


def _evaluated(bound: BoundCall, period_ns: int) -> tuple[str, ...]:
    """Return the parameters to evaluate while the task runs: variables, and literals that have to be limited."""
    declared = bound.block.coefficients
    if declared is None:
        return ()
    given = [name for name in declared.parameters if name in bound.arguments]
    literals = _literals(bound)
    if len(literals) < len(given):
        return tuple(name for name in given if name not in literals)
    if declared.limits_literals and evaluate(bound.block, period_ns / NS_PER_S, literals)[1]:
        return tuple(given)
    return ()


def _literals(bound: BoundCall) -> dict[str, float]:
    """Return the parameters of coefficients that are given as literals."""
    declared = bound.block.coefficients
    return {
        name: float(given.value)
        for name in (declared.parameters if declared else ())
        if isinstance(given := bound.arguments.get(name), (RealLiteral, IntegerLiteral, BooleanLiteral))
    }


def lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    """Emit one block."""
    emitter.in_block = True
    _lower_block(emitter, instance)
    emitter.in_block = False


def _lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    bound, block = instance.bound, instance.bound.block
    values = {item.variable: _input(emitter, bound, item) for item in block.inputs if _is_value(block, item)}
    facts = bound.facts
    for name in CALL_FACTS:
        if name in facts:
            values.setdefault(name, build.constant(facts[name]))
    _bind_coefficients(emitter, instance, values)
    held: dict[str, ast.expr] = {}
    for output in block.outputs:
        if output.holds and output.name in bound.arguments:
            held[output.name] = values[output.variable] = _block_value(emitter, bound.arguments[output.name])
        elif output.holds:
            values[output.variable] = build.constant(output.type.zero)
    wanted = {
        output.name: _direct_name(emitter, bound.arguments[output.name])
        for output in block.outputs
        if output.name in bound.arguments
    }
    binding = Binding(instance.prefix, values, instance.states, _tables(emitter, bound))
    inlined = inline(block, binding, wanted, _free(values, wanted, held))
    body = inlined.body
    emitter.emit(*(log_in_place(body, inlined.error, emitter.log_call) if inlined.error is not None else body))
    for output in block.outputs:
        if output.name in wanted:
            _store_output(emitter, output, bound.arguments[output.name], inlined.outputs[output.name], held)
    _drop_forced(emitter, [bound.arguments[name] for name in wanted])


def _drop_forced(emitter: Emitter, targets: Sequence[Expression]) -> None:
    """Emit that forced commons among a block's targets have the forced value, whatever the block gave them."""
    names = [target.name for target in targets if isinstance(target, Variable) and target.name in emitter.forces]
    for name in dict.fromkeys(names):
        restore = build.assign(variable_name(name), build.name(latched_name(name)))
        emitter.emit(build.when(build.name(forced_name(name)), [restore]))


def _is_value(block: Block, item: Input) -> bool:
    """Return whether the step can take an input as a value: no name, and no variable that coefficients come from."""
    if not isinstance(item.type, DataType):
        return False
    from_coefficients = block.coefficients is not None and item.name in block.coefficients.parameters
    return item.form is Form.LITERAL or not from_coefficients


def _input(emitter: Emitter, bound: BoundCall, item: Input) -> ast.expr:
    """Return what the step gets for an input: as programmed, its default, or 0 where the block does without it."""
    given = bound.arguments.get(item.name)
    if given is not None:
        return _block_value(emitter, given)
    assert isinstance(item.type, DataType)
    return build.constant(bound.defaults.get(item.name, item.type.zero))


def _tables(emitter: Emitter, bound: BoundCall) -> dict[str, TableReader]:
    """Return what reads the tables of a CALL; a common array is read from actual memory, as the block comes to it.

    A block reads its table at one instant, also where execution times are modeled (decision).
    """
    readers: dict[str, TableReader] = {}
    for item in bound.block.inputs:
        if item.type is not Special.TABLE:
            continue
        given = bound.arguments.get(item.name)
        if given is None:
            readers[item.variable] = _no_table
            continue
        assert isinstance(given, Variable)
        if emitter.symbol(given.name).scope is Scope.COMMON:
            emitter.checkpoint()
        readers[item.variable] = emitter.element_reader(given.name)
    return readers


def _no_table(_index: ast.expr) -> ast.expr:
    """Return what stands for an element of a table that is not programmed, which is never read."""
    return build.constant(0)


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


def _bind_coefficients(emitter: Emitter, instance: BlockInstance, values: dict[str, ast.expr]) -> None:
    bound, declared = instance.bound, instance.bound.block.coefficients
    if declared is None:
        return
    period_s = emitter.program.period_ns / NS_PER_S
    literals = _literals(bound)
    if not instance.evaluated:
        results, _ = evaluate(bound.block, period_s, literals)
        values.update((name, build.constant(value)) for name, value in zip(declared.names, results, strict=True))
        return
    prefix = instance.prefix
    now = [emitter.keep(_block_value(emitter, bound.arguments[name])) for name in instance.evaluated]
    seen = [f"{prefix}seen_{name.lower()}" for name in instance.evaluated]
    function = f"{prefix}coefficients"
    emitter.extra_globals[function] = coefficient_function(bound.block, period_s, literals, instance.evaluated)
    was, kept = f"{prefix}was_limited", [prefix + name for name in kept_names(declared)]
    targets = [*(prefix + name for name in declared.names), *kept, f"{prefix}limited"]
    changed = [build.compare(build.name(old), "<>", new) for old, new in zip(seen, now, strict=True)]
    not_before = ast.UnaryOp(ast.Invert(), build.name(was))
    news = build.binary(build.name(f"{prefix}limited"), "AND", not_before)
    recompute: list[ast.stmt] = [
        *(build.assign(old, new) for old, new in zip(seen, now, strict=True)),
        build.assign(was, build.name(f"{prefix}limited")),
        build.assign_all(targets, build.call(function, *now, *(build.name(name) for name in kept))),
        build.when(news, [emitter.log_call(build.constant(COEFFICIENT_LIMITED))]),
    ]
    emitter.emit(build.when(changed[0] if len(changed) == 1 else build.either(*changed), recompute))
    values.update((name, build.name(prefix + name)) for name in declared.names)


def coefficient_function(
    block: Block, period_s: float, literals: Mapping[str, float], evaluated: tuple[str, ...]
) -> Callable[..., tuple[float, ...]]:
    """Return what computes a block's coefficients from evaluated parameters and what was kept of the last time.

    It returns the coefficients, what to keep, and what is limited as bits of a number.
    """

    def coefficients(*values: float) -> tuple[float, ...]:
        given = {**literals, **dict(zip(evaluated, values, strict=False))}
        results, keep, limited = evaluate_noting(block, period_s, given, values[len(evaluated) :])
        return (*results, *keep, limited)

    return coefficients
