"""Values of common variables as messages carry them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from automax_ros.core.types import Value


class Values(NamedTuple):
    """Values of common variables: entry i is ``element[i]`` of ``variable[i]``."""

    variable: Sequence[int] = ()
    element: Sequence[int] = ()
    value: Sequence[float] = ()
    text: Sequence[str] = ()


NO_VALUES = Values()
"""The one empty Values: most messages of a recording hold it, and the codec knows it by its identity."""
_new = tuple.__new__
"""Makes a message of a tuple of all its fields: the class itself takes three times as long, and a rack makes many."""


def values_of(entries: Sequence[tuple[int, int, Value]]) -> Values:
    """Return (view, element, value) entries as a Values message."""
    if not entries:
        return NO_VALUES
    variables, elements, values = zip(*entries, strict=True)
    return as_values(variables, elements, values)


def as_values(variables: Sequence[int], elements: Sequence[int], values: Sequence[Value]) -> Values:
    """Return views, elements and values of equal length as a Values message."""
    if str not in map(type, values):
        return _new(Values, (variables, elements, values, ()))
    numbers = [0.0 if isinstance(value, str) else value for value in values]
    return Values(variables, elements, numbers, [value for value in values if isinstance(value, str)])
