"""Converts the parameters of a PULSE_MULT to those of the PMUL that replaces it, and runs both on the same feedback."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.blocks.declare.instance import Instance
from automax_ros.blocks.discrete.pulse import PULSE_MULT
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.ticks import DEFAULT_TICK_NS
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.logix.pmul import GAIN_ONE, MIN_WORD_SIZE, PulseMultiplier

DEFAULT_MULTIPLIER = 32768
"""PULSE_MULT's gain of 1, which exists only by default (section 21, note 1)."""
MAX_WORD_SIZE = 16


class ConversionError(UserError):
    """A parameter that PULSE_MULT does not accept, or one without equivalent in PMUL."""


@dataclass(frozen=True)
class PulseParameters:
    """Parameters of a PULSE_MULT; ``multiplier`` is None if the CALL does not program it.

    Raises:
        ConversionError: a parameter is out of range, or is a WORD_SIZE of 1.
    """

    word_size: int = 0
    multiplier: int | None = None
    initial_value: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.word_size <= MAX_WORD_SIZE:
            raise ConversionError(f"WORD_SIZE lies between 0 and {MAX_WORD_SIZE}, {self.word_size} does not")
        if 0 < self.word_size < MIN_WORD_SIZE:
            raise ConversionError(
                f"WORD_SIZE {self.word_size} has no equivalent: PMUL's WordSize is at least {MIN_WORD_SIZE}"
            )
        if self.multiplier is not None:
            hint = "a gain of exactly 1 is MULTIPLIER left out" if self.multiplier == DEFAULT_MULTIPLIER else None
            _require_integer("MULTIPLIER", self.multiplier, hint)
        _require_integer("INITIAL_VALUE", self.initial_value)

    @property
    def numerator(self) -> int:
        """The gain in 1/32768."""
        return DEFAULT_MULTIPLIER if self.multiplier is None else self.multiplier

    @property
    def relative(self) -> bool:
        """Whether the block works in relative mode, WORD_SIZE not 0."""
        return self.word_size > 0

    @property
    def pmul_multiplier(self) -> int:
        """PMUL's Multiplier: the gain in 1/100,000, rounded to the nearest, halves away from zero (decision)."""
        doubled, unit = 2 * abs(self.numerator) * GAIN_ONE, 2 * DEFAULT_MULTIPLIER
        nearest = (doubled + DEFAULT_MULTIPLIER) // unit
        return nearest if self.numerator >= 0 else -nearest

    @property
    def error_per_million(self) -> float:
        """Counts that PMUL gives more than PULSE_MULT for a million counts of feedback; exact, at most 5 either way."""
        return (self.pmul_multiplier * DEFAULT_MULTIPLIER - self.numerator * GAIN_ONE) * 10 / DEFAULT_MULTIPLIER

    def pmul(self) -> PulseMultiplier:
        """Return a new PMUL tag with these parameters; in absolute mode, which has no WordSize, with the default."""
        tag = PulseMultiplier(Mode=self.relative, Multiplier=self.pmul_multiplier, InitialValue=self.initial_value)
        if self.relative:
            tag.WordSize = self.word_size
        return tag


def _require_integer(name: str, value: int, hint: str | None = None) -> None:
    if not INT16_MIN <= value <= INT16_MAX:
        raise ConversionError(f"{name} is an INTEGER, {INT16_MIN} to {INT16_MAX}, {value} is not", hint)


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
    """Runs both, and records where outputs and totals differ.

    ``output`` and ``total`` are those of the last scan, ``scans`` and ``differing`` the numbers of scans run and of
    those with different outputs. The four attributes that follow are None while nothing differs; of several greatest
    differences the first counts. A total is the sum of all outputs, exact, and continues through resets (decision).
    """

    def __init__(self, parameters: PulseParameters) -> None:
        literals: dict[str, Value] = {"word_size": parameters.word_size, "initial_value": parameters.initial_value}
        if parameters.multiplier is not None:
            literals["multiplier"] = parameters.multiplier
        self._block = Instance(PULSE_MULT, DEFAULT_TICK_NS, **literals)  # the period does not matter to it
        self._tag = parameters.pmul()
        self.scans = 0
        self.differing = 0
        self.output = self.total = Pair(0, 0, 0)
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


def _greater(held: Pair | None, new: Pair) -> Pair:
    return new if held is None or abs(new.difference) > abs(held.difference) else held
