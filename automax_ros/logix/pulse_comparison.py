"""PULSE_MULT and the PMUL that takes its place, run side by side over the same feedback."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.blocks.instance import Instance
from automax_ros.blocks.pulse import PULSE_MULT
from automax_ros.core.ticks import DEFAULT_TICK_NS
from automax_ros.core.types import Value
from automax_ros.logix.pulse_conversion import PulseParameters


@dataclass(frozen=True)
class Pair:
    """The same value of both, in counts, on a scan; scans count from 1."""

    scan: int
    pulse_mult: int
    pmul: int

    @property
    def difference(self) -> int:
        """Counts that PMUL has more."""
        return self.pmul - self.pulse_mult


class PulseComparison:
    """Runs both, and remembers where outputs and totals differ.

    ``output`` and ``total`` are those of the last scan, ``scans`` and ``differing`` how many scans were run and on how
    many of them the outputs differed. The four that follow are None while nothing differs; of several greatest
    differences the first counts. A total is the sum of all outputs, exact, and runs on through resets (decision).
    """

    def __init__(self, parameters: PulseParameters) -> None:
        """Start both new, as on the first scan of a task."""
        self._block = Instance(PULSE_MULT, DEFAULT_TICK_NS, **_literals(parameters))  # the period does not matter to it
        self._tag = parameters.pmul()
        self.scans = 0
        self.differing = 0
        self.output = Pair(0, 0, 0)
        self.total = Pair(0, 0, 0)
        self.first_output: Pair | None = None
        self.first_total: Pair | None = None
        self.greatest_output: Pair | None = None
        self.greatest_total: Pair | None = None

    def scan(self, feedback: int, reset: bool = False) -> None:
        """Run both once; ``feedback`` is an INTEGER, ``reset`` is RESET and Initialize."""
        self.scans += 1
        old = int(self._block.scan(input=feedback, reset=reset)["output"])
        self._tag.In = feedback
        self._tag.Initialize = reset
        self._tag.scan()
        new = int(self._tag.Out)  # a gain of at most 1 and 16 bits of feedback: never infinite
        self.output = Pair(self.scans, old, new)
        self.total = Pair(self.scans, self.total.pulse_mult + old, self.total.pmul + new)
        if self.output.difference:
            self.differing += 1
            self.first_output = self.first_output or self.output
            self.greatest_output = _greater(self.greatest_output, self.output)
        if self.total.difference:
            self.first_total = self.first_total or self.total
            self.greatest_total = _greater(self.greatest_total, self.total)


def _literals(parameters: PulseParameters) -> dict[str, Value]:
    literals: dict[str, Value] = {"word_size": parameters.word_size, "initial_value": parameters.initial_value}
    if parameters.multiplier is not None:
        literals["multiplier"] = parameters.multiplier
    return literals


def _greater(held: Pair | None, new: Pair) -> Pair:
    return new if held is None or abs(new.difference) > abs(held.difference) else held
