"""What the translation of expressions asks of the function that they stand in."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import Protocol

from automax_ros.compile.native.ranges import Range
from automax_ros.compile.native.typed import Typed

Environment = dict[str, Range]
"""What is known of each name that has a value, at one place of a function."""


def joined(first: Environment | None, second: Environment | None) -> Environment | None:
    """Return what is known where two paths meet: a name that has no value on one of them has none; None: no path."""
    if first is None or second is None:
        return second if first is None else first
    if first is second:
        return first
    met: Environment = {}
    for name, known in first.items():
        other = second.get(name)
        if other is not None:  # most are the same object: a branch sets few names of the whole task
            met[name] = known if other is known else known.joined(other)
    return met


class Context(Protocol):
    """A function under translation."""

    def value(self, node: ast.expr, known: Environment) -> Typed:
        """Return an expression in C."""
        ...

    def refined(self, test: ast.expr, known: Environment, *, truth: bool) -> Environment | None:
        """Return what is known where a test came out as ``truth``; None where it cannot."""
        ...

    def read(self, name: str, known: Environment) -> Typed:
        """Return a variable, or a constant of the module."""
        ...

    def attribute(self, node: ast.Attribute) -> object:
        """Return a constant of a module, such as ``math.pi``."""
        ...

    def element(self, name: str, index: ast.expr, known: Environment) -> Typed:
        """Return an element of an array or of a named tuple of constants."""
        ...

    def constants(self, values: Sequence[object], index: ast.expr, known: Environment) -> Typed:
        """Return an element of a tuple of constants."""
        ...

    def call(self, node: ast.Call, known: Environment) -> list[Typed]:
        """Return the results of a call."""
        ...

    def ended(self) -> str:
        """Return the argument by which a function says that the scan ends here; the statement then asks for it."""
        ...
