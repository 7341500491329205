"""Rules over the set of parameters that a CALL gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import Fault, Given

STRUCTURE_BYTES = 32767
"""Largest size in bytes of a data structure or of a block's storage of samples (25, 30, 31)."""
BYTES_A_WORD = 2


@dataclass(frozen=True)
class AtLeast:
    """A minimum number of parameters out of a group must be programmed."""

    count: int
    group: tuple[str, ...]
    what: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"At least {self.count} of the {self.what} {_shortened(self.group)} must be programmed."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a CALL with too few of the group."""
        found = sum(name in given for name in self.group)
        if found >= self.count:
            return []
        return [Fault(f"needs at least {self.count} of {_shortened(self.group)}, {found} given")]


@dataclass(frozen=True)
class Contiguous:
    """Channels must be programmed from 1 on without a gap, each with all of its stems (INPUT, GAIN ...)."""

    stems: tuple[str, ...]
    most: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        names = " and ".join(f"{stem}n" for stem in self.stems)
        return f"Channels of {names} must be programmed from 1 on without a gap, at most {self.most}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return one fault for the first gap or half channel of each group."""
        last = max((n for n in range(1, self.most + 1) if any(f"{stem}{n}" in given for stem in self.stems)), default=0)
        for channel in range(1, last + 1):
            missing = [f"{stem}{channel}" for stem in self.stems if f"{stem}{channel}" not in given]
            if missing:
                after = next(
                    name for n in range(channel, last + 1) for name in (f"{s}{n}" for s in self.stems) if name in given
                )
                message = f"{after} is given without {missing[0]}: channels must follow on from 1"
                return [Fault(message, after, "AMX4081")]
        return []


@dataclass(frozen=True)
class NumberTrue:
    """Of a group of boolean literals that default to FALSE, a number within bounds must be TRUE."""

    group: tuple[str, ...]
    low: int
    high: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.low} to {self.high} of {', '.join(self.group)} must be TRUE."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a CALL with too few or too many; a parameter of unknown value may be either."""
        if any(name in given and given[name].value is None for name in self.group):
            return []
        found = [name for name in given if name in self.group and given[name].value is True]
        if self.low <= len(found) <= self.high:
            return []
        keyword = found[self.high] if len(found) > self.high else None
        return [Fault(f"needs {self.low} to {self.high} of {', '.join(self.group)} TRUE, {len(found)} are", keyword)]


@dataclass(frozen=True)
class Needs:
    """One parameter is of no use without another; ``code`` may be a warning's."""

    parameter: str
    other: str
    code: str = "AMX4082"

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.parameter} needs {self.other}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a CALL that gives the one without the other."""
        if self.parameter not in given or self.other in given:
            return []
        return [Fault(f"{self.parameter} is given without {self.other}", self.parameter, self.code)]


@dataclass(frozen=True)
class ForcedUp:
    """A literal below a bound counts as the bound when the task runs: a warning (27)."""

    parameter: str
    low: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"A {self.parameter} below {self.low} counts as {self.low}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the warning for a literal below the bound."""
        value = given[self.parameter].value if self.parameter in given else None
        if not isinstance(value, int) or value >= self.low:
            return []
        return [Fault(f"{self.parameter} = {value} counts as {self.low}", self.parameter, "AMX4098")]


@dataclass(frozen=True)
class SameSize:
    """Two tables must have the same number of elements."""

    first: str
    second: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.second} must have as many elements as {self.first}."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of tables of different sizes."""
        sizes = [given[name].size for name in (self.first, self.second) if name in given]
        if len(sizes) < 2 or None in sizes or sizes[0] == sizes[1]:
            return []
        message = f"{self.second} has {sizes[1]} elements, {self.first} has {sizes[0]}"
        return [Fault(message, self.second, "AMX4092")]


@dataclass(frozen=True)
class TableOfPowers:
    """A table has 2**m + 1 elements, with 2**m at most the literal ``most`` + 1 (section 13)."""

    table: str
    most: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.table} must have 2**m + 1 elements, with 2**m at most {self.most} + 1."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a table with another number of elements."""
        size = given[self.table].size if self.table in given else None
        most = given[self.most].value if self.most in given else None
        if size is None:
            return []
        steps = size - 1
        if steps < 1 or steps & (steps - 1):
            return [Fault(f"{self.table} has {size} elements, which is not 2**m + 1", self.table, "AMX4092")]
        if isinstance(most, int) and steps > most + 1:
            message = f"{self.table} has {size} elements, for {self.most} = {most} it may have {most + 2} at most"
            return [Fault(message, self.table, "AMX4092")]
        return []


@dataclass(frozen=True)
class MostElements:
    """A table must not be longer than its index can count."""

    table: str
    most: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"{self.table} has at most {self.most} elements."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a table that is too long."""
        size = given[self.table].size if self.table in given else None
        if size is None or size <= self.most:
            return []
        return [Fault(f"{self.table} has {size} elements, at most {self.most} are allowed", self.table, "AMX4092")]


@dataclass(frozen=True)
class Storage:
    """The words that a literal requests, for each of the inputs named ``per``n, must not exceed 32767 bytes."""

    literal: str
    per: str | None = None

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        inputs = "" if self.per is None else f" x number of {self.per}n"
        return f"2 bytes x {self.literal}{inputs} must not exceed {STRUCTURE_BYTES} bytes."

    def faults(self, given: Mapping[str, Given]) -> list[Fault]:
        """Return the fault of a storage that is too large."""
        count = given[self.literal].value if self.literal in given else None
        if not isinstance(count, int):
            return []
        inputs = 1 if self.per is None else sum(_is_channel(name, self.per) for name in given)
        size = BYTES_A_WORD * count * inputs
        if size <= STRUCTURE_BYTES:
            return []
        most = STRUCTURE_BYTES // (BYTES_A_WORD * inputs)
        message = f"{self.literal} = {count} takes {size} bytes: at most {most} fit in {STRUCTURE_BYTES} bytes"
        return [Fault(message, self.literal, "AMX4091")]


def _is_channel(name: str, stem: str) -> bool:
    return name.startswith(stem) and name[len(stem) :].isdigit()


def _shortened(group: tuple[str, ...]) -> str:
    """Return names as a list, a long one of numbered names by its first and last."""
    return ", ".join(group) if len(group) <= 4 else f"{group[0]} to {group[-1]}"
