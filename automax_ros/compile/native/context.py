"""What the translation of expressions asks of the function that they stand in."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import Protocol

from automax_ros.compile.native.environment import Environment
from automax_ros.compile.native.typed import Typed


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
