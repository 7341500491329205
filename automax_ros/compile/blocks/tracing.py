"""Executes Python functions of REALs once on names instead of numbers, and records their operations.

The coefficients of the dynamic blocks are computed by plain Python, with dictionaries, loops over polynomials, and
functions that other functions return. None of that depends on the numbers: the result is a sequence of operations, with
tests between them where a function compares two numbers.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from types import CellType, FunctionType, SimpleNamespace
from typing import Any

from automax_ros.compile.base import build
from automax_ros.compile.base.native_source import NotNative

MOST_PATHS = 64
"""Most paths through one function; those of the blocks have a few."""
_TRACED_PACKAGE = "automax_ros.blocks."


def _operations(
    operator: type[ast.operator],
) -> tuple[Callable[[Traced, object], Traced], Callable[[Traced, object], Traced]]:
    """Return the method of an operator, and that for the right operand."""

    def left(self: Traced, other: object) -> Traced:
        return self.recorder.kept(ast.BinOp(self.node, operator(), node_of(other)))

    def right(self: Traced, other: object) -> Traced:
        return self.recorder.kept(ast.BinOp(node_of(other), operator(), self.node))

    return left, right


def _comparison(operator: type[ast.cmpop]) -> Callable[[Traced, object], Truth]:
    return lambda self, other: Truth(self.recorder, ast.Compare(self.node, [operator()], [node_of(other)]))


class Traced:
    """A REAL of which only the name is known."""

    def __init__(self, recorder: OperationTracer, node: ast.expr) -> None:
        self.recorder, self.node = recorder, node

    __add__, __radd__ = _operations(ast.Add)
    __sub__, __rsub__ = _operations(ast.Sub)
    __mul__, __rmul__ = _operations(ast.Mult)
    __truediv__, __rtruediv__ = _operations(ast.Div)
    __lt__, __le__, __gt__, __ge__ = map(_comparison, (ast.Lt, ast.LtE, ast.Gt, ast.GtE))
    __eq__, __ne__ = map(_comparison, (ast.Eq, ast.NotEq))  # type: ignore[assignment]

    def __pow__(self, exponent: int) -> Traced | float:
        """Return a power with a whole exponent; the powers 0 and 1 are exact in every C library."""
        if exponent == 0:
            return 1.0
        return self if exponent == 1 else self.recorder.kept(build.call("raised", self.node, node_of(float(exponent))))

    def __abs__(self) -> Traced:
        return self.recorder.kept(build.call("abs", self.node))

    def __neg__(self) -> Traced:
        return self.recorder.kept(ast.UnaryOp(ast.USub(), self.node))

    def __bool__(self) -> bool:
        return bool(self != 0.0)

    def __float__(self) -> float:
        raise NotNative("a function of Python's that needs a number")

    __hash__ = None  # type: ignore[assignment]


class Truth:
    """The comparison of two numbers; each evaluation follows one branch, a later run follows the other."""

    def __init__(self, recorder: OperationTracer, test: ast.expr) -> None:
        self.recorder, self.test = recorder, test

    def __bool__(self) -> bool:
        return self.recorder.decided(self.test)


class _Fork(Exception):
    def __init__(self, test: ast.expr) -> None:
        super().__init__()
        self.test = test


class OperationTracer:
    """Records the operations of one run of a function after its last given answer."""

    def __init__(self, prefix: str, answers: Sequence[bool] = ()) -> None:
        self._prefix, self._answers = prefix, answers
        self._made, self._asked = 0, 0
        self.statements: list[ast.stmt] = []

    def kept(self, node: ast.expr) -> Traced:
        """Record an operation; return its result."""
        self._made += 1
        name = f"{self._prefix}{self._made}"
        self.statements.append(build.assign(name, node))
        return Traced(self, build.name(name))

    def decided(self, test: ast.expr) -> bool:
        """Return the answer to a test."""
        if self._asked == len(self._answers):
            raise _Fork(test)
        self._asked += 1
        self.statements = []
        return self._answers[self._asked - 1]


def node_of(value: object) -> ast.expr:
    """Return the node of a traced value, or of a number."""
    if isinstance(value, Traced):
        return value.node
    if isinstance(value, Truth):
        return value.test
    assert isinstance(value, (bool, int, float))
    return build.constant(value)


def traced(
    function: Callable[..., Any],
    before: Sequence[object],
    numbers: Mapping[str, object],
    results: Sequence[str],
    prefix: str,
    keys: Sequence[str] = (),
) -> list[ast.stmt]:
    """Return the operations of a function as statements that set ``results``.

    It is called with the arguments ``before`` and a dictionary ``numbers`` of numbers and names as trees, and returns a
    value for each result in order, or a single one, or a dictionary that has them under ``keys``. ``prefix`` begins the
    names of intermediate results.

    Raises:
        NotNative: the function needs the numbers themselves, or has too many paths.
    """
    carried_out = _with_traced_functions(function, {})
    paths = 0

    def way(answers: tuple[bool, ...]) -> list[ast.stmt]:
        nonlocal paths
        paths += 1
        if paths > MOST_PATHS:
            raise NotNative("coefficients that depend on too many tests")
        recorder = OperationTracer(prefix, answers)
        given = {key: Traced(recorder, item) if isinstance(item, ast.expr) else item for key, item in numbers.items()}
        try:
            found = carried_out(*before, given)
        except _Fork as fork:
            return [*recorder.statements, build.when(fork.test, way((*answers, True)), way((*answers, False)))]
        found = tuple(found[key] for key in keys) if keys else found
        values = found if isinstance(found, tuple) else (found,)
        sets = [build.assign(name, node_of(value)) for name, value in zip(results, values, strict=True)]
        return [*recorder.statements, *sets]

    return way(())


def _of_number(name: str, value: object) -> object:
    """Return the result of a function of ``math``: traced, or computed at once for a number."""
    if isinstance(value, Traced):
        return value.recorder.kept(build.call(build.attribute("math", name), value.node))
    return getattr(math, name)(value)


_MATH = SimpleNamespace(
    **{name: value for name, value in vars(math).items() if not name.startswith("_")}
    | {name: (lambda value, name=name: _of_number(name, value)) for name in ("tan", "sqrt", "log", "exp", "cos", "sin")}
)
"""``math``, whose functions that the blocks call accept both numbers and names."""


def _with_traced_functions(value: Any, made: dict[int, Any]) -> Any:
    """Return a function of the blocks, and all its callees, with ``_MATH`` in place of ``math``."""
    if not isinstance(value, FunctionType) or not value.__module__.startswith(_TRACED_PACKAGE):
        return value
    if id(value) in made:
        return made[id(value)]
    scope: dict[str, Any] = {}
    cells = tuple(CellType() for _ in value.__closure__ or ())
    copy = made[id(value)] = FunctionType(value.__code__, scope, value.__name__, value.__defaults__, cells)
    copy.__kwdefaults__ = value.__kwdefaults__
    copy.__module__ = value.__module__
    for cell, old in zip(cells, value.__closure__ or (), strict=True):
        cell.cell_contents = _with_traced_functions(old.cell_contents, made)
    names = set(_names(value.__code__))
    scope.update({name: item for name, item in value.__globals__.items() if name in names or name == "__builtins__"})
    for name in names & scope.keys():
        scope[name] = _MATH if scope[name] is math else _with_traced_functions(scope[name], made)
    return copy


def _names(code: Any) -> list[str]:
    return [*code.co_names, *(name for inner in code.co_consts if hasattr(inner, "co_names") for name in _names(inner))]
