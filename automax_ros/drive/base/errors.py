"""What can be wrong with a power circuit or with what it is asked to do."""

from __future__ import annotations

import math

LARGEST = 1e6
"""Largest voltage (V), resistance (ohm), inductance (H) ... of any circuit (decision: beyond every machine, far from
where numbers overflow)."""
SMALLEST = 1e-9
"""Smallest value of what must be above 0."""


class DriveError(Exception):
    """Something about a power circuit is wrong; the text says what, where and what to do."""


class ParameterError(DriveError):
    """A parameter is outside its range."""


class GateError(DriveError):
    """A gate command that the bridge cannot take: an SCR that it has not, or an instant that has passed."""


class SourceShortError(DriveError):
    """Two phases are shorted through a line without any impedance: the current has no limit."""


class SteadyStateError(DriveError):
    """The circuit has no steady state that repeats every sixth of a cycle."""


def require(name: str, value: float, low: float, high: float = math.inf, *, above: bool = False) -> float:
    """Return a parameter that lies in low..high; ``above`` excludes low itself.

    Raises:
        ParameterError: it does not, or is not a finite number.
    """
    if math.isfinite(value) and (value > low if above else value >= low) and value <= high:
        return value
    if high == math.inf:
        wanted = f"{'above' if above else 'at least'} {low:g}"
    else:
        wanted = f"{'above ' if above else ''}{low:g} to {high:g}"
    raise ParameterError(f"{name} is {value:g}, it must be {wanted}")
