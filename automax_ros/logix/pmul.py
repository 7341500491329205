"""PMUL, the pulse multiplier of the Logix controllers: counts/scan of a feedback module, without losing any.

The source is the Logix Designer page of the instruction. Its own examples resolve two misprints there: the roll-over
edge is 2**(WordSize - 1), and "2500 => (25,000/100,000)" means a Multiplier of 25000.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from automax_ros.core.numbers import INT32_MAX, INT32_MIN, sign_extended, truncated_quotient
from automax_ros.logix.data_types import Instruction, require_dint, single

GAIN_ONE = 100_000
"""The Multiplier whose ratio of In to Out is 1."""
MULTIPLIER_LIMIT = 1_000_000
"""Largest magnitude of a Multiplier; larger ones are limited to it."""
MIN_WORD_SIZE, MAX_WORD_SIZE = 2, 32
EXACT_LIMIT = 2**24
"""Largest magnitude of Out up to which a REAL holds every whole number."""

_INSTRUCT_FAULT, _WORD_SIZE_INV, _OUT_OVERFLOW, _LOST_PRECISION, _MULTIPLIER_INV = (1 << bit for bit in range(5))


def _status_bit(bit: int, meaning: str) -> property:
    return property(lambda tag: bool(tag.Status & bit), doc=meaning)


@dataclass
class PulseMultiplier(Instruction):
    """A tag of type PULSE_MULTIPLIER, with the instruction's internal registers.

    Set the input members, call ``scan``, read the output members. ``scan`` refuses values that the members' types
    cannot hold.

    Input members: ``EnableIn``; ``In`` (DINT, counts); ``Initialize``; ``InitialValue`` (DINT, counts); ``Mode``, TRUE
    for relative, FALSE for absolute; ``WordSize`` (DINT, 2 to 32 bits; relative mode only); ``Multiplier`` (DINT,
    -1,000,000 to 1,000,000, in 1/100,000).

    Output members: ``EnableOut``; ``Out`` (REAL, whole counts); ``Status`` (DINT) and its bits, which are properties.

    Registers: ``previous_in`` is In(n-1), ``remainder`` is INT_Remainder, in 1/100,000 of a count and with its sign.

    Where the page is silent:

    - Ans has 64 bits, which it never leaves, and INT_Out is a DINT (decision).
    - OutOverflow means that the quotient left 32 bits: Out is then Infinity of its sign, and the remainder is that of
      the true quotient (decision).
    - LostPrecision depends on the integer, before it becomes a REAL; an infinite Out has lost precision too (decision).
    - InstructFault is set with any of the other four bits (decision): they are the errors that its text lists.
    - The difference keeps its low WordSize bits with their sign, as in PULSE_MULT: a change of exactly half a word
      gives -2**(WordSize - 1) in either direction.
    - An invalid WordSize holds Out with its status bits, In(n-1) and the remainder: a later valid WordSize counts from
      there. On a first scan it holds an Out of 0 (the page: Out(n-1) = 0). In absolute mode, which does not use it, no
      WordSize is invalid.
    - Initialize takes precedence over an invalid WordSize. Both parameters are checked while it is set.
    - Without EnableIn registers and Status stay as they are: the next execution sees the whole change since the last.
    - The first scan is the first execution of a new tag or after a prescan. With Initialize set it is like any other.
    - Absolute mode keeps In(n-1) up to date, so that a change of Mode starts from the last In.
    """

    In: int = 0
    Initialize: bool = False
    InitialValue: int = 0
    Mode: bool = True
    WordSize: int = 14
    Multiplier: int = GAIN_ONE
    Out: float = field(default=0.0, init=False)
    Status: int = field(default=0, init=False)
    previous_in: int = field(default=0, init=False)
    remainder: int = field(default=0, init=False)
    _was_initialize: bool = field(default=False, init=False, repr=False)

    InstructFault = _status_bit(_INSTRUCT_FAULT, "Status.0: one of the errors below was found.")
    WordSizeInv = _status_bit(_WORD_SIZE_INV, "Status.1: WordSize is not 2 to 32.")
    OutOverflow = _status_bit(_OUT_OVERFLOW, "Status.2: the internal output left 32 bits, Out is infinite.")
    LostPrecision = _status_bit(_LOST_PRECISION, "Status.3: Out is beyond +-2**24, where a REAL has not every number.")
    MultiplierInv = _status_bit(_MULTIPLIER_INV, "Status.4: Multiplier is beyond +-1,000,000 and was limited.")

    def prescan(self) -> None:
        """Do the prescan; the next execution is not that after Initialize."""
        super().prescan()
        self._was_initialize = False

    def scan(self) -> None:
        """Execute the instruction once, if EnableIn is set.

        Raises:
            ValueError: In, InitialValue, WordSize or Multiplier is not a DINT; nothing was executed.
        """
        for member in ("In", "InitialValue", "WordSize", "Multiplier"):
            require_dint(member, getattr(self, member))
        self.EnableOut = bool(self.EnableIn)
        if not self.EnableIn:
            return
        self._set_registers()
        found = self._parameter_errors()
        if self.Initialize:
            self.Out = 0.0
        elif found & _WORD_SIZE_INV:
            found |= self.Status & (_OUT_OVERFLOW | _LOST_PRECISION)
        else:
            self.Out, errors = _out_of(self._multiply())
            found |= errors
        self.Status = found | _INSTRUCT_FAULT if found else 0

    def _set_registers(self) -> None:
        """Set the registers as Initialize, its end, or a first scan requires."""
        if self._first_scan:
            self.Out, self.Status = 0.0, 0
        if self.Initialize:
            self.previous_in = 0
            self.remainder = 0
        elif self._was_initialize:
            self.previous_in = self.InitialValue
        elif self._first_scan:
            self.previous_in = self.In
            self.remainder = 0
        self._first_scan = False
        self._was_initialize = bool(self.Initialize)

    def _parameter_errors(self) -> int:
        found = 0
        if self.Mode and not MIN_WORD_SIZE <= self.WordSize <= MAX_WORD_SIZE:
            found |= _WORD_SIZE_INV
        if not -MULTIPLIER_LIMIT <= self.Multiplier <= MULTIPLIER_LIMIT:
            found |= _MULTIPLIER_INV
        return found

    def _multiply(self) -> int:
        """Return INT_Out of this scan and store the remainder."""
        difference = sign_extended(self.In - self.previous_in, self.WordSize) if self.Mode else self.In
        multiplier = max(-MULTIPLIER_LIMIT, min(self.Multiplier, MULTIPLIER_LIMIT))
        answer = difference * multiplier + self.remainder
        quotient = truncated_quotient(answer, GAIN_ONE)
        self.remainder = answer - quotient * GAIN_ONE
        self.previous_in = self.In
        return quotient


def _out_of(quotient: int) -> tuple[float, int]:
    if not INT32_MIN <= quotient <= INT32_MAX:
        return math.copysign(math.inf, quotient), _OUT_OVERFLOW | _LOST_PRECISION
    return single(quotient), 0 if -EXACT_LIMIT <= quotient <= EXACT_LIMIT else _LOST_PRECISION
