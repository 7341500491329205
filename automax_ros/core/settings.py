"""Texts ``NAME=VALUE`` against the variables of a task or of a rack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, TypeVar

from automax_ros.core.faults import Fault
from automax_ros.core.names import Element, Shaped, element
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import value_of, wanted


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
        raise Fault(f"{quoted(text)} is not NAME=VALUE")
    meant = element(name, variables, absent)
    kind, length = meant.variable.type, meant.variable.length
    value = value_of(given.strip(), kind, length)
    if value is None:
        message = f"{quoted(given.strip())} is not a value for {meant.label}, type {kind.word}"
        raise Fault(message, f"it takes {wanted(kind, length)}")
    return meant, value
