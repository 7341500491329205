"""PMUL against PULSE_MULT, against an independent model in fractions, and that it loses no counts."""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.instance import Instance
from automax_ros.logix.pmul import PulseMultiplier
from logix.support import BITS, repeatable, set_bits

dint = st.integers(-(2**31), 2**31 - 1) | st.sampled_from([-(2**31), -1, 0, 1, 2**24, 2**24 + 1, 2**31 - 1])
int16 = st.integers(-32768, 32767)


@repeatable
@given(st.integers(2, 24), st.lists(st.tuples(dint, st.integers(-100_000, 100_000)), max_size=40))
def test_sum_of_out_accounts_for_every_count(word_size, rows):
    """Read from Out alone, which is exact up to 2**24."""
    tag = PulseMultiplier(WordSize=word_size)
    total = exact = position = 0
    tag.scan()
    for move, tag.Multiplier in rows:
        change = model_difference(move, 0, word_size)
        position += change
        tag.In = (position + 2**31) % 2**32 - 2**31
        tag.scan()
        assert tag.Status == 0
        exact += change * tag.Multiplier
        total += int(tag.Out)
    assert total * 100_000 + tag.remainder == exact


@repeatable
@given(
    st.integers(0, 16).filter(lambda size: size != 1),
    st.integers(-31, 31),
    int16,
    st.lists(st.tuples(int16, st.booleans()), max_size=60),
)
def test_equals_pulse_mult_where_the_multiplier_converts_exactly(word_size, step, initial_value, rows):
    """Multiples of 1024/32768 are multiples of 3125/100,000: the same outputs and remainders, scan for scan."""
    block = Instance(
        CATALOGUE["PULSE_MULT"], 5_500_000, word_size=word_size, multiplier=1024 * step, initial_value=initial_value
    )
    tag = PulseMultiplier(Mode=word_size > 0, Multiplier=3125 * step, InitialValue=initial_value)
    if word_size:
        tag.WordSize = word_size
    for tag.In, tag.Initialize in rows:
        tag.scan()
        assert tag.Out == block.scan(input=tag.In, reset=tag.Initialize)["output"]
        assert Fraction(tag.remainder, 100_000) == Fraction(block.state["remainder"], 32768)


def model_difference(new, old, word_size):
    """The change nearest to 0 that leads from one reading of a word to another; exactly half a word is down."""
    change = (new - old) % 2**word_size
    return change - 2**word_size if change >= 2 ** (word_size - 1) else change


@dataclass
class Model:
    """The page written down a second time, in exact fractions of a count."""

    out: float = 0.0
    status: int = 0
    last: int = 0
    rest: Fraction = Fraction(0)
    began: bool = False
    initialized: bool = False

    def scan(self, value, initialize, initial_value, relative, word_size, multiplier):
        bad_size = relative and word_size not in range(2, 33)
        bad_multiplier = abs(multiplier) > 1_000_000
        if initialize:
            self.last, self.rest, self.out = 0, Fraction(0), 0.0
            overflow = lost = False
        else:
            if self.initialized:
                self.last = initial_value
            elif not self.began:
                self.last, self.rest = value, Fraction(0)
            overflow, lost = bool(self.status & 4), bool(self.status & 8)
            if not bad_size:
                overflow, lost = self.count(value, relative, word_size, multiplier)
        self.began, self.initialized = True, initialize
        errors = 2 * bad_size + 4 * overflow + 8 * lost + 16 * bad_multiplier
        self.status = errors + bool(errors)

    def count(self, value, relative, word_size, multiplier):
        ratio = Fraction(min(max(multiplier, -1_000_000), 1_000_000), 100_000)
        change = model_difference(value, self.last, word_size) if relative else value
        answer = change * ratio + self.rest
        whole = math.trunc(answer)
        self.rest, self.last = answer - whole, value
        overflow = not -(2**31) <= whole < 2**31
        self.out = math.copysign(math.inf, whole) if overflow else float(np.float32(whole))
        return overflow, abs(whole) > 2**24


ROW = st.tuples(
    dint | int16,
    st.booleans(),
    dint,
    st.booleans(),
    st.integers(2, 32) | st.sampled_from([0, 1, 33, 2**31 - 1]),
    st.integers(-1_000_100, 1_000_100) | dint,
    st.sampled_from(["scan", "scan", "scan", "disabled", "prescan"]),
)


@repeatable
@given(st.lists(ROW, max_size=40))
def test_against_an_independent_model(rows):
    tag, model = PulseMultiplier(), Model()
    for *inputs, what in rows:
        if what == "prescan":
            tag.prescan()
            model.began, model.initialized, model.out, model.status = False, False, 0.0, 0
        tag.EnableIn = what != "disabled"
        tag.In, tag.Initialize, tag.InitialValue, tag.Mode, tag.WordSize, tag.Multiplier = inputs
        tag.scan()
        if tag.EnableIn:
            model.scan(*inputs)
        assert (tag.Out, tag.Status, tag.EnableOut) == (model.out, model.status, tag.EnableIn)
        assert Fraction(tag.remainder, 100_000) == model.rest
        assert set_bits(tag) == {name for bit, name in enumerate(BITS) if model.status >> bit & 1}
