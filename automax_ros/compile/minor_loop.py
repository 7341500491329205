"""Lowering of the CALL that begins the scans of a drive's task: ``io.minor_loop`` executes it (52.0).

Inputs are read, and outputs written, as those of any block: simple INTEGER and BOOLEAN commons in the latch, the others
in actual memory. In a scan of modeled time the loop is executed at the end of the block's time (decision).
"""

from __future__ import annotations

import ast

from automax_ros.blocks.declaration import Input
from automax_ros.compile import build
from automax_ros.compile.calls import block_value, drop_forced, places_of, store_all
from automax_ros.compile.emitter import Emitter
from automax_ros.compile.pynames import variable_name
from automax_ros.language.program import BoundCall
from automax_ros.language.syntax.tree import Reference, Scope

RESULT = "loop_outputs"
"""The local that holds what ``io.minor_loop`` returned."""


def lower_minor_loop(emitter: Emitter, bound: BoundCall) -> None:
    """Emit the loop's scan, after the latch."""
    emitter.line = bound.line
    emitter.mark_line(bound.line)
    with emitter.statement(bound.line):
        emitter.in_block = True
        _lower(emitter, bound)
        emitter.in_block = False


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
    """Return what the loop gets for an input: as programmed, its default, or None where it does without it."""
    given = bound.arguments.get(item.name)
    if given is not None:
        return block_value(emitter, given)
    return build.constant(bound.defaults[item.name]) if item.name in bound.defaults else ast.Constant(None)


def _records(emitter: Emitter, bound: BoundCall) -> ast.expr:
    """Return the array of the task's own that an output of several dimensions names, None without one."""
    for output in bound.block.outputs:
        given = bound.arguments.get(output.name)
        if output.dimensions and isinstance(given, Reference) and emitter.symbol(given.name).scope is Scope.LOCAL:
            return build.name(variable_name(given.name))
    return ast.Constant(None)
