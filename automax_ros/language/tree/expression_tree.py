"""The expressions of the syntax tree, and the span that all its nodes have.

Every node carries the span of its text; spans (and the spelling of constants) do not take part in equality,
so that a printed tree parses back to an equal one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Span
from automax_ros.core.types import DataType, type_of_name

NO_SPAN = Span(0, 0, 0)


def span_field() -> Span:
    """Return a span field with its default, for nodes made without a text."""
    return field(default=NO_SPAN, compare=False, kw_only=True)


@dataclass(frozen=True)
class IntegerLiteral:
    """A decimal or hexadecimal integer constant; ``value`` is the signed 32-bit value (decimal ones may exceed it)."""

    value: int
    hexadecimal: bool = False
    span: Span = span_field()


@dataclass(frozen=True)
class RealLiteral:
    """A real constant; ``text`` is its spelling."""

    value: float
    text: str = field(default="", compare=False)
    span: Span = span_field()


@dataclass(frozen=True)
class StringLiteral:
    """A string constant without its quotes."""

    value: str
    span: Span = span_field()


@dataclass(frozen=True)
class BooleanLiteral:
    """TRUE, ON, FALSE or OFF."""

    value: bool
    span: Span = span_field()


@dataclass(frozen=True)
class Reference:
    """A simple variable by its name, or a whole array where one is expected; ``name`` ends with the type character."""

    name: str
    span: Span = span_field()

    @property
    def type(self) -> DataType:
        """The data type, given by the name."""
        return type_of_name(self.name)


@dataclass(frozen=True)
class Element:
    """An array element."""

    name: str
    subscripts: tuple[Expression, ...]
    span: Span = span_field()

    @property
    def type(self) -> DataType:
        """The data type, given by the array's name."""
        return type_of_name(self.name)


@dataclass(frozen=True)
class Unary:
    """A sign or NOT: ``operator`` is ``-``, ``+`` or ``NOT``. ``-NAME@`` in a block parameter inverts."""

    operator: str
    operand: Expression
    span: Span = span_field()


@dataclass(frozen=True)
class Binary:
    """Two operands: ``** * / + - = <> < > <= >= AND OR XOR``."""

    operator: str
    left: Expression
    right: Expression
    span: Span = span_field()


@dataclass(frozen=True)
class FunctionCall:
    """A call of a built-in function; ``name`` keeps its type character, such as ``BIT_SET%``."""

    name: str
    arguments: tuple[Expression, ...] = ()
    span: Span = span_field()


Expression = (
    IntegerLiteral | RealLiteral | StringLiteral | BooleanLiteral | Reference | Element | Unary | Binary | FunctionCall
)
Target = Reference | Element
