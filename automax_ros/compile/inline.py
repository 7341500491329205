"""Inlining of a block's step function into the scan, from its syntax tree.

The parameters become the expressions of the CALL, the locals get the block's prefix, constants fold, branches that
cannot run and outputs that nobody programs disappear.
"""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.declaration import HELPERS, Block
from automax_ros.compile import build
from automax_ros.compile.folding import Fold, TableReader, fold_body, value_of, without_dead_stores
from automax_ros.compile.simplify import carry_on


@dataclass(frozen=True)
class StepTree:
    """The syntax tree of a step function, taken apart."""

    parameters: tuple[str, ...]
    body: tuple[ast.stmt, ...]
    results: tuple[ast.expr, ...]
    assigned: frozenset[str]


@dataclass(frozen=True)
class Binding:
    """What the names of a step function stand for in one CALL.

    ``values`` has an expression, simple or without side effects, for each input, coefficient and fact of the CALL that
    is programmed; ``states`` the Python name of each state, a data structure's included; ``tables`` what reads each
    table; ``prefix`` begins the name of every local.
    """

    prefix: str
    values: Mapping[str, ast.expr]
    states: Mapping[str, str]
    tables: Mapping[str, TableReader]


@dataclass(frozen=True)
class Inlined:
    """Statements that carry a block out. ``outputs`` and ``error`` are expressions valid after them.

    ``error`` is None where the block cannot log anything as it is programmed.
    """

    body: list[ast.stmt]
    outputs: dict[str, ast.expr]
    error: ast.expr | None


@functools.cache
def step_tree(block: Block) -> StepTree:
    """Return the taken apart step function of a block.

    Raises:
        TypeError: the function is not of the form that ``blocks.declaration`` asks for.
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
    expected = len(block.outputs) + len(block.states) + bool(_can_log_in_step(block))
    if len(results) != expected:
        raise TypeError(f"the step of {block.name} returns {len(results)} values, {expected} are declared")
    constants = _global_constants(block, body, last)
    body = [_Constants(constants).visit(statement) for statement in body]
    results = tuple(_Constants(constants).visit(result) for result in results)
    assigned = {
        node.id
        for part in body
        for node in ast.walk(part)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    return StepTree(tuple(argument.arg for argument in parsed.args.args), tuple(body), results, frozenset(assigned))


def _can_log_in_step(block: Block) -> bool:
    """Return whether the step returns an error: all that is logged but coefficients out of limits comes from there."""
    return any(code != "AMX7004" for code in block.logs)


def _global_constants(block: Block, body: Sequence[ast.stmt], last: ast.Return) -> dict[str, ast.expr]:
    """Return the module constants that a step function reads, as literals."""
    assert block.step is not None
    scope = block.step.__globals__
    names = {node.id for part in (*body, last) for node in ast.walk(part) if isinstance(node, ast.Name)}
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
        binding: what the step's names stand for.
        wanted: for each programmed output its target: the Python name it may be computed in directly, or "" where the
            result has to stand in a local of its own.
        free: targets of ``wanted`` that no binding reads, so that they may be assigned before the block is through.
    """
    tree = step_tree(block)
    prefix = binding.prefix
    results = dict(zip([output.variable for output in block.outputs], tree.results, strict=False))
    names, opening = _names(tree, binding, results, wanted, free)
    fold = Fold(names, HELPERS, binding.tables)
    body = opening + fold_body(tree.body, fold)
    outputs = {output.name: fold.visit(results[output.variable]) for output in block.outputs if output.name in wanted}
    state_results = tree.results[len(block.outputs) : len(block.outputs) + len(block.states)]
    fleeting = _fleeting(block, tree, several_outputs=len(wanted) > 1)
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
    states = {binding.states[state.name] for state in block.states}
    own = frozenset(prefix + local for local in tree.assigned - set(tree.parameters))
    results_now = {**outputs, **({"": error} if error is not None else {})}
    body, results_now = carry_on(body, results_now, own - states)
    error = results_now.pop("", None)
    outputs = results_now
    needed = states | {
        node.id
        for part in [*outputs.values(), *([error] if error else [])]
        for node in ast.walk(part)
        if isinstance(node, ast.Name)
    }
    return Inlined(without_dead_stores(body, needed), outputs, error)


def _names(
    tree: StepTree,
    binding: Binding,
    results: Mapping[str, ast.expr],
    wanted: Mapping[str, str],
    free: frozenset[str],
) -> tuple[dict[str, ast.expr], list[ast.stmt]]:
    """Return the expression for each name of a step, and the statements that give assigned parameters their value."""
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
    """Return the output variable that a local of the step may be, so that no copy is needed."""
    for keyword, target in wanted.items():
        result = results[keyword.lower()]
        if target and target in free and isinstance(result, ast.Name) and result.id == local:
            return target
    return None


def _fleeting(block: Block, tree: StepTree, *, several_outputs: bool) -> set[str]:
    """Return the names that may have changed when the outputs are stored.

    Those are states that get a new value, and inputs, whose variable another output may be stored in.
    """
    states = [state.name for state in block.states]
    new = tree.results[len(block.outputs) : len(block.outputs) + len(states)]
    changing = {
        name
        for name, result in zip(states, new, strict=True)
        if not (isinstance(result, ast.Name) and result.id == name)
    }
    inputs = set(tree.parameters) - set(states) - tree.assigned if several_outputs else set()
    return changing | inputs


def _store_states(block: Block, places: Mapping[str, str], results: Sequence[ast.expr]) -> list[ast.stmt]:
    """Return the assignments of those states that are not already computed in place, all at once."""
    pairs = [
        (places[state.name], result)
        for state, result in zip(block.states, results, strict=True)
        if not (isinstance(result, ast.Name) and result.id == places[state.name])
    ]
    if not pairs:
        return []
    if len(pairs) == 1:
        return [build.assign(pairs[0][0], pairs[0][1])]
    return [build.assign_all([name for name, _ in pairs], ast.Tuple([value for _, value in pairs], ast.Load()))]
