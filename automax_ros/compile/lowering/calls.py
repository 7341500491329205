"""Lowering of CALL statements: bind parameters, compute coefficients, inline the step, store outputs.

Block statements work on the latch: a simple common INTEGER, DOUBLE INTEGER or BOOLEAN is the Python local that the scan
filled at its start. REALs, strings and array elements are read and written in actual memory (3.3).

The CALL that begins the scans of a drive's task is executed by ``io.minor_loop`` (52.0); its inputs are read, and its
outputs written, as those of any block. In a scan of modeled time the loop is executed at the end of the block's time
(decision).
"""

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from automax_ros.blocks.declare.coefficients import evaluate
from automax_ros.blocks.declare.declaration import (
    CALL_FACTS,
    COEFFICIENT_LIMITED,
    Block,
    Form,
    Input,
    Output,
    Special,
    State,
)
from automax_ros.blocks.discrete.shift import STRUCTURE_STATES
from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import Emitter, forced_name, latched_name, structure_prefix, variable_name
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.compile.blocks.coefficients import CoefficientFunction, kept_names, quick_form
from automax_ros.compile.blocks.folding import TableReader, value_of
from automax_ros.compile.blocks.inline import Binding, Inlined, inline, log_in_place, names_in
from automax_ros.compile.lowering.expressions import lower_element, lower_index
from automax_ros.compile.lowering.stores import write_at
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.language.checks.rules.typing_rules import type_of
from automax_ros.language.program import BoundCall
from automax_ros.language.tree.tree import (
    BooleanLiteral,
    Element,
    Expression,
    IntegerLiteral,
    RealLiteral,
    Reference,
    Scope,
    Target,
    Unary,
)

RESULT = "loop_outputs"
"""The local that holds the result of ``io.minor_loop``."""


def lower_minor_loop(emitter: Emitter, bound: BoundCall) -> None:
    """Emit the loop's scan, after the latch."""
    emitter.line = bound.line
    emitter.mark_line(bound.line)
    with emitter.statement(bound.line), emitter.block():
        _lower(emitter, bound)


def _lower(emitter: Emitter, bound: BoundCall) -> None:
    inputs: list[ast.expr] = [_loop_input(emitter, bound, item) for item in bound.block.inputs]
    values = [output for output in bound.block.outputs if not output.dimensions]
    places = [place for place in places_of(emitter, bound) if not place.output.dimensions]
    emitter.add_cost(emitter.cost_model.loop_ns)
    emitter.checkpoint()
    call = build.call(emitter.member("minor_loop"), ast.Tuple(inputs, build.LOAD), _records(emitter, bound))
    emitter.emit(build.assign(RESULT, call))
    if not places:
        return
    with emitter.suite() as suite:
        results = [build.item(RESULT, build.constant(values.index(place.output))) for place in places]
        store_all(emitter, list(zip(places, results, strict=True)))
        drop_forced(emitter, [place.target for place in places])
    emitter.emit(build.when(build.name(RESULT), suite))


def _loop_input(emitter: Emitter, bound: BoundCall, item: Input) -> ast.expr:
    """Return the value of an input for the loop: as programmed, its default, or None where it needs none."""
    given = bound.arguments.get(item.name)
    if given is not None:
        return block_value(emitter, given)
    return build.constant(bound.defaults[item.name]) if item.name in bound.defaults else ast.Constant(None)


def _records(emitter: Emitter, bound: BoundCall) -> ast.expr:
    """Return the task's own array that an output of several dimensions names, None without one."""
    for output in bound.block.outputs:
        given = bound.arguments.get(output.name)
        if output.dimensions and isinstance(given, Reference) and emitter.symbol(given.name).scope is Scope.LOCAL:
            return build.name(variable_name(given.name))
    return ast.Constant(None)


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


def instance_of(bound: BoundCall, prefix: str, occurrence: int, period_ns: int) -> BlockInstance:
    """Return the instance of a CALL; ``occurrence`` counts the calls of one line from 0."""
    place = f"{bound.line}" if occurrence == 0 else f"{bound.line}.{occurrence + 1}"
    return BlockInstance(bound, f"{place} {bound.block.name}", prefix, _evaluated_parameters(bound, period_ns))


