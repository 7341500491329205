"""A function under translation, with its names, lines and calls, and the C text of its task: tables and functions."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.blocks.coefficients import CoefficientFunction
from automax_ros.compile.native.translate import expressions, refinement
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.ranges import NumberKind, Range, span
from automax_ros.compile.native.translate.typed import WIDE, CExpression, bare, c_type, literal, whole_text

_PINNED_FROM, _PINNED = 2**33, 2**40
"""A block's integer whose range keeps growing past the first is assumed to stay within the second (decision): no block
of the manual keeps more than 32 bits. The code checks it, and ends the scan with an error where it is not true."""
Member = Callable[["Frame", ast.Call, Environment], list[CExpression]]
"""Translates a call of ``io``."""
Caller = Callable[["Frame", object, ast.Call, Environment], list[CExpression]]
"""Translates a call of a Python function."""


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
        """Return the tree of a block's coefficients, made once: the task is translated several times."""
        key = id(function)
        if key not in self._trees:
            self._trees[key] = make(function)
        return self._trees[key]

    def table(self, items: Sequence[CExpression], place: str, known: Range) -> CExpression:
        """Return an element of a table of constants, at an index that is inside."""
        body = f"[] = {{{', '.join(item.text for item in items)}}};"
        key = f"static const {c_type(known)} {body}"
        name = self._tables.get(key)
        if name is None:
            name = self._tables[key] = f"table_{len(self._tables) + 1}"
            self.parts.append(f"static const {c_type(known)} {name}{body}")
        return CExpression(f"{name}[{place}]", known)

    def function(self, name: str, head: str, body: str) -> str:
        """Return the name in C of a function; ``head`` and ``body`` have ``@`` in place of the name."""
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


@dataclass(frozen=True)
class Array:
    """A buffer of the state: its place in C and the number of its elements. Their range is that of its name."""

    place: str
    size: int


