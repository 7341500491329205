"""Values and names that a person gives on a command line, against a rack's common variables."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.types import DataType, Value
from automax_ros.rack.config import CommonVariable, Direction, RackConfig
from automax_ros.rack.findings import did_you_mean, quoted
from automax_ros.runtime.memory import MemoryValueError, ViewSpec, fitting

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
            value = text
        elif variable.type is DataType.REAL:
            value = float(text)
        else:
            value = int(text)
        return fitting(spec, value)
    except (KeyError, ValueError, MemoryValueError) as error:
        raise SettingError(f"{quoted(text)} is no value for {variable.name}, type {variable.type.word}") from error


def watched(config: RackConfig, names: Sequence[str] | None) -> list[CommonVariable]:
    """Return the simple commons of the given names; without names the first published ones.

    Raises:
        SettingError: there is no such simple common.
    """
    if names is not None:
        return [_simple(config, name) for name in names]
    published = [
        variable
        for variable in config.variables
        if variable.direction is not Direction.CLOSED and not variable.is_array and variable.type is not DataType.STRING
    ]
    return published[:DEFAULT_WATCHED]


def _simple(config: RackConfig, name: str) -> CommonVariable:
    by_name = {variable.name: variable for variable in config.variables}
    variable = by_name.get(name.upper())
    if variable is None:
        raise SettingError(f"the rack has no common variable {quoted(name)}", did_you_mean(name.upper(), by_name))
    if variable.is_array:
        raise SettingError(f"{variable.name} is an array")
    return variable
