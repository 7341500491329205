"""Shared by the compilations of control-block tasks and BASIC tasks: fields, names, and functions made of trees."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import HELPERS
from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import Emitter
from automax_ros.compile.base.functions import BUILTINS, OPERATIONS
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.language.program import Symbol


@dataclass(frozen=True)
class Form:
    """One of a task's functions as a tree, its statements with their BASIC lines; its callees, and its commons."""

    function: ast.FunctionDef
    known: Mapping[str, object]
    views: Mapping[str, int]


@contextmanager
def collections_paused() -> Iterator[None]:
    """Suspend garbage collection: a long task's tree is all alive, and scanning it takes most of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def assigned(body: list[ast.stmt]) -> frozenset[str]:
    """Return the names that statements set."""
    return frozenset(
        node.id for node in build.nodes(*body) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    )


def called(emitter: Emitter) -> dict[str, object]:
    """Return the functions that the lowered statements call, by name."""
    functions: dict[str, object] = dict(OPERATIONS)
    functions.update({builtin.carry_out.__name__: builtin.carry_out for builtin in BUILTINS.values()})
    functions.update(HELPERS)
    return {**HELPERS, **{name: functions[name] for name in sorted(emitter.calls)}}


def local_field(symbol: Symbol) -> StateField:
    """Return the field of a local variable or a tunable."""
    if symbol.tuning is not None:
        return StateField(symbol.name, symbol.type, Role.TUNABLE, symbol.tuning.current)
    return StateField(
        symbol.name,
        symbol.type,
        Role.LOCAL,
        symbol.type.zero,
        symbol.elements,
        is_array=bool(symbol.dimensions),
        dimensions=symbol.dimensions,
        length=symbol.length,
    )


def made(definitions: list[ast.FunctionDef], name: str, known: dict[str, object]) -> dict[str, object]:
    """Return the compiled functions of a task of this name; their only globals are ``known``."""
    with collections_paused():
        code = compile(build.placed(definitions), f"<{name}>", "exec")
    found: dict[str, object] = {"__builtins__": {}, **known}
    exec(code, found)
    return found


def stores(fields: list[str], body: list[ast.stmt]) -> list[ast.stmt]:
    """Return the stores of the fields that a body sets, one by one, which is faster than all at once."""
    set_there = assigned(body)
    return [
        build.set_item("state", build.constant(position), build.name(name))
        for position, name in enumerate(fields)
        if name in set_there
    ]
