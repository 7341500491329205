"""PMUL against its page: the examples, every status bit from both sides, enable, initialize, scans."""

import math

import numpy as np
import pytest

from automax_ros.logix.pmul import GAIN_ONE, PulseMultiplier
from automax_ros.logix.updn import UpDownAccumulator
from logix.support import set_bits


def outputs(tag, values):
    """Out of each scan."""
    result = []
    for tag.In in values:
        tag.scan()
        result.append(tag.Out)
    return result


def moved(change, **parameters):
    """A tag that was scanned at 0 and then after a change of In."""
    tag = PulseMultiplier(**parameters)
    outputs(tag, [0, change])
    return tag


def absolute(value, multiplier=100_000):
    """A tag in absolute mode after one scan."""
    tag = PulseMultiplier(In=value, Mode=False, Multiplier=multiplier)
    tag.scan()
    return tag


def test_members_have_the_defaults_of_the_page():
    tag = PulseMultiplier()
    inputs = (tag.EnableIn, tag.In, tag.Initialize, tag.InitialValue, tag.Mode, tag.WordSize, tag.Multiplier)
    assert inputs == (True, 0, False, 0, True, 14, 100_000)
    assert (tag.EnableOut, tag.Out, tag.Status) == (False, 0.0, 0)


# The page's examples.


def test_500_to_600_gives_100():
    assert outputs(PulseMultiplier(), [500, 600]) == [0.0, 100.0]


def test_example_1_a_quarter_of_each_count_and_none_lost():
    pmul, updn = PulseMultiplier(WordSize=12, Multiplier=25000), UpDownAccumulator()
    table = []
    for pmul.In in [0, 1, 2, 3, 4, 5]:
        pmul.scan()
        updn.InPlus = pmul.Out
        updn.scan()
        table.append((pmul.In, pmul.Out, updn.Out))
    assert table == [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 1, 1), (5, 0, 1)]


def test_roll_over_of_a_resolver_of_12_bits():
    """2047 to -2048 is one count, not 4095; and back."""
    assert outputs(PulseMultiplier(WordSize=12), [2047, -2048, 2047]) == [0.0, 1.0, -1.0]


def test_0_to_minus_2000_is_minus_2000_and_not_2096():
    assert moved(-2000, WordSize=12).Out == -2000.0


@pytest.mark.parametrize("word_size", [2, 3, 12, 14, 16, 31, 32])
def test_roll_over_edge_is_half_a_word(word_size):
    half = 2 ** (word_size - 1)
    assert moved(half - 1, WordSize=word_size).Out == np.float32(half - 1)
    assert moved(1 - half, WordSize=word_size).Out == np.float32(1 - half)
    assert moved(-half, WordSize=word_size).Out == -half
    # Exactly half a word up and down are the same bits: both count as down (decision).
    tag = PulseMultiplier(WordSize=word_size, Multiplier=100_000)
    assert outputs(tag, [-half, 0])[1] == -half
    if word_size < 32:
        assert moved(half + 1, WordSize=word_size).Out == np.float32(1 - half)


