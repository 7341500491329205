"""The function that computes a block's coefficients while its task runs, and its quick form once it is called often.

The quick form is straight Python that does for one block what ``evaluate_noting`` does: the limits come first, each
with the values that those before it left, then the relation between parameters, then the coefficients. The formulas are
the block's own, traced; only the order of these steps is repeated here, and every test of identity compares it with
``blocks/declare/coefficients``.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from automax_ros.blocks.declare.coefficients import evaluate_noting
from automax_ros.blocks.declare.declaration import Block, Coefficients, Limit, Relation
from automax_ros.compile.base import build
from automax_ros.compile.base.build import made
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.blocks.tracing import node_of, traced
from automax_ros.core.numbers import stored_real

QUICK_AFTER = 50
"""Calls after which the quick form is made (decision: that takes as long as some hundred calls of the other; a tunable
that a person changes never comes so far, a gain that follows a signal does within a second)."""

Computed = Callable[..., tuple[float, ...]]


_Known = dict[str, object]
"""The number of each parameter, or the name that holds it."""


@dataclass(eq=False)
class CoefficientFunction:
    """Computes a block's coefficients from evaluated parameters and the values kept from the last call.

    It returns the coefficients, the values to keep, and the limited parameters as bits of a number. ``quickened`` gives
    a function that returns the same, bit for bit, in less time; None where there is none.
    """

    block: Block
    period_s: float
    literals: Mapping[str, float]
    evaluated: tuple[str, ...]
    quickened: Callable[[CoefficientFunction], Computed | None]
    _calls: int = 0
    _quick: Computed | None = None

    def __call__(self, *values: float) -> tuple[float, ...]:
        """Return the coefficients, the values to keep, and the bits."""
        if self._quick is not None:
            return self._quick(*values)
        self._calls += 1
        if self._calls == QUICK_AFTER:
            self._quick = self.quickened(self)
        return self.evaluate(*values)

    def evaluate(self, *values: float) -> tuple[float, ...]:
        """Return the same by calling the block's own formulas."""
        given = {**self.literals, **dict(zip(self.evaluated, values, strict=False))}
        results, keep, limited = evaluate_noting(self.block, self.period_s, given, values[len(self.evaluated) :])
        return (*results, *keep, limited)


def kept_names(declared: Coefficients) -> list[str]:
    """Return the names of the states that hold the last values that met the relation of coefficients."""
    return [] if declared.relation is None else [f"kept_{name.lower()}" for name in declared.relation.parameters]


def coefficient_tree(function: CoefficientFunction) -> ast.FunctionDef:
    """Return a function as a tree that returns the same as ``function``, for arguments that are all REALs.

    Raises:
        NotNative: the block's formulas cannot be traced.
    """
    declared = function.block.coefficients
    assert declared is not None
    return _Tree(function, declared).function()


def quick_form(function: CoefficientFunction) -> Computed | None:
    """Return the traced function as Python, a dozen times faster than the formulas; None where it cannot be traced."""
    try:
        tree = coefficient_tree(function)
    except NotNative:
        return None
    known = {**FORMULAS, "min": min, "abs": abs}
    found: Computed = made([tree], "coefficients", known)[tree.name]  # type: ignore[assignment]
    return found


def raised(base: float, exponent: float) -> float:
    """Return a power as Python computes it, for the formulas of coefficients."""
    power: float = base**exponent
    return power


FORMULAS: dict[str, object] = {"math": math, "stored_real": stored_real, "raised": raised}
"""The names that the formulas of coefficients use."""


class _Tree:
    def __init__(self, function: CoefficientFunction, declared: Coefficients) -> None:
        self._declared, self._period_s = declared, function.period_s
        self._parameters = [name.lower() for name in function.evaluated]
        self._given = {**function.literals, **{name: build.name(name.lower()) for name in function.evaluated}}
        self._known: _Known = {**declared.defaults(function.period_s), **self._given}
        self._body: list[ast.stmt] = [build.assign("bits", build.constant(0))]

    def function(self) -> ast.FunctionDef:
        for number, limit in enumerate(self._declared.limits):
            if limit.parameter in self._given:
                self._limit(number, limit)
        kept: list[ast.expr] = []
        if self._declared.relation is not None:
            kept = self._relate(self._declared.relation, len(self._declared.limits))
        names = [f"c_{name}" for name in self._declared.names]
        self._body += traced(self._declared.compute, (self._period_s,), self._known, names, "c")
        results = [*map(build.name, names), *kept, build.name("bits")]
        self._body.append(ast.Return(ast.Tuple(results, build.LOAD)))
        return build.function("coefficients", [*self._parameters, *kept_names(self._declared)], self._body)

    def _limit(self, number: int, limit: Limit) -> None:
        """Add the limiting of a parameter, as in ``limited``."""
        prefix, body = f"l{number}_", self._body
        low, high, value = f"{prefix}low", f"{prefix}high", f"{prefix}{limit.parameter.lower()}"
        body += traced(limit.high, (self._period_s,), self._known, [high], f"{prefix}h")
        body += traced(limit.low, (self._period_s,), self._known, [f"{prefix}least"], f"{prefix}l")
        body.append(build.assign(low, build.call("min", build.name(f"{prefix}least"), build.name(high))))
        given = node_of_known(self._known[limit.parameter])
        stored: list[ast.stmt] = [
            build.assign_all([f"{bound}_stored", f"{bound}_clamped"], build.call("stored_real", build.name(bound)))
            for bound in (low, high)
        ]
        inside = ast.Compare(build.name(low), [ast.LtE(), ast.LtE()], [given, build.name(high)])
        equal = [build.compare(given, "=", build.name(f"{bound}_stored")) for bound in (low, high)]
        above = build.compare(given, ">", build.name(high))
        moved: list[ast.stmt] = [
            build.assign(value, build.choose(above, build.name(high), build.name(low))),
            build.assign("bits", build.binary(build.name("bits"), "OR", build.constant(1 << number))),
        ]
        stays = build.assign(value, given)
        outside = [*stored, build.when(build.either(*equal), [stays], moved)]
        body.append(build.when(inside, [stays], outside))
        self._known[limit.parameter] = build.name(value)

    def _relate(self, relation: Relation, number: int) -> list[ast.expr]:
        """Add the relation between parameters, as in ``evaluate_noting``; return the values that it keeps."""
        body = self._body
        body += traced(relation.holds, (), self._known, ["holds"], "r")
        names = [f"kept_now_{name.lower()}" for name in relation.parameters]
        kept = [build.name(name) for name in kept_names(self._declared)]
        first = traced(relation.first, (self._period_s,), self._known, names, "f", relation.parameters)
        any_kept = build.either(*(build.compare(name, "<>", build.constant(0.0)) for name in kept))
        last: list[ast.stmt] = [build.assign(name, value) for name, value in zip(names, kept, strict=True)]
        present = [node_of_known(self._known[name]) for name in relation.parameters]
        good: list[ast.stmt] = [build.assign(name, value) for name, value in zip(names, present, strict=True)]
        noted = build.assign("bits", build.binary(build.name("bits"), "OR", build.constant(1 << number)))
        body.append(build.when(build.name("holds"), good, [noted, build.when(any_kept, last, first)]))
        self._known.update({name: build.name(new) for name, new in zip(relation.parameters, names, strict=True)})
        return [build.name(name) for name in names]


def node_of_known(value: object) -> ast.expr:
    """Return the name that holds a parameter, or its number as a REAL."""
    return value if isinstance(value, ast.expr) else node_of(value)
