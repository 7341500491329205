"""Values and names that a person gives on a command line, against a rack's common variables."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType, Value
from automax_ros.rack.config import CommonVariable, RackConfig
from automax_ros.rack.findings import did_you_mean, quoted
from automax_ros.running.views import MemoryValueError, ViewSpec, fitting

_SUBSCRIPTED = re.compile(r"(?P<name>[^()\[\]]+)[(\[](?P<subscripts>[0-9]{1,6}(?:,[0-9]{1,6}){0,3})[)\]]")
_TRUTH = {"TRUE": True, "ON": True, "1": True, "FALSE": False, "OFF": False, "0": False}
DEFAULT_WATCHED = 5
"""How many variables a status line shows when nobody chose any."""


class SettingError(ValueError):
    """A name is not one of the rack's simple commons, or a value does not fit; ``hint`` says what is near."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        """Take the message and a hint."""
        super().__init__(message)
        self.hint = hint


def setting(config: RackConfig, text: str) -> tuple[str, Value]:
    """Return the name and value of ``NAME=VALUE``.

    Raises:
        SettingError: not of that form, no such simple common, or the value does not fit.
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise SettingError(f"{quoted(text)} is not NAME=VALUE")
    variable = _simple(config, name.strip())
    return variable.name, value_of_text(variable, value.strip())


def value_of_text(variable: CommonVariable, text: str) -> Value:
    """Return the value that a text means for a simple variable.

    Raises:
        SettingError: it does not fit.
    """
    spec = ViewSpec(variable.name, variable.type, length=variable.length)
    value: Value
    try:
        if variable.type is DataType.BOOLEAN:
            value = _TRUTH[text.upper()]
        elif variable.type is DataType.STRING:
            text.encode()  # what no message can carry, such as bytes of a terminal that are no UTF-8
            value = text
        elif variable.type is DataType.REAL:
            value = float(text)
        else:
            value = int(text)
        return fitting(spec, value)
    except (KeyError, ValueError, MemoryValueError) as error:
        raise SettingError(f"{quoted(text)} is no value for {variable.name}, type {variable.type.word}") from error


@dataclass(frozen=True)
class Watched:
    """A simple common or an array's element that a status line shows: ``label`` names it, subscripts included."""

    label: str
    name: str
    element: int = 0


def watched(config: RackConfig, names: Sequence[str] | None) -> list[Watched]:
    """Return what the given names mean, such as ``REF%`` and ``TABLE%(3)``; without names the first published commons.

    Raises:
        SettingError: there is no such simple common or element.
    """
    if names is not None:
        return [_element(config, name) for name in names]
    published = [
        variable
        for variable in config.variables
        if variable.direction is not Direction.CLOSED and not variable.is_array and variable.type is not DataType.STRING
    ]
    return [Watched(variable.name, variable.name) for variable in published[:DEFAULT_WATCHED]]


def _element(config: RackConfig, text: str) -> Watched:
    """Return the simple common or the array's element that a text names."""
    match = _SUBSCRIPTED.fullmatch("".join(text.split()))
    if match is None:
        name = _simple(config, text).name
        return Watched(name, name)
    variable = _variable(config, match["name"])
    if not variable.is_array:
        raise SettingError(f"{variable.name} is not an array")
    subscripts = [int(subscript) for subscript in match["subscripts"].split(",")]
    if len(subscripts) != len(variable.dimensions):
        raise SettingError(f"{variable.name} has {len(variable.dimensions)} subscripts, not {len(subscripts)}")
    element = 0
    for subscript, size in zip(subscripts, variable.dimensions, strict=True):
        if subscript >= size:
            raise SettingError(f"a subscript of {quoted(text)} is out of range: the largest is {size - 1}")
        element = element * size + subscript
    return Watched(f"{variable.name}({','.join(map(str, subscripts))})", variable.name, element)


def _simple(config: RackConfig, name: str) -> CommonVariable:
    variable = _variable(config, name)
    if variable.is_array:
        zeros = ",".join("0" * len(variable.dimensions))
        raise SettingError(f"{variable.name} is an array", f"one element of it is {variable.name}({zeros})")
    return variable


def _variable(config: RackConfig, name: str) -> CommonVariable:
    by_name = {variable.name: variable for variable in config.variables}
    variable = by_name.get(name.upper())
    if variable is None:
        raise SettingError(f"the rack has no common variable {quoted(name)}", did_you_mean(name.upper(), by_name))
    return variable
