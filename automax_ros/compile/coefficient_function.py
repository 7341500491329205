"""The function that computes a block's coefficients while its task runs, and its quick form once it is called often."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from automax_ros.blocks.coefficients import evaluate_noting
from automax_ros.blocks.declaration import Block, Coefficients

QUICK_AFTER = 50
"""Calls after which the quick form is made (decision: that takes as long as some hundred calls of the other; a tunable
that a person changes never comes so far, a gain that follows a signal does within a second)."""

Computed = Callable[..., tuple[float, ...]]


@dataclass(eq=False)
class CoefficientFunction:
    """Computes a block's coefficients from evaluated parameters and what was kept of the last time.

    It returns the coefficients, what to keep, and what is limited as bits of a number. ``quickened`` gives a function
    that returns the same, bit for bit, in less time; None where there is none.
    """

    block: Block
    period_s: float
    literals: Mapping[str, float]
    evaluated: tuple[str, ...]
    quickened: Callable[[CoefficientFunction], Computed | None]
    _calls: int = 0
    _quick: Computed | None = None

    def __call__(self, *values: float) -> tuple[float, ...]:
        """Return coefficients, what to keep, bits."""
        if self._quick is not None:
            return self._quick(*values)
        self._calls += 1
        if self._calls == QUICK_AFTER:
            self._quick = self.quickened(self)
        return self.evaluate(*values)

    def evaluate(self, *values: float) -> tuple[float, ...]:
        """Return the same by the block's own formulas, called as they stand."""
        given = {**self.literals, **dict(zip(self.evaluated, values, strict=False))}
        results, keep, limited = evaluate_noting(self.block, self.period_s, given, values[len(self.evaluated) :])
        return (*results, *keep, limited)


def kept_names(declared: Coefficients) -> list[str]:
    """Return the names of the states that hold the last values that met the relation of coefficients."""
    return [] if declared.relation is None else [f"kept_{name.lower()}" for name in declared.relation.parameters]
