"""Inlining of a block's step function into the scan, from its syntax tree.

The parameters become the expressions of the CALL, the locals get the block's prefix, constants are folded, unreachable
branches and outputs that are not programmed are removed. Then literals and copies are propagated, and errors are logged
where they occur.
"""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar, cast

from automax_ros.blocks.declare.declaration import HELPERS, Block
from automax_ros.compile.base import build
from automax_ros.compile.blocks.folding import Fold, TableReader, fold_body, value_of, without_dead_stores

MOST_ROUNDS = 8
"""Rounds of propagation; step functions need two or three."""


_WRITES, _ERROR = "writes", "error"
"""Keys among the results, whose other keys are keywords in upper case."""
_Pairs = tuple[tuple[str, str], ...]
_PREFIX = "_p_"
_Node = TypeVar("_Node", bound=ast.AST)


def carry_on(
    body: list[ast.stmt], outputs: Mapping[str, ast.expr], own: frozenset[str]
) -> tuple[list[ast.stmt], dict[str, ast.expr]]:
    """Replace ``own`` locals that are set once by their values, if literals or names that the body does not set."""
    results = dict(outputs)
    for _ in range(MOST_ROUNDS):
        bindings = _collect_carried(body, own)
        if not bindings:
            break
        fold = Fold(bindings, HELPERS)
        body = fold_body(_without(body, bindings), fold)
        results = {name: fold.visit(value) for name, value in results.items()}
    return body, results


def _collect_carried(body: list[ast.stmt], own: frozenset[str]) -> dict[str, ast.expr]:
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
    """Return the body with an error logged where it occurs, or after the body where more than one may occur."""
    if isinstance(error, ast.Name) and _only_literals(body, error.id) and _most_errors(body, error.id) <= 1:
        return _logging(body, error.id, log)
    return [*body, build.when(error, [log(error)])]


def _only_literals(body: list[ast.stmt], name: str) -> bool:
    nodes = list(build.nodes(*body))
    if any(isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Load) for node in nodes):
        return False
    assignments = [node for node in nodes if isinstance(node, ast.Assign) and _sets(node, name)]
    return _stores(body)[name] == len(assignments) and all(value_of(node.value) is not None for node in assignments)


def _sets(statement: ast.Assign, name: str) -> bool:
    return isinstance(statement.targets[0], ast.Name) and statement.targets[0].id == name


def _most_errors(body: list[ast.stmt], name: str) -> int:
    """Return the most times that one pass can set the error to a problem."""
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


@dataclass(frozen=True)
class StepTree:
    """The parts of a step function's syntax tree."""

    parameters: tuple[str, ...]
    body: tuple[ast.stmt, ...]
    results: tuple[ast.expr, ...]
    assigned: frozenset[str]


@dataclass(frozen=True)
class Binding:
    """The bindings of a step function's names in one CALL.

    ``values`` has an expression, simple or without side effects, for each programmed input, coefficient and fact of the
    CALL; ``states`` the Python name of each state, including those of a data structure; ``tables`` the reader of each
    table; ``prefix`` begins the name of every local.
    """

    prefix: str
    values: Mapping[str, ast.expr]
    states: Mapping[str, str]
    tables: Mapping[str, TableReader]


@dataclass(frozen=True)
class Inlined:
    """The statements that execute a block; the other fields are expressions valid after them.

    ``outputs`` stay valid while outputs are stored in the order of ``wanted``. ``writes`` says whether outputs that
    hold are written. ``error`` is None where the block as programmed cannot log anything.
    """

    body: list[ast.stmt]
    outputs: dict[str, ast.expr]
    writes: ast.expr
    error: ast.expr | None


