"""The statements that only a scan has: state, latch, forces, commit, the end of the scan."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from typing import Any

from automax_ros.compile.native.environment import Environment
from automax_ros.compile.native.frame import Frame
from automax_ros.compile.native.ranges import ANY_BOOL, Kind, Range
from automax_ros.compile.native.repeated import Repeated
from automax_ros.compile.native.source import NotNative
from automax_ros.compile.native.statements import Body
from automax_ros.compile.native.typed import Typed, bare
from automax_ros.compile.pynames import variable_name

CHANGES = "changes"
"""The list that END of the Python form fills; in C the host compares what a scan gives out with what it latched."""


class ScanBody(Body):
    """Translates one scan; ``latched`` are the ranges of what it latches, ``written`` the names that it gives out."""

    def __init__(self, frame: Frame, latched: Sequence[Range], written: Sequence[str]) -> None:
        """Take the function, and what goes in and out."""
        super().__init__(frame)
        self._latched, self._written = latched, written
        self._repeated = Repeated(frame, frozenset({CHANGES}))

    def _one(self, statement: ast.stmt, known: Environment) -> Environment | None:
        if self._depth > 1:
            return super()._one(statement, known)
        return self._repeated.carried_out(statement, known, super()._one)

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
    """Return which member of ``io`` an expression calls."""
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute):
        return value.func.attr
    return ""


def _names_of_end(statement: ast.If) -> set[str]:
    """Return the names in the statements of END's own: one that appends a change, one that commits if there are any."""
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