@dataclass
class Frame:
    """A function under translation.

    ``fields`` are the places in C of scalar fields of the state, ``arrays`` its buffers, ``tuples`` named constants;
    ``declared`` are the ranges of names at the end of a BASIC line, ``touched`` the names set since the last line
    began; ``scope`` are the globals of a Python function, ``members`` the translations of calls of ``io``.
    """

    unit: Unit
    scope: Mapping[str, object]
    caller: Caller
    members: Mapping[str, Member] = field(default_factory=dict)
    fields: dict[str, str] = field(default_factory=dict)
    field_kinds: dict[str, NumberKind] = field(default_factory=dict)
    arrays: dict[str, Array] = field(default_factory=dict)
    tuples: dict[str, list[object]] = field(default_factory=dict)
    declared: dict[str, Range] = field(default_factory=dict)
    touched: set[str] = field(default_factory=set)
    locals: dict[str, str] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    returned: list[list[Range]] = field(default_factory=list)
    wide_fields: dict[str, str] = field(default_factory=dict)
    has_grown: bool = False
    is_scan: bool = False
    asks_end: bool = False
    can_end: bool = False
    depth: int = 1
    loops: dict[int, Environment] = field(default_factory=dict)
    temporaries: int = 0
    _kinds: dict[str, dict[NumberKind, str]] = field(default_factory=dict)
    _wide: set[str] = field(default_factory=set)

    def emit(self, text: str) -> None:
        """Append a line."""
        self.lines.append("    " * self.depth + text)

    @contextmanager
    def indented(self) -> Iterator[None]:
        """Indent the lines inside."""
        self.depth += 1
        yield
        self.depth -= 1

    def unite_else(self, begin: int) -> None:
        """Write an ELSE that contains only an IF, from a line to the end, as ``else if``."""
        margin = "    " * (self.depth + 1)
        inner = self.lines[begin + 1 : -1]
        alone = inner and inner[0].startswith(f"{margin}if (")
        if alone and not any(line.startswith(margin) and line[len(margin)] not in " }" for line in inner[1:]):
            self.lines[begin:] = [f"{'    ' * self.depth}}} else {inner[0].strip()}", *(line[4:] for line in inner[1:])]

    def begin_again(self) -> None:
        """Discard the lines: the function is translated once more, with the ranges now known."""
        self.lines.clear()
        self.returned.clear()
        self.has_grown = False
        self.touched.clear()
        self.temporaries = 0

    @property
    def extent(self) -> tuple[int, int]:
        """Numbers that grow while a function is translated; with them the translation of statements changes."""
        return len(self._wide), len(self.wide_fields)

    # Names

    def store(self, name: str, item: CExpression, known: Environment) -> None:
        """Emit the store of a value into a variable."""
        kind = item.range.kind
        c_type(item.range)
        assert kind is not None
        self.emit(f"{self._place(name, item.range)} = {bare(item.text)};")
        known[name] = item.range
        self.touched.add(name)

    def _place(self, name: str, known: Range) -> str:
        assert known.kind is not None
        if name in self.fields:
            return self._place_of_field(name, known)
        kinds = self._kinds.setdefault(name, {})
        place = kinds.setdefault(known.kind, name if not kinds else f"{name}_as_{known.kind.name.lower()}")
        if known.is_wide:
            self._wide.add(place)
        self.locals[place] = WIDE if place in self._wide else known.kind.c_type
        return place

    def _place_of_field(self, name: str, known: Range) -> str:
        """Return the place of a field: a local until the end of the scan, if it may exceed 64 bits meanwhile."""
        if known.kind is not self.field_kinds[name]:
            raise NotNative(f"{name} would hold a value of another kind than its own")
        if known.is_wide and name not in self.wide_fields:
            self.wide_fields[name] = f"{name}_wide"
            self.locals[f"{name}_wide"] = WIDE
            self._wide.add(f"{name}_wide")
            self.has_grown = True
        return self.wide_fields.get(name, self.fields[name])

    def parameter(self, name: str, known: Range) -> None:
        """Declare a parameter of the function."""
        self._place(name, known)

    def temporary(self, known: Range) -> str:
        """Return the name of a new local that holds a result."""
        self.temporaries += 1
        name = f"result{self.temporaries}_{'' if known.kind is None else known.kind.name[0].lower()}"
        self.locals[name] = c_type(known)
        return name

    def read(self, name: str, known: Environment) -> CExpression:
        """Return a variable, or a constant of the module."""
        present = known.get(name)
        if present is None:
            if name in self.scope:
                return literal(self.scope[name])
            raise NotNative(f"{name} may have no value")
        c_type(present)
        only = present.only
        if only is not None and present.kind is NumberKind.BOOL:
            return CExpression("true" if only else "false", present)
        place = self._place(name, present)
        return CExpression(f"(int64_t){place}" if place in self._wide and not present.is_wide else place, present)

    def attribute(self, node: ast.Attribute) -> object:
        """Return a constant of a module, such as ``math.pi``."""
        base = self.scope.get(node.value.id) if isinstance(node.value, ast.Name) else None
        if base is None:
            raise NotNative(f"a member {node.attr}")
        return getattr(base, node.attr)

    def element(self, name: str, index: ast.expr, known: Environment) -> CExpression:
        """Return an element of an array or of a named tuple of constants."""
        if name in self.tuples:
            return self.constants(self.tuples[name], index, known)
        array = self.arrays.get(name)
        if array is None:
            raise NotNative(f"an element of {name}")
        return CExpression(f"{array.place}[{bare(self.place_in(array.size, index, known))}]", known[name])

    def pinned(self, name: str, known: Range) -> Range:
        """Return the assumed range of a field whose range keeps growing: a block's integer has bounds."""
        if name not in self.fields and name not in self.arrays:
            return known
        if known.kind is NumberKind.INT and max(-known.low, known.high) > _PINNED_FROM:
            return self.declared.setdefault(name, Range(NumberKind.INT, -_PINNED, _PINNED))
        return known

    def place_in(self, size: int, index: ast.expr, known: Environment) -> str:
        """Return an index inside an array: unless it is a literal the scan checks it, whatever was proved (decision).

        So neither a fault of a proof nor a value from outside can reach memory outside the array.
        """
        place, inside = self.value(index, known).whole, Range(NumberKind.INT, 0, size - 1)
        if isinstance(index, ast.Constant):
            return self.held(place, inside).text
        return self._asked_to_lie_in(place, inside).text

    def held(self, item: CExpression, declared: Range | None) -> CExpression:
        """Return a value that is within a range: where that cannot be proved, the scan ends if it is not."""
        if declared is None or declared.holds(item.range):
            return item
        return self._asked_to_lie_in(item, declared)

    def _asked_to_lie_in(self, item: CExpression, declared: Range) -> CExpression:
        if item.range.kind is not declared.kind or declared.kind is not NumberKind.INT:
            raise NotNative("a value of another kind than that of its variable")
        low, high = max(item.range.low, declared.low), min(item.range.high, declared.high)
        if low > high:
            low, high = declared.low, declared.high
        bounds = f"{whole_text(int(declared.low))}, {whole_text(int(declared.high))}"
        wide = "_wide" * item.range.is_wide
        return CExpression(f"held{wide}({bare(item.text)}, {bounds}, {self.ended()})", Range(NumberKind.INT, low, high))

    def constants(self, values: Sequence[object], index: ast.expr, known: Environment) -> CExpression:
        """Return an element of a tuple of constants."""
        items = [literal(value) for value in values]
        place = self.place_in(len(items), index, known)
        return self.unit.table(items, bare(place), span(item.range for item in items))

    # Expressions

    def value(self, node: ast.expr, known: Environment) -> CExpression:
        """Return an expression in C."""
        return expressions.value(self, node, known)

    def refined(self, test: ast.expr, known: Environment, *, truth: bool) -> Environment | None:
        """Return the known ranges where a test has the result ``truth``; None where it cannot."""
        return refinement.refined(self, test, known, truth=truth)

    def call(self, node: ast.Call, known: Environment) -> list[CExpression]:
        """Return the results of a call."""
        function = node.func
        if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
            if function.value.id == "io":
                return self.members[function.attr](self, node, known)
            base = self.scope.get(function.value.id)
            return self.caller(self, getattr(base, function.attr), node, known)
        if isinstance(function, ast.Name) and function.id in self.scope:
            return self.caller(self, self.scope[function.id], node, known)
        if isinstance(function, ast.Name) and hasattr(builtins, function.id):
            return self.caller(self, getattr(builtins, function.id), node, known)
        raise NotNative("a call of what is not known")

    def ended(self) -> str:
        """Return the argument by which a function reports that the scan ends here; the statement then checks it."""
        self.asks_end = self.can_end = True
        return "ended"