def _evaluated_parameters(bound: BoundCall, period_ns: int) -> tuple[str, ...]:
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
    declared = bound.block.coefficients
    return {
        name: float(given.value)
        for name in (declared.parameters if declared else ())
        if isinstance(given := bound.arguments.get(name), (RealLiteral, IntegerLiteral, BooleanLiteral))
    }


def lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    """Emit one block."""
    with emitter.block():
        _lower_block(emitter, instance)


def _lower_block(emitter: Emitter, instance: BlockInstance) -> None:
    bound, block = instance.bound, instance.bound.block
    values = {item.variable: _input(emitter, bound, item) for item in block.inputs if _is_value(block, item)}
    outputs = places_of(emitter, bound)
    facts = bound.facts
    for name in CALL_FACTS:
        if name in facts:
            values.setdefault(name, build.constant(facts[name]))
    _bind_coefficients(emitter, instance, values)
    wanted = {place.output.name: place.local for place in outputs}
    binding = Binding(instance.prefix, values, instance.states, _tables(emitter, bound))
    inlined = inline(block, binding, wanted, _free(values, outputs))
    body = inlined.body
    emitter.emit(*(log_in_place(body, inlined.error, emitter.log_call) if inlined.error is not None else body))
    _cost_of_search(emitter, bound, inlined)
    for holds, places in itertools.groupby(outputs, key=lambda place: place.output.holds):
        stores = [(place, inlined.outputs[place.output.name]) for place in places]
        if holds:
            _store_when(emitter, inlined.writes, stores)
        else:
            store_all(emitter, stores)
    drop_forced(emitter, [place.target for place in outputs])


def _cost_of_search(emitter: Emitter, bound: BoundCall, inlined: Inlined) -> None:
    """Emit the time of the elements that a block has searched; its output gives their number."""
    element_ns = emitter.cost_model.element_ns(bound)
    if emitter.modeled and element_ns:
        last = emitter.keep(inlined.outputs[bound.block.searched_to])
        found = build.compare(last, ">=", build.constant(0))
        count = build.choose(found, build.binary(last, "+", build.constant(1)), build.constant(bound.elements))
        emitter.emit(build.add_to("cost", build.binary(build.constant(element_ns), "*", count)))


def drop_forced(emitter: Emitter, targets: Sequence[Expression]) -> None:
    """Emit the restoring of forced commons among a block's targets to their forced values."""
    names = [target.name for target in targets if isinstance(target, Reference) and target.name in emitter.forces]
    for name in dict.fromkeys(names):
        restore = build.assign(variable_name(name), build.name(latched_name(name)))
        emitter.emit(build.when(build.name(forced_name(name)), [restore]))


@dataclass(frozen=True)
class Place:
    """The place of an output: ``local`` is its Python name, "" where it is in actual memory or in an array.

    For an array element ``index`` and ``in_range`` come from its subscripts, evaluated before the block.
    """

    output: Output
    target: Target
    local: str
    index: ast.expr | None = None
    in_range: ast.expr | None = None


def places_of(emitter: Emitter, bound: BoundCall) -> list[Place]:
    """Return the outputs' places, in the order of the CALL; their subscripts are evaluated here, before the block."""
    declared = {output.name: output for output in bound.block.outputs}
    given = [(declared[name], target) for name, target in bound.arguments.items() if name in declared]
    changing = frozenset(_local(emitter, target) for _, target in given)
    places: list[Place] = []
    for output, target in given:
        assert isinstance(target, (Reference, Element))
        place = Place(output, target, _local(emitter, target))
        if isinstance(target, Element):
            index, in_range = lower_index(emitter, target, changing)
            place = replace(place, index=index, in_range=in_range)
        places.append(place)
    return places


def _is_value(block: Block, item: Input) -> bool:
    """Return whether an input is a value for the step: not a name, nor a variable that coefficients depend on."""
    if not isinstance(item.type, DataType):
        return False
    from_coefficients = block.coefficients is not None and item.name in block.coefficients.parameters
    return item.form is Form.LITERAL or not from_coefficients


