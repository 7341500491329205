"""Names of variables as people write them, with subscripts: which variable, and which element of an array, they mean.

``REF%``, ``TABLE%(3)``, ``grid[1, 2]``: case and blanks do not matter, square brackets are round ones (decision).
An array's elements are counted with the last subscript fastest, from 0 on. The registers of the module in slot 5 are
the array ``SLOT:5%``, a name that no task can declare (decision).

Texts ``NAME=VALUE`` against the variables of a task or of a rack.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from automax_ros.core.faults import UserError
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import value_of, wanted

AUTO_RUN = "AUTORUNSTATUS@"
"""TRUE where AUTO RUN is enabled for the rack (2.4.6)."""
PREDEFINED = (AUTO_RUN, "FORCINGSTATUS@", *(f"BATTERYSTATUS{slot}@" for slot in range(5)))
"""Commons that the rack itself writes (2.4.6)."""

_NAME = re.compile(
    r"(?P<name>[A-Z_][A-Z0-9_]{0,63}[%!@$]?|SLOT:[0-9]{1,2}%)(?:[(\[](?P<subscripts>[0-9]{1,9}(?:,[0-9]{1,9}){0,3})[)\]])?"
)


class Shaped(Protocol):
    """A variable: its full name, and its numbers of elements per subscript, none for a simple variable."""

    @property
    def name(self) -> str:
        """The name with its type character."""

    @property
    def dimensions(self) -> Sequence[int]:
        """Numbers of elements: largest subscript + 1."""


V = TypeVar("V", bound=Shaped)


class NameFault(UserError):
    """A text names no variable, or no element of one."""


class UnknownName(NameFault):
    """There is no variable of that name."""


class WrongSubscripts(NameFault):
    """The name is an array's without an element, a simple variable's with one, or the element does not exist."""


@dataclass(frozen=True)
class Element(Generic[V]):
    """A simple variable (``index`` 0), or the element of an array at a flat index."""

    variable: V
    index: int = 0

    @property
    def name(self) -> str:
        """The variable's name."""
        return self.variable.name

    @property
    def label(self) -> str:
        """The name with the element's subscripts."""
        return element_name(self.variable, self.index)


def element(asked: str, variables: Mapping[str, V], absent: str) -> Element[V]:
    """Return the simple variable or the array's element that a text names.

    ``variables`` are known by their full names; ``absent`` begins the message where none of them is meant, such as
    ``the rack has no common variable``.

    Raises:
        UnknownName: no such variable.
        WrongSubscripts: no such element.
    """
    plain = "".join(asked.split())
    match = _NAME.fullmatch(plain.upper()) if plain.isascii() else None
    variable = variables.get(match["name"]) if match else None
    if match is None or variable is None:
        raise UnknownName(f"{absent} {quoted(asked)}", near_or_listed(re.split(r"[(\[]", plain.upper())[0], variables))
    given = tuple(map(int, match["subscripts"].split(","))) if match["subscripts"] else ()
    _require_subscripts(variable, given, asked)
    return Element(variable, flat_index(given, variable.dimensions))


def flat_index(subscripts: Sequence[int], dimensions: Sequence[int]) -> int:
    """Return the index of the element with these subscripts, each from 0 to its dimension - 1."""
    index = 0
    for subscript, size in zip(subscripts, dimensions, strict=True):
        index = index * size + subscript
    return index


def subscripts_of(index: int, dimensions: Sequence[int]) -> tuple[int, ...]:
    """Return the subscripts of the element at a flat index; () for a simple variable."""
    found: list[int] = []
    for size in reversed(dimensions):
        index, subscript = divmod(index, size)
        found.append(subscript)
    return tuple(reversed(found))


def element_name(variable: Shaped, index: int) -> str:
    """Return the name of a simple variable, or of an array's element at a flat index with its subscripts."""
    subscripts = subscripts_of(index, variable.dimensions)
    return f"{variable.name}({','.join(map(str, subscripts))})" if subscripts else variable.name


def last_element_name(variable: Shaped) -> str:
    """Return the name of an array's last element, which shows how large the array is."""
    return f"{variable.name}({','.join(str(size - 1) for size in variable.dimensions)})"


def _require_subscripts(variable: Shaped, given: tuple[int, ...], asked: str) -> None:
    wanted = len(variable.dimensions)
    if given and not wanted:
        raise WrongSubscripts(f"{variable.name} is not an array", f"write {variable.name}")
    if len(given) != wanted:
        what = f"has {wanted} subscripts, not {len(given)}" if given else "is an array"
        message = f"{variable.name} {what}"
        raise WrongSubscripts(message, f"name one element; the last is {last_element_name(variable)}")
    for subscript, size in zip(given, variable.dimensions, strict=True):
        if subscript >= size:
            message = f"subscript {subscript} of {quoted(asked, marks='')} is out of range"
            raise WrongSubscripts(message, f"the largest is {size - 1}")


class Typed(Shaped, Protocol):
    """A variable of a type; ``length`` is the most characters that a string holds."""

    @property
    def type(self) -> DataType:
        """Its data type."""

    @property
    def length(self) -> int:
        """Characters of a STRING."""


W = TypeVar("W", bound=Typed)


def setting(text: str, variables: Mapping[str, W], absent: str) -> tuple[Element[W], Value]:
    """Return the variable or array element that ``NAME=VALUE`` sets, and the value as it would hold it.

    Raises:
        Fault: not of that form, no such variable or element (``element``), or the value is none of its type.
    """
    name, equals, given = text.partition("=")
    if not equals:
        raise UserError(f"{quoted(text)} is not NAME=VALUE")
    meant = element(name, variables, absent)
    kind, length = meant.variable.type, meant.variable.length
    value = value_of(given.strip(), kind, length)
    if value is None:
        message = f"{quoted(given.strip())} is not a value for {meant.label}, type {kind.word}"
        raise UserError(message, f"it takes {wanted(kind, length)}")
    return meant, value
