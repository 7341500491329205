"""The parameters of a PULSE_MULT as those of the PMUL that takes its place."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.core.faults import Fault
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.logix.pmul import GAIN_ONE, MIN_WORD_SIZE, PulseMultiplier

DEFAULT_MULTIPLIER = 32768
"""PULSE_MULT's gain of 1, which exists only by default (section 21, note 1)."""
MAX_WORD_SIZE = 16


class ConversionError(Fault):
    """A parameter that PULSE_MULT does not take, or one without equivalent in PMUL."""


@dataclass(frozen=True)
class PulseParameters:
    """Parameters of a PULSE_MULT; ``multiplier`` is None where the CALL does not program it.

    Raises:
        ConversionError: a parameter is out of range, or is a WORD_SIZE of 1.
    """

    word_size: int = 0
    multiplier: int | None = None
    initial_value: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
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
        """Return a new PMUL tag with these parameters; in absolute mode, which has no WordSize, the default's."""
        tag = PulseMultiplier(Mode=self.relative, Multiplier=self.pmul_multiplier, InitialValue=self.initial_value)
        if self.relative:
            tag.WordSize = self.word_size
        return tag


def _require_integer(name: str, value: int, hint: str | None = None) -> None:
    if not INT16_MIN <= value <= INT16_MAX:
        raise ConversionError(f"{name} is an INTEGER, {INT16_MIN} to {INT16_MAX}, {value} is not", hint)
