"""Rules over the set of parameters that a CALL gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.blocks.declaration import Fault


@dataclass(frozen=True)
class AtLeast:
    """A minimum number of parameters out of a group must be programmed."""

    count: int
    group: tuple[str, ...]
    what: str

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        return f"At least {self.count} of the {self.what} {', '.join(self.group)} must be programmed."

    def faults(self, given: Mapping[str, object]) -> list[Fault]:
        """Return the fault of a CALL with too few of the group."""
        found = sum(name in given for name in self.group)
        if found >= self.count:
            return []
        return [Fault(f"needs at least {self.count} of {', '.join(self.group)}, {found} given")]


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

    def faults(self, given: Mapping[str, object]) -> list[Fault]:
        """Return one fault for the first gap or half channel of each group."""
        last = max((n for n in range(1, self.most + 1) if any(f"{stem}{n}" in given for stem in self.stems)), default=0)
        for channel in range(1, last + 1):
            missing = [f"{stem}{channel}" for stem in self.stems if f"{stem}{channel}" not in given]
            if missing:
                after = next(
                    name for n in range(channel, last + 1) for name in (f"{s}{n}" for s in self.stems) if name in given
                )
                return [Fault(f"{after} is given without {missing[0]}: channels must follow on from 1", after)]
        return []