def _input(emitter: Emitter, bound: BoundCall, item: Input) -> ast.expr:
    """Return the value of an input for the step: as programmed, its default, or 0 where the block needs none."""
    given = bound.arguments.get(item.name)
    if given is not None:
        return block_value(emitter, given)
    assert isinstance(item.type, DataType)
    return build.constant(bound.defaults.get(item.name, item.type.zero))


def _tables(emitter: Emitter, bound: BoundCall) -> dict[str, TableReader]:
    """Return the readers of a CALL's tables; a common array is read from actual memory when the block is executed.

    A block reads its table at one instant, also where execution times are modeled (decision).
    """
    readers: dict[str, TableReader] = {}
    for item in bound.block.inputs:
        if item.type is not Special.TABLE:
            continue
        given = bound.arguments.get(item.name)
        if given is None:
            readers[item.variable] = lambda _: build.constant(0)  # never read
            continue
        assert isinstance(given, Reference)
        if emitter.symbol(given.name).scope is Scope.COMMON:
            emitter.checkpoint()
        readers[item.variable] = emitter.element_reader(given.name)
    return readers


def block_value(emitter: Emitter, given: Expression) -> ast.expr:
    """Return the value of a parameter in a block."""
    if isinstance(given, (IntegerLiteral, RealLiteral, BooleanLiteral)):
        return build.constant(given.value)
    if isinstance(given, Unary):
        return build.inverse(block_value(emitter, given.operand))
    if isinstance(given, Element):
        return lower_element(emitter, given).node
    assert isinstance(given, Reference)
    return emitter.read(given.name)


def _real_value(emitter: Emitter, given: Expression) -> ast.expr:
    value = block_value(emitter, given)
    literal = value_of(value)
    if isinstance(literal, (int, float)):
        return build.constant(float(literal))
    return value if type_of(given) is DataType.REAL else build.binary(value, "+", build.constant(0.0))


def _local(emitter: Emitter, target: Expression) -> str:
    if isinstance(target, Reference) and target.name not in emitter.held:
        symbol = emitter.symbol(target.name)
        if symbol.latched or target.name not in emitter.views:
            return variable_name(target.name)
    return ""


def _free(bindings: dict[str, ast.expr], outputs: list[Place]) -> frozenset[str]:
    """Return the targets in which a block may compute: always written, not read by inputs, used by one output only."""
    read = {name for binding in bindings.values() for name in names_in(binding)}
    targets = [place.local for place in outputs]
    always = {place.local for place in outputs if place.local and not place.output.holds}
    return frozenset(target for target in always - read if targets.count(target) == 1)


def _store_when(emitter: Emitter, test: ast.expr, stores: list[tuple[Place, ast.expr]]) -> None:
    """Emit the stores of outputs that hold: where they are not written, they are not read either."""
    fixed = value_of(test)
    if fixed is not None:
        store_all(emitter, stores if fixed else [])
        return
    emitter.book_cost()
    with emitter.suite() as suite:
        store_all(emitter, stores)
    emitter.emit(build.when(test, suite))


def store_all(emitter: Emitter, stores: list[tuple[Place, ast.expr]]) -> None:
    """Emit the stores of values into outputs."""
    for place, value in stores:
        if place.index is not None:
            write_at(emitter, place.target.name, place.index, place.in_range, emitter.keep(value))
        elif not place.local:
            emitter.write(place.target.name, value)
        elif not (isinstance(value, ast.Name) and value.id == place.local):
            emitter.emit(build.assign(place.local, value))


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
    now = [emitter.keep(_real_value(emitter, bound.arguments[name])) for name in instance.evaluated]
    seen = [f"{prefix}seen_{name.lower()}" for name in instance.evaluated]
    function = f"{prefix}coefficients"
    emitter.extra_globals[function] = CoefficientFunction(
        bound.block, period_s, literals, instance.evaluated, quick_form
    )
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
