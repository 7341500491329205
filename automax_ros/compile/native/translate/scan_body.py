"""Translation of the statements that only a scan has: state, latch, forces, commit, the end of the scan.

A scan is translated repeatedly until the ranges of the state no longer grow. Little changes from one translation to the
next: most statements find the same ranges as before and give the same lines and ranges, which are then reused.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import variable_name
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.frame import Frame
from automax_ros.compile.native.translate.ranges import ANY_BOOL, Kind, Range
from automax_ros.compile.native.translate.statements import Body
from automax_ros.compile.native.translate.typed import Typed, bare

CarryOut = Callable[[ast.stmt, Environment], Environment | None]


CHANGES = "changes"
"""The list that END of the Python form fills; in C the host compares the outputs of a scan with the latched values."""


@dataclass(frozen=True)
class _Came:
    """What a statement depended on, and its result: lines, locals, names that it set, ranges that it changed."""

    found: tuple[object, ...]
    lines: list[str]
    locals: dict[str, str]
    touched: set[str]
    temporaries: int
    asks_end: bool
    changes: list[tuple[str, Range | None]]


class Repeated:
    """The translated statements of one function, for reuse; those with loops, or with certain names, are not reused."""

    def __init__(self, frame: Frame, never: frozenset[str]) -> None:
        self._frame, self._never = frame, never
        self._names: dict[int, tuple[str, ...] | None] = {}
        self._came: dict[int, _Came] = {}

    def carried_out(self, statement: ast.stmt, known: Environment, carry_out: CarryOut) -> Environment | None:
        """Emit a statement, by ``carry_out`` where it cannot be reused; return the ranges known after it."""
        names = self._names_of(statement)
        if names is None:
            return carry_out(statement, known)
        frame = self._frame
        ranges = (*map(known.get, names), *map(frame.declared.get, names))
        found = (*ranges, frame.temporaries, frame.asks_end, *frame.extent)
        came = self._came.get(id(statement))
        if came is None or came.found != found:
            return self._carry_out(statement, known, found, carry_out)
        frame.lines += came.lines
        frame.locals.update(came.locals)
        frame.touched |= came.touched
        frame.temporaries, frame.asks_end = came.temporaries, came.asks_end
        return _apply_changes(known, came.changes)

    def _carry_out(
        self, statement: ast.stmt, known: Environment, found: tuple[object, ...], carry_out: CarryOut
    ) -> Environment | None:
        frame = self._frame
        begin, extent = len(frame.lines), frame.extent
        locals_before, frame.locals = frame.locals, {}
        touched_before, frame.touched = frame.touched, set()
        after = carry_out(statement, known)
        made, touched = frame.locals, frame.touched
        frame.locals, frame.touched = locals_before, touched_before | touched
        frame.locals.update(made)
        if after is not None and frame.extent == extent:
            changes = [(name, left) for name, _, left in known.differing(after)]
            lines = frame.lines[begin:]
            self._came[id(statement)] = _Came(found, lines, made, touched, frame.temporaries, frame.asks_end, changes)
        return after

    def _names_of(self, statement: ast.stmt) -> tuple[str, ...] | None:
        """Return the names in a statement, None where it depends on more than these."""
        key = id(statement)
        if key not in self._names:
            nodes = list(build.nodes(statement))
            names = {node.id for node in nodes if isinstance(node, ast.Name)}
            is_plain = not names & self._never and not any(isinstance(node, ast.While) for node in nodes)
            self._names[key] = tuple(sorted(names)) if is_plain else None
        return self._names[key]


def _apply_changes(known: Environment, changes: list[tuple[str, Range | None]]) -> Environment:
    if not changes:
        return known
    after = known.without({name for name, left in changes if left is None})
    for name, left in changes:
        if left is not None:
            after[name] = left
    return after


class ScanBody(Body):
    """Translates one scan; ``latched`` are the ranges of the latched values, ``written`` the names of its outputs."""

    def __init__(self, frame: Frame, latched: Sequence[Range], written: Sequence[str]) -> None:
        super().__init__(frame)
        self._latched, self._written = latched, written
        self._repeated = Repeated(frame, frozenset({CHANGES}))

    def _carry_out_one(self, statement: ast.stmt, known: Environment) -> Environment | None:
        if self._depth > 1:
            return super()._carry_out_one(statement, known)
        return self._repeated.carried_out(statement, known, super()._carry_out_one)

    def _assign(self, statement: ast.Assign, known: Environment) -> Environment:
        target, value = statement.targets[0], statement.value
        member = _member(value)
        if member == "latch" and isinstance(target, ast.Tuple):
            return self._latch([item.id for item in target.elts if isinstance(item, ast.Name)], known)
        if member == "forces" and isinstance(target, ast.Tuple):
            return self._forces([item.id for item in target.elts if isinstance(item, ast.Name)], known)
        if isinstance(target, ast.Name) and target.id == CHANGES:
            return self._give_out(known)
        return super()._assign(statement, known)

    def _latch(self, names: list[str], known: Environment) -> Environment:
        known = known.copy()
        for place, (name, item) in enumerate(zip(names, self._latched, strict=True)):
            slot = f"latched[{place}][k]"
            text = {Kind.INT: f"{slot}.i", Kind.BOOL: f"({slot}.i != 0)", Kind.REAL: f"{slot}.d"}[_kind(item)]
            self.frame.store(name, Typed(text, item), known)
        return known

    def _forces(self, names: list[str], known: Environment) -> Environment:
        known = known.copy()
        for place, name in enumerate(names):
            self.frame.store(name, Typed(f"(forced[{place}] != 0)", ANY_BOOL), known)
        return known

    def _give_out(self, known: Environment) -> Environment:
        for place, name in enumerate(self._written):
            item = self.frame.read(variable_name(name), known)
            member = "d" if item.range.kind is Kind.REAL else "i"
            self.frame.emit(f"out[{place}][k].{member} = {bare(item.text)};")
        return known

    def _if(self, statement: ast.If, known: Environment) -> Environment | None:
        return known if CHANGES in _names_of_end(statement) else super()._if(statement, known)

    def _expression(self, statement: ast.Expr, known: Environment) -> Environment | None:
        if not isinstance(statement.value, ast.Yield):
            return super()._expression(statement, known)
        assert statement.value.value is not None
        stopped = self.frame.value(statement.value.value, known)
        ends = {0: "AUTOMAX_DONE", 1: "AUTOMAX_STOPPED"}
        only = stopped.range.only
        choice = f"{stopped.text} ? AUTOMAX_STOPPED : AUTOMAX_DONE"
        self.frame.emit(f"return {choice if only is None else ends[int(only)]};")
        return known

    _statements: dict[type[ast.stmt], Callable[[Any, Any, Environment], Environment | None]] = {  # noqa: RUF012
        **Body._statements,
        ast.Assign: _assign,
        ast.If: _if,
        ast.Expr: _expression,
    }


def _kind(item: Range) -> Kind:
    assert item.kind is not None
    return item.kind


def _member(value: ast.expr) -> str:
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute):
        return value.func.attr
    return ""


def _names_of_end(statement: ast.If) -> set[str]:
    """Return the names in an IF of END, which appends a change, or commits if there are any; empty for others."""
    first = statement.body[0]
    if isinstance(statement.test, ast.Name):
        return {statement.test.id}
    if (
        isinstance(first, ast.Expr)
        and isinstance(first.value, ast.Call)
        and isinstance(first.value.func, ast.Attribute)
    ):
        base = first.value.func.value
        return {base.id} if isinstance(base, ast.Name) else set()
    return set()


def scan_of(function: ast.FunctionDef) -> tuple[dict[str, list[object]], list[ast.stmt]]:
    """Return the named constants at the start of the Python form of the scans, and the statements of one scan."""
    tuples: dict[str, list[object]] = {}
    for statement in function.body:
        if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Tuple):
            name = statement.targets[0]
            assert isinstance(name, ast.Name)
            tuples[name.id] = [item.value for item in statement.value.elts if isinstance(item, ast.Constant)]
        if isinstance(statement, ast.Try):
            loop = statement.body[0]
            assert isinstance(loop, ast.While)
            return tuples, loop.body
    raise NotNative("no scans")


def state_names(function: ast.FunctionDef) -> list[str]:
    """Return the names of the state's fields, in their order."""
    first = function.body[0]
    if isinstance(first, ast.Assign) and isinstance(first.targets[0], ast.Tuple):
        return [item.id for item in first.targets[0].elts if isinstance(item, ast.Name)]
    return []
