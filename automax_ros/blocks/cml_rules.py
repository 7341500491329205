"""Rules over the parameters of DC_DRIVE_CML beyond those of each (52.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.blocks.cml_limits import ioc_is_possible, is_good, limits_at
from automax_ros.blocks.declaration import Fault, Given


@dataclass(frozen=True)
class Advised:
    """The manual warns of a CALL without a parameter; ``without`` says what it does not have then."""

    parameter: str
    without: str
    code: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"In a speed regulator {self.parameter} must be programmed: without it there is {self.without} (52.1.5)."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the warning of a CALL without the parameter."""
        if self.parameter in given:
            return []
        return [Fault(f"there is {self.without} without {self.parameter}", None, self.code)]


@dataclass(frozen=True)
class WithinAtLine:
    """A literal's limits follow the line's frequency: the literal ``frequency`` or its default in Hz."""

    parameter: str
    frequency: str
    default_hz: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        at = " and ".join(f"{_range(self.parameter, hz)} at {hz} Hz" for hz in (60, 50))
        return f"{self.parameter} must be {at}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a literal beyond its limits; none where the frequency is at fault itself."""
        value = given[self.parameter].value if self.parameter in given else None
        line_hz = given[self.frequency].value if self.frequency in given else self.default_hz
        if not isinstance(value, (int, float)) or not isinstance(line_hz, int):
            return []
        if not is_good(self.frequency, line_hz, line_hz) or is_good(self.parameter, value, line_hz):
            return []
        message = f"{self.parameter} = {value:g} is out of range: {_range(self.parameter, line_hz)} at {line_hz} Hz"
        return [Fault(message, self.parameter, "AMX4080")]


@dataclass(frozen=True)
class OvercurrentLevel:
    """The overcurrent level must be less than 1.8 times the largest current, both in % of the rated one (52.1.5)."""

    level: str
    largest: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.level} must be less than 1.8 x {self.largest}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of two literals that do not go together."""
        level, largest = (given[name].value if name in given else None for name in (self.level, self.largest))
        if not isinstance(level, int) or not isinstance(largest, int) or ioc_is_possible(level, largest):
            return []
        message = f"{self.level} = {level} is not less than {9 * largest / 5:g}, which is 1.8 x {self.largest}"
        return [Fault(message, self.level, "AMX4185")]


def _range(name: str, line_hz: float) -> str:
    """Return the limits of an input at a line frequency as a sentence has them."""
    low, high = limits_at(name, line_hz)
    zero = "0 or " if is_good(name, 0.0, line_hz) and low > 0.0 else ""
    return f"{zero}{low:g} to {high:g}"
