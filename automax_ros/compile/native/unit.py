"""The C text of one task in the making: its tables and its functions."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from automax_ros.compile.coefficient_function import CoefficientFunction
from automax_ros.compile.native.ranges import Range
from automax_ros.compile.native.typed import Typed, c_type


@dataclass
class Unit:
    """Tables of constants and functions, each once, in the order in which they are needed."""

    parts: list[str] = field(default_factory=list)
    _tables: dict[str, str] = field(default_factory=dict)
    _functions: dict[str, str] = field(default_factory=dict)
    _trees: dict[int, ast.FunctionDef] = field(default_factory=dict)
    _used: set[str] = field(default_factory=set)

    def tree(
        self, function: CoefficientFunction, make: Callable[[CoefficientFunction], ast.FunctionDef]
    ) -> ast.FunctionDef:
        """Return the tree of a block's coefficients, made once: the task is looked through several times."""
        key = id(function)
        if key not in self._trees:
            self._trees[key] = make(function)
        return self._trees[key]

    def table(self, items: Sequence[Typed], place: str, known: Range) -> Typed:
        """Return an element of a table of constants, of an index that lies inside."""
        body = f"[] = {{{', '.join(item.text for item in items)}}};"
        key = f"static const {c_type(known)} {body}"
        name = self._tables.get(key)
        if name is None:
            name = self._tables[key] = f"table_{len(self._tables) + 1}"
            self.parts.append(f"static const {c_type(known)} {name}{body}")
        return Typed(f"{name}[{place}]", known)

    def function(self, name: str, head: str, body: str) -> str:
        """Return the name in C of a function; ``head`` and ``body`` have ``@`` in the place of the name."""
        key = head + body
        if key not in self._functions:
            free, number = name, 1
            while free in self._used:
                number += 1
                free = f"{name}_{number}"
            self._used.add(free)
            self._functions[key] = free
            self.parts.append((head + body).replace("@", free, 1))
        return self._functions[key]