@functools.cache
def step_tree(block: Block) -> StepTree:
    """Return the parts of a block's step function.

    Raises:
        TypeError: the function does not have the form that ``blocks/declare/declaration`` requires.
    """
    if block.step is None:
        raise TypeError(f"{block.name} has no step function")
    parsed = ast.parse(textwrap.dedent(inspect.getsource(block.step))).body[0]
    if not isinstance(parsed, ast.FunctionDef):
        raise TypeError(f"the step of {block.name} is not a plain function")
    body = list(parsed.body)
    if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
        body = body[1:]
    last = body.pop()
    if not isinstance(last, ast.Return) or last.value is None:
        raise TypeError(f"the step of {block.name} does not end with its return")
    results = tuple(last.value.elts) if isinstance(last.value, ast.Tuple) else (last.value,)
    expected = len(block.outputs) + len(block.states) + block.holds + _can_log_in_step(block)
    if len(results) != expected:
        raise TypeError(f"the step of {block.name} returns {len(results)} values, {expected} are declared")
    constants = _global_constants(block, body, last)
    body = [_Constants(constants).visit(statement) for statement in body]
    results = tuple(_Constants(constants).visit(result) for result in results)
    assigned = {
        node.id for node in build.nodes(*body) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    return StepTree(tuple(argument.arg for argument in parsed.args.args), tuple(body), results, frozenset(assigned))


def _can_log_in_step(block: Block) -> bool:
    """Return whether the step returns an error: all but the coefficients' limits is logged from there."""
    return any(code != "AMX7004" for code in block.logs)


def _global_constants(block: Block, body: Sequence[ast.stmt], last: ast.Return) -> dict[str, ast.expr]:
    """Return the module constants that a step function reads, as literals."""
    assert block.step is not None
    scope = block.step.__globals__
    names = {node.id for node in build.nodes(*body, last) if isinstance(node, ast.Name)}
    found = {name: scope[name] for name in sorted(names) if name in scope and name not in HELPERS}
    parameters = set(inspect.signature(block.step).parameters)
    return {
        name: build.constant(value)
        for name, value in found.items()
        if name not in parameters and isinstance(value, (int, float, bool))
    }


class _Constants(ast.NodeTransformer):
    def __init__(self, values: Mapping[str, ast.expr]) -> None:
        self._values = values

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self._values.get(node.id, node) if isinstance(node.ctx, ast.Load) else node


def inline(block: Block, binding: Binding, wanted: Mapping[str, str], free: frozenset[str]) -> Inlined:
    """Return the statements of one call of a block.

    Args:
        block: the declaration.
        binding: the bindings of the step's names.
        wanted: for each programmed output, in the order in which they are stored, the Python name it is stored in, ""
            where it is stored differently.
        free: targets of ``wanted`` in which the block may compute directly: nothing reads them meanwhile.
    """
    if binding.tables:
        return _inline(block, binding, wanted, free)
    stand_ins = _StandIns()
    shape = (
        block,
        tuple((name, stand_ins.text(value)) for name, value in binding.values.items()),
        tuple((name, stand_ins.of(place)) for name, place in binding.states.items()),
        tuple((keyword, target and stand_ins.of(target)) for keyword, target in wanted.items()),
        frozenset(map(stand_ins.of, free)),
    )
    return stand_ins.replaced(_inlined_shape(*shape), binding.prefix)


class _StandIns:
    """Placeholders for the names of one CALL, numbered in their order: calls of one shape are inlined only once."""

    def __init__(self) -> None:
        self._numbers: dict[str, str] = {}

    def of(self, name: str) -> str:
        return self._numbers.setdefault(name, f"_{len(self._numbers)}")

    def text(self, value: ast.expr) -> str:
        if isinstance(value, ast.Name):
            return self.of(value.id)
        return ast.unparse(_rename(value, self.of))

    def replaced(self, inlined: Inlined, prefix: str) -> Inlined:
        """Return an inlined block with the names of the CALL in place of their placeholders."""
        names = {number: name for name, number in self._numbers.items()}

        def name_of(name: str) -> str:
            return prefix + name.removeprefix(_PREFIX) if name.startswith(_PREFIX) else names.get(name, name)

        return Inlined(
            [_rename(statement, name_of) for statement in inlined.body],
            {keyword: _rename(value, name_of) for keyword, value in inlined.outputs.items()},
            _rename(inlined.writes, name_of),
            None if inlined.error is None else _rename(inlined.error, name_of),
        )


def _rename(node: _Node, name_of: Callable[[str], str]) -> _Node:
    """Return a copy of a tree with its names replaced; nodes without names are shared."""
    if isinstance(node, ast.Name):
        return cast(_Node, _shared_name(name_of(node.id), isinstance(node.ctx, ast.Store)))
    if not isinstance(node, (ast.expr, ast.stmt)) or isinstance(node, ast.Constant):
        return node
    return type(node)(*(_renamed_part(getattr(node, field, None), name_of) for field in node._fields))


@functools.lru_cache(maxsize=256)
def _shared_name(identifier: str, stored: bool) -> ast.Name:
    """Return one node for all uses of a name: half of a task's tree is names, and sharing saves memory."""
    return ast.Name(identifier, build.STORE if stored else build.LOAD)


def _renamed_part(part: object, name_of: Callable[[str], str]) -> object:
    if isinstance(part, list):
        return [_renamed_part(item, name_of) for item in part]
    return _rename(part, name_of) if isinstance(part, ast.AST) else part


@functools.lru_cache(maxsize=512)
def _inlined_shape(block: Block, values: _Pairs, states: _Pairs, wanted: _Pairs, free: frozenset[str]) -> Inlined:
    expressions = {name: ast.parse(text, mode="eval").body for name, text in values}
    return _inline(block, Binding(_PREFIX, expressions, dict(states), {}), dict(wanted), free)


def _inline(block: Block, binding: Binding, wanted: Mapping[str, str], free: frozenset[str]) -> Inlined:
    tree = step_tree(block)
    prefix = binding.prefix
    results = dict(zip([output.variable for output in block.outputs], tree.results, strict=False))
    names, opening = _names(tree, binding, results, wanted, free)
    fold = Fold(names, HELPERS, binding.tables)
    body = opening + fold_body(tree.body, fold)
    outputs = {output.name: fold.visit(results[output.variable]) for output in block.outputs if output.name in wanted}
    state_results = tree.results[len(block.outputs) : len(block.outputs) + len(block.states)]
    fleeting = _fleeting(block, tree)
    for output in block.outputs:
        result = results[output.variable]
        if output.name in wanted and isinstance(result, ast.Name) and result.id in fleeting:
            copy = f"{prefix}out_{output.variable}"
            body.append(build.assign(copy, outputs[output.name]))
            outputs[output.name] = build.name(copy)
    body.extend(_store_states(block, binding.states, [fold.visit(result) for result in state_results]))
    error = fold.visit(tree.results[-1]) if _can_log_in_step(block) else None
    if error is not None and value_of(error) == 0:
        error = None
    writes = fold.visit(tree.results[len(block.outputs) + len(block.states)]) if block.holds else build.constant(True)
    states = {binding.states[state.name] for state in block.states}
    own = frozenset(prefix + local for local in tree.assigned - set(tree.parameters))
    results_now = {**outputs, _WRITES: writes, **({_ERROR: error} if error is not None else {})}
    body, results_now = carry_on(body, results_now, own - states)
    if block.holds:
        body = _left_to_the_stores(body, results_now, own - states)
    error = results_now.pop(_ERROR, None)
    copies = _kept_apart(results_now, wanted, prefix)
    needed = states | {
        name
        for part in [*results_now.values(), *(copy.value for copy in copies), *([error] if error else [])]
        for name in names_in(part)
    }
    body = [*without_dead_stores(body, needed), *copies]
    return Inlined(body, results_now, results_now.pop(_WRITES), error)


def names_in(expression: ast.expr) -> set[str]:
    """Return the variables that an expression reads."""
    return {node.id for node in build.nodes(expression) if isinstance(node, ast.Name)}


def _left_to_the_stores(body: list[ast.stmt], results: dict[str, ast.expr], own: frozenset[str]) -> list[ast.stmt]:
    """Return the body without its last assignments to locals that are single results: these are computed when stored.

    So nothing is computed for outputs that are not written.
    """
    names = {value.id: key for key, value in results.items() if isinstance(value, ast.Name)}
    nodes = [node for node in build.nodes(*body, *results.values()) if isinstance(node, ast.Name)]
    uses = Counter((node.id, isinstance(node.ctx, ast.Load)) for node in nodes)
    kept = list(body)
    while kept and isinstance(last := kept[-1], ast.Assign) and isinstance(target := last.targets[0], ast.Name):
        once = uses[target.id, True] == uses[target.id, False] == 1
        if not once or target.id not in own or target.id not in names:
            break
        results[names[target.id]] = last.value
        kept.pop()
    return kept


def _kept_apart(results: dict[str, ast.expr], wanted: Mapping[str, str], prefix: str) -> list[ast.Assign]:
    """Return copies of results that the stores of other outputs would change, and replace the results by them."""
    copies: list[ast.Assign] = []
    stored: set[str] = set()
    for keyword in (*wanted, _WRITES):
        value = results[keyword]
        if not stored.isdisjoint(names_in(value)):
            copy = f"{prefix}out_{keyword.lower()}"
            copies.append(build.assign(copy, value))
            results[keyword] = build.name(copy)
        stored.add(wanted.get(keyword, ""))
    return copies


def _names(
    tree: StepTree,
    binding: Binding,
    results: Mapping[str, ast.expr],
    wanted: Mapping[str, str],
    free: frozenset[str],
) -> tuple[dict[str, ast.expr], list[ast.stmt]]:
    """Return the expression for each name of a step, and the statements that initialize assigned parameters."""
    prefix = binding.prefix
    opening: list[ast.stmt] = []
    names: dict[str, ast.expr] = {}
    for parameter in tree.parameters:
        if parameter in binding.states:
            names[parameter] = build.name(binding.states[parameter])
        elif parameter in tree.assigned:
            target = _direct_target(parameter, results, wanted, free)
            names[parameter] = build.name(target or prefix + parameter)
            given = binding.values[parameter]
            if not (isinstance(given, ast.Name) and given.id == target):
                opening.append(build.assign(target or prefix + parameter, given))
        elif parameter not in binding.tables:
            names[parameter] = binding.values[parameter]
    for local in sorted(tree.assigned - set(tree.parameters)):
        names[local] = build.name(_direct_target(local, results, wanted, free) or prefix + local)
    return names, opening


def _direct_target(
    local: str, results: Mapping[str, ast.expr], wanted: Mapping[str, str], free: frozenset[str]
) -> str | None:
    """Return the output variable that can replace a local of the step, so that no copy is needed."""
    for keyword, target in wanted.items():
        result = results[keyword.lower()]
        if target and target in free and isinstance(result, ast.Name) and result.id == local:
            return target
    return None


def _fleeting(block: Block, tree: StepTree) -> set[str]:
    states = [state.name for state in block.states]
    new = tree.results[len(block.outputs) : len(block.outputs) + len(states)]
    return {
        name
        for name, result in zip(states, new, strict=True)
        if not (isinstance(result, ast.Name) and result.id == name)
    }


def _store_states(block: Block, places: Mapping[str, str], results: Sequence[ast.expr]) -> list[ast.stmt]:
    """Return the assignments, in one statement, of the states that are not already computed in place."""
    pairs = [
        (places[state.name], result)
        for state, result in zip(block.states, results, strict=True)
        if not (isinstance(result, ast.Name) and result.id == places[state.name])
    ]
    if not pairs:
        return []
    if len(pairs) == 1:
        return [build.assign(pairs[0][0], pairs[0][1])]
    return [build.assign_all([name for name, _ in pairs], ast.Tuple([value for _, value in pairs], build.LOAD))]