def test_example_2_electronic_line_shaft():
    """A turns four times for each turn of B: the position error stays 0, within a count on the way."""
    reference, follower = PulseMultiplier(WordSize=12, Multiplier=25000), PulseMultiplier(WordSize=12)
    error = UpDownAccumulator()
    reference.Initialize = follower.Initialize = error.Initialize = True
    for scan in range(4001):
        position = 4 * 40 * scan + scan % 4
        reference.In, follower.In = resolver(position), resolver(position // 4)
        for tag in (reference, follower):
            tag.scan()
        error.InPlus, error.InMinus = reference.Out, follower.Out
        error.scan()
        assert abs(error.Out) <= 1.0
        reference.Initialize = follower.Initialize = error.Initialize = False
    assert position == 4 * 4096 * 39 + 4 * 256  # 39 turns of B and a sixteenth
    assert error.Out == 0.0


def resolver(position):
    """What a resolver of 12 bits with sign reads at a position in counts."""
    return (position + 2048) % 4096 - 2048


# Status.


@pytest.mark.parametrize(("word_size", "valid"), [(1, False), (2, True), (32, True), (33, False), (-(2**31), False)])
def test_word_size_from_both_sides_of_its_limits(word_size, valid):
    tag = moved(1, WordSize=14)
    tag.In, tag.WordSize = 2, word_size
    tag.scan()
    assert set_bits(tag) == (set() if valid else {"WordSizeInv", "InstructFault"})
    assert tag.Status == (0 if valid else 0b00011)


def test_invalid_word_size_holds_out_and_registers():
    tag = PulseMultiplier(WordSize=12, Multiplier=75_000)
    assert outputs(tag, [0, 10]) == [0.0, 7.0]
    tag.WordSize = 33
    assert outputs(tag, [20, 30]) == [7.0, 7.0]
    assert (tag.previous_in, tag.remainder, tag.EnableOut) == (10, 50_000, True)
    tag.WordSize = 12
    assert outputs(tag, [31]) == [16.0]  # 21 * 0.75 + 0.5 = 16.25


def test_held_out_keeps_the_bits_that_speak_of_it():
    tag = moved(2**31 - 1, WordSize=32, Multiplier=1_000_000)
    assert tag.Status == 0b01101
    tag.WordSize = 1
    assert outputs(tag, [0]) == [math.inf]
    assert tag.Status == 0b01111


def test_absolute_mode_uses_no_word_size():
    tag = PulseMultiplier(In=5, Mode=False, WordSize=99)
    assert outputs(tag, [5, -7]) == [5.0, -7.0]
    assert tag.Status == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_multiplier_is_limited_beyond_a_million(sign):
    inside, outside = moved(7, Multiplier=sign * 1_000_000), moved(7, Multiplier=sign * 1_000_001)
    assert (inside.Out, inside.Status) == (sign * 70.0, 0)
    assert (outside.Out, outside.Status) == (sign * 70.0, 0b10001)
    assert set_bits(outside) == {"MultiplierInv", "InstructFault"}
    assert outside.Multiplier == sign * 1_000_001


@pytest.mark.parametrize("sign", [1, -1])
def test_precision_is_lost_beyond_two_to_the_24th(sign):
    inside, outside = absolute(sign * 2**24), absolute(sign * (2**24 + 1))
    assert (inside.Out, inside.Status) == (sign * 2.0**24, 0)
    assert outside.Status == 0b01001
    assert set_bits(outside) == {"LostPrecision", "InstructFault"}
    assert outside.Out == sign * 2.0**24  # the count that a REAL cannot hold


@pytest.mark.parametrize(
    ("value", "multiplier", "out"),
    [
        (2**31 - 1, 100_000, 2.0**31),  # the largest DINT, as the nearest REAL
        (-(2**31), 100_000, -(2.0**31)),
        (-(2**31), -100_000, math.inf),
        (2**31 - 1, -100_000, -(2.0**31)),
        (214_748_364, 1_000_000, 2147483640.0),
        (214_748_365, 1_000_000, math.inf),
        (-214_748_364, 1_000_000, -2147483640.0),
        (-214_748_365, 1_000_000, -math.inf),
        (-(2**31), 1_000_000, -math.inf),
    ],
)
def test_out_is_infinite_where_it_leaves_32_bits(value, multiplier, out):
    tag = absolute(value, multiplier)
    assert tag.Out == (out if math.isinf(out) else np.float32(out))
    assert tag.OutOverflow == math.isinf(out)
    assert tag.Status == (0b01101 if math.isinf(out) else 0b01001)


def test_overflow_ends_with_the_scan_and_keeps_the_true_remainder():
    tag = PulseMultiplier(Mode=False, Multiplier=999_999)
    answer = (2**31 - 1) * 999_999
    assert outputs(tag, [2**31 - 1]) == [math.inf]
    assert tag.remainder == answer % 100_000
    tag.Multiplier = 100_000
    assert outputs(tag, [3]) == [3.0]
    assert (tag.Status, tag.remainder) == (0, answer % 100_000)


# EnableIn, prescan, Initialize, first scan.


def test_without_enable_nothing_is_executed():
    tag = PulseMultiplier(WordSize=12, Multiplier=75_000)
    assert outputs(tag, [0, 10]) == [0.0, 7.0]
    assert tag.EnableOut
    tag.EnableIn, tag.Multiplier, tag.Initialize = False, 2_000_000, True
    assert outputs(tag, [500]) == [7.0]
    assert (tag.EnableOut, tag.Status, tag.previous_in, tag.remainder) == (False, 0, 10, 50_000)
    tag.EnableIn, tag.Multiplier, tag.Initialize = True, 75_000, False
    assert outputs(tag, [30]) == [15.0]  # the whole change since the last execution: 20 * 0.75 + 0.5
    assert tag.EnableOut


def test_first_scan_gives_0_whatever_in_is():
    tag = PulseMultiplier(In=-1234, Multiplier=1_000_000)
    tag.scan()
    assert (tag.Out, tag.previous_in, tag.remainder) == (0.0, -1234, 0)


def test_scan_after_prescan_is_a_first_scan():
    tag = PulseMultiplier(Multiplier=75_000)
    assert outputs(tag, [0, 10]) == [0.0, 7.0]
    tag.prescan()
    assert (tag.EnableIn, tag.EnableOut, tag.Out) == (False, False, 7.0)
    assert outputs(tag, [100]) == [7.0]  # EnableIn is cleared
    tag.EnableIn = True
    assert outputs(tag, [200, 210]) == [0.0, 7.0]
    assert tag.remainder == 50_000


@pytest.mark.parametrize("count", [600, 2**31 - 1])
def test_after_a_prescan_an_invalid_word_size_holds_an_out_of_0(count):
    """The page: on the first scan Out(n-1) = 0, and that is what is held."""
    pmul = PulseMultiplier(Mode=False, In=count, Multiplier=GAIN_ONE * 10)
    pmul.scan()
    assert pmul.Out != 0
    pmul.prescan()
    pmul.EnableIn, pmul.Mode, pmul.WordSize = True, True, 1
    pmul.scan()
    assert (pmul.Out, pmul.WordSizeInv, pmul.OutOverflow, pmul.LostPrecision) == (0.0, True, False, False)


def test_first_scan_forgets_an_initialize_before_the_prescan():
    tag = PulseMultiplier(Initialize=True, InitialValue=-5)
    tag.scan()
    tag.prescan()
    tag.EnableIn, tag.Initialize = True, False
    assert outputs(tag, [40]) == [0.0]


def test_postscan_clears_the_enables_only():
    tag = moved(10, Multiplier=75_000)
    tag.postscan()
    assert (tag.EnableIn, tag.EnableOut, tag.Out, tag.remainder) == (False, False, 7.0, 50_000)
    tag.EnableIn = True
    assert outputs(tag, [20]) == [8.0]


def test_initialize_holds_out_at_0_and_clears_the_registers():
    tag = moved(10, Multiplier=75_000)
    tag.Initialize = True
    assert outputs(tag, [20, 30]) == [0.0, 0.0]
    assert (tag.previous_in, tag.remainder, tag.EnableOut) == (0, 0, True)


def test_end_of_initialize_counts_from_initial_value():
    tag = PulseMultiplier(Initialize=True, WordSize=12, Multiplier=50_000)
    tag.scan()
    tag.Initialize, tag.InitialValue = False, 2040
    assert outputs(tag, [-2046, -2040]) == [5.0, 3.0]  # 10 counts over the edge, then 6


def test_initialize_on_the_first_scan_is_like_any_other():
    tag = PulseMultiplier(Initialize=True, InitialValue=7)
    assert outputs(tag, [100]) == [0.0]
    tag.Initialize = False
    assert outputs(tag, [10]) == [3.0]


def test_initialize_is_stronger_than_an_invalid_word_size():
    tag = moved(9, WordSize=12)
    tag.Initialize, tag.WordSize = True, 0
    assert outputs(tag, [20]) == [0.0]
    assert tag.Status == 0b00011


def test_absolute_mode_scales_and_carries():
    """0.75 a scan: 0.75, 1.5, 1.25, 1.0."""
    tag = PulseMultiplier(Mode=False, Multiplier=75_000)
    assert outputs(tag, [1, 1, 1, 1]) == [0.0, 1.0, 1.0, 1.0]


def test_absolute_mode_takes_no_initial_value():
    tag = PulseMultiplier(Mode=False, Initialize=True, InitialValue=50)
    tag.scan()
    tag.Initialize = False
    assert outputs(tag, [8]) == [8.0]


def test_remainder_keeps_its_sign():
    tag = PulseMultiplier(Mode=False, Multiplier=75_000)
    assert outputs(tag, [-1, -1]) == [0.0, -1.0]
    assert tag.remainder == -50_000
    assert outputs(tag, [1]) == [0.0]
    assert tag.remainder == 25_000


def test_change_of_mode_starts_from_the_last_in():
    tag = PulseMultiplier(Mode=False)
    assert outputs(tag, [300]) == [300.0]
    tag.Mode = True
    assert outputs(tag, [310]) == [10.0]


@pytest.mark.parametrize("member", ["In", "InitialValue", "WordSize", "Multiplier"])
@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, 1.5, "1", None])
def test_what_no_dint_holds_is_refused_and_nothing_executed(member, value):
    tag = moved(10, Multiplier=75_000)
    before = (tag.Out, tag.Status, tag.previous_in, tag.remainder)
    setattr(tag, member, value)
    with pytest.raises(ValueError, match=f"^{member} is a DINT, a whole number from -2147483648 to 2147483647, not "):
        tag.scan()
    assert (tag.Out, tag.Status, tag.previous_in, tag.remainder) == before
