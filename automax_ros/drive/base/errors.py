"""Errors in the data of a power circuit, or in commands to it."""

from __future__ import annotations

import math

LARGEST = 1e6
"""Largest voltage (V), resistance (ohm), inductance (H) ... of any circuit (decision: beyond every machine, far from
where numbers overflow)."""
SMALLEST = 1e-9
"""Smallest value of a parameter that must be above 0."""


class DriveError(Exception):
    """Base of the errors of a power circuit; the text says what is wrong, where, and what to do."""


class ParameterError(DriveError):
    """A parameter is outside its range."""


class GateError(DriveError):
    """A gate command that the bridge cannot execute: an SCR that it does not have, or an instant that has passed."""


class SourceShortError(DriveError):
    """Two phases are shorted through a line without any impedance: the current has no limit."""


class SteadyStateError(DriveError):
    """The circuit has no steady state that repeats every sixth of a cycle."""


def require(name: str, value: float, low: float, high: float = math.inf, *, above: bool = False) -> float:
    """Return a parameter that is in low..high; ``above`` excludes low itself.

    Raises:
        ParameterError: it is outside the range, or not a finite number.
    """
    if math.isfinite(value) and (value > low if above else value >= low) and value <= high:
        return value
    if high == math.inf:
        wanted = f"{'above' if above else 'at least'} {low:g}"
    else:
        wanted = f"{'above ' if above else ''}{low:g} to {high:g}"
    raise ParameterError(f"{name} is {value:g}, it must be {wanted}")
