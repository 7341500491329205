"""Rules over the set of parameters that a CALL gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import Fault, Given, Rule

STRUCTURE_BYTES = 32767
"""Largest size in bytes of a data structure or of a block's storage of samples (25, 30, 31)."""
BYTES_A_WORD = 2


@dataclass(frozen=True)
class AtLeast(Rule):
    """A minimum number of parameters out of a group must be programmed."""

    count: int
    group: tuple[str, ...]
    what: str
    sentence = "At least {rule.count} of the {rule.what} {rule.names} must be programmed."

    @property
    def names(self) -> str:
        """The group as a list, a long one of numbered names by its first and last."""
        return ", ".join(self.group) if len(self.group) <= 4 else f"{self.group[0]} to {self.group[-1]}"

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a CALL with too few of the group."""
        found = sum(name in given for name in self.group)
        if found >= self.count:
            return None
        return Fault(f"needs at least {self.count} of {self.names}, {found} given")


@dataclass(frozen=True)
class Contiguous(Rule):
    """Channels must be programmed from 1 on without a gap, each with all of its stems (INPUT, GAIN ...)."""

    stems: tuple[str, ...]
    most: int
    sentence = "Channels of {rule.names} must be programmed from 1 on without a gap, at most {rule.most}."

    @property
    def names(self) -> str:
        """The stems as a list."""
        return " and ".join(f"{stem}n" for stem in self.stems)

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the first gap or half channel."""
        channels = [[f"{stem}{number}" for stem in self.stems] for number in range(1, self.most + 1)]
        while channels and not any(name in given for name in channels[-1]):
            channels.pop()
        for index, channel in enumerate(channels):
            missing = [name for name in channel if name not in given]
            if missing:
                after = next(name for later in channels[index:] for name in later if name in given)
                message = f"{after} is given without {missing[0]}: channels must follow on from 1"
                return Fault(message, after, "AMX4081")
        return None


@dataclass(frozen=True)
class NumberTrue(Rule):
    """Of a group of boolean literals that default to FALSE, a number within bounds must be TRUE."""

    group: tuple[str, ...]
    low: int
    high: int
    sentence = "{rule.low} to {rule.high} of {rule.names} must be TRUE."

    @property
    def names(self) -> str:
        """The group as a list."""
        return ", ".join(self.group)

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a CALL with too few or too many; a parameter of unknown value may be either."""
        if any(name in given and given[name].value is None for name in self.group):
            return None
        found = [name for name in given if name in self.group and given[name].value is True]
        if self.low <= len(found) <= self.high:
            return None
        keyword = found[self.high] if len(found) > self.high else None
        return Fault(f"needs {self.low} to {self.high} of {self.names} TRUE, {len(found)} are", keyword)


@dataclass(frozen=True)
class Needs(Rule):
    """One parameter is of no use without another; ``code`` may be a warning's."""

    parameter: str
    other: str
    code: str = "AMX4082"
    sentence = "{rule.parameter} needs {rule.other}."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a CALL that gives the one without the other."""
        if self.parameter not in given or self.other in given:
            return None
        return Fault(f"{self.parameter} is given without {self.other}", self.parameter, self.code)


@dataclass(frozen=True)
class ForcedUp(Rule):
    """A literal below a bound counts as the bound when the task runs: a warning (27)."""

    parameter: str
    low: int
    sentence = "A {rule.parameter} below {rule.low} counts as {rule.low}."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the warning for a literal below the bound."""
        value = given[self.parameter].value if self.parameter in given else None
        if not isinstance(value, int) or value >= self.low:
            return None
        return Fault(f"{self.parameter} = {value} counts as {self.low}", self.parameter, "AMX4098")


@dataclass(frozen=True)
class SameSize(Rule):
    """Two tables must have the same number of elements."""

    first: str
    second: str
    sentence = "{rule.second} must have as many elements as {rule.first}."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of tables of different sizes."""
        sizes = [given[name].size for name in (self.first, self.second) if name in given]
        if len(sizes) < 2 or None in sizes or sizes[0] == sizes[1]:
            return None
        message = f"{self.second} has {sizes[1]} elements, {self.first} has {sizes[0]}"
        return Fault(message, self.second, "AMX4092")


@dataclass(frozen=True)
class TableOfPowers(Rule):
    """A table has 2**m + 1 elements, with 2**m at most the literal ``most`` + 1 (section 13)."""

    table: str
    most: str
    sentence = "{rule.table} must have 2**m + 1 elements, with 2**m at most {rule.most} + 1."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a table with another number of elements."""
        size = given[self.table].size if self.table in given else None
        most = given[self.most].value if self.most in given else None
        if size is None:
            return None
        steps = size - 1
        if steps < 1 or steps & (steps - 1):
            return Fault(f"{self.table} has {size} elements, which is not 2**m + 1", self.table, "AMX4092")
        if isinstance(most, int) and steps > most + 1:
            message = f"{self.table} has {size} elements, for {self.most} = {most} it may have {most + 2} at most"
            return Fault(message, self.table, "AMX4092")
        return None


@dataclass(frozen=True)
class MostElements(Rule):
    """A table must not be longer than its index can count."""

    table: str
    most: int
    sentence = "{rule.table} has at most {rule.most} elements."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a table that is too long."""
        size = given[self.table].size if self.table in given else None
        if size is None or size <= self.most:
            return None
        return Fault(f"{self.table} has {size} elements, at most {self.most} are allowed", self.table, "AMX4092")


@dataclass(frozen=True)
class Storage(Rule):
    """The words that a literal requests, for each of the inputs named ``per``n, must not exceed 32767 bytes."""

    literal: str
    per: str | None = None
    sentence = f"2 bytes x {{rule.literal}}{{rule.inputs}} must not exceed {STRUCTURE_BYTES} bytes."

    @property
    def inputs(self) -> str:
        """The factor of the number of inputs, as text."""
        return "" if self.per is None else f" x number of {self.per}n"

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a storage that is too large."""
        count = given[self.literal].value if self.literal in given else None
        if not isinstance(count, int):
            return None
        inputs = 1 if self.per is None else sum(name.removeprefix(self.per).isdigit() for name in given)
        size = BYTES_A_WORD * count * inputs
        if size <= STRUCTURE_BYTES:
            return None
        most = STRUCTURE_BYTES // (BYTES_A_WORD * inputs)
        message = f"{self.literal} = {count} takes {size} bytes: at most {most} fit in {STRUCTURE_BYTES} bytes"
        return Fault(message, self.literal, "AMX4091")
