from fractions import Fraction
from math import trunc

import pytest
from compile.support import lines, logged, ran, run_scans, task_of
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run

LARGEST, SMALLEST = 2**31 - 1, -(2**31)


def amplify(pairs, **inputs):
    """Output and error of one scan with these (INPUT, GAIN) pairs from channel 1 on."""
    block = run("AMPLIFIER")
    for channel, (value, gain) in enumerate(pairs, 1):
        inputs[f"input{channel}"], inputs[f"gain{channel}"] = value, gain
    return block.scan(**inputs)["output"], block.error


def test_scale_defaults_to_10000():
    """So a gain of 10000 is 1."""
    assert amplify([(1234, 10000)]) == (1234, 0)
    assert amplify([(1234, 5000), (100, -10000)]) == (517, 0)


def test_the_formula_with_eight_channels():
    pairs = [(channel * 100, channel) for channel in range(1, 9)]
    assert amplify(pairs, scale=10) == (sum(channel**2 for channel in range(1, 9)) * 10, 0)


@pytest.mark.parametrize(("value", "output"), [(19, 1), (-19, -1), (20, 2), (-20, -2), (9, 0), (-9, 0)])
def test_the_quotient_truncates_toward_zero(value, output):
    assert amplify([(value, 1)], scale=10) == (output, 0)


def test_only_the_sum_is_divided():
    """0.6 + 0.6 = 1.2: each channel for itself would give 0 + 0."""
    assert amplify([(6, 1), (6, 1)], scale=10) == (1, 0)


def test_a_gain_of_minus_one_subtracts():
    """Section 7 note 3."""
    assert amplify([(500, 1), (120, -1), (30, -1)], scale=1) == (350, 0)


def test_a_negative_scale_inverts_the_output():
    """Section 7 note 4."""
    assert amplify([(500, 3)], scale=-10) == (-150, 0)
    assert amplify([(-500, 3)], scale=-10) == (150, 0)


def test_a_channel_of_zeros_does_not_end_the_sum():
    """A null pair is one that is not programmed."""
    assert amplify([(0, 0), (7, 3), (0, 5), (4, 0), (1, 1)], scale=1) == (22, 0)


@pytest.mark.parametrize(
    ("value", "gain", "output", "error"),
    [(32767, 1, 32767, 0), (32768 // 2, 2, 32767, 7001), (-16384, 2, -32768, 0), (-10923, 3, -32768, 7001)],
)
def test_a_quotient_beyond_16_bit_is_clamped_and_logged(value, gain, output, error):
    assert amplify([(value, gain)], scale=1) == (output, error)


def test_minus_32768_over_minus_one_is_clamped_and_logged():
    assert amplify([(-32768, 1)], scale=-1) == (32767, 7001)


# 2 x 32767**2 + 4 x 32767 + 1 = 2**31 - 1, the largest sum; -2 x 32768 x 32767 - 2 x 32768 = -2**31, the smallest.
TOP = [(32767, 32767), (32767, 32767), (32767, 4), (1, 1)]
BOTTOM = [(-32768, 32767), (-32768, 32767), (-32768, 2)]


def test_the_edges_of_32_bit_are_no_overflow():
    """The sum is divided: the quotient leaves 16 bits, whatever SCALE is, with the sign that SCALE gives it."""
    assert sum(value * gain for value, gain in TOP) == LARGEST
    assert sum(value * gain for value, gain in BOTTOM) == SMALLEST
    assert amplify(TOP, scale=32767) == (32767, 7001)
    assert amplify(TOP, scale=-32768) == (-32768, 7001)
    assert amplify(BOTTOM, scale=32767) == (-32768, 7001)
    assert amplify(BOTTOM, scale=-32768) == (32767, 7001)


def test_a_sum_beyond_32_bit_gives_the_clamp_of_its_sign():
    """Whatever SCALE's sign (decision)."""
    for scale in (1, -1, 32767, -32768):
        assert amplify([*TOP, (1, 1)], scale=scale) == (32767, 7002)
        assert amplify([*BOTTOM, (1, -1)], scale=scale) == (-32768, 7002)


def test_channels_behind_an_overflow_are_ignored():
    """2**30 + 2**30 leaves 32 bit at channel 2; the same channels in another order stay inside."""
    up, down = (-32768, -32768), (-32768, 32767)
    assert amplify([up, down, up, down], scale=4) == (2 * 32768 // 4, 0)
    assert amplify([up, up, down, down], scale=4) == (32767, 7002)


def test_channels_behind_an_overflow_do_not_turn_its_sign():
    up, down = (-32768, -32768), (-32768, 32767)
    assert amplify([up, up, down, down, down, down], scale=1) == (32767, 7002)
    assert amplify([down, down, down, up, up, up, up], scale=1) == (-32768, 7002)


@pytest.mark.parametrize("zeros", range(4))
def test_a_sum_at_the_edge_of_32_bit_goes_on(zeros):
    """The largest and the smallest sum after three channels, channels that add nothing, and two that lead back."""
    nothing = [(0, 5)] * zeros
    largest = [(-32768, -32768), (-32768, -32767), (32767, 1)]
    assert sum(value * gain for value, gain in largest) == LARGEST
    # 2**31 - 1 - 2**30 + 32768 - 32767 = 2**30, and -2**31 + 2**30 + 32768 = -32767 x 32768.
    assert amplify([*largest, *nothing, (-32768, 32767), (-32767, 1)], scale=-32768) == (-32768, 0)
    assert amplify([*BOTTOM, *nothing, (-32768, -32768), (-32768, -1)], scale=-32768) == (32767, 0)


@pytest.mark.parametrize(
    ("value", "output"), [(5, 32767), (1, 32767), (-5, -32768), (-1, -32768), (32767, 32767), (-32768, -32768), (0, 0)]
)
def test_scale_0_is_logged_and_gives_the_clamp_of_the_sums_sign(value, output):
    assert amplify([(value, 1)], scale=0) == (output, 7003)


def expected(pairs, scale):
    """Output and error by exact fractions."""
    total = 0
    for value, gain in pairs:
        total += value * gain
        if not SMALLEST <= total <= LARGEST:
            return (32767 if total > 0 else -32768), 7002
    exact = trunc(Fraction(total, scale))
    output = min(max(exact, -32768), 32767)
    return output, (0 if output == exact else 7001)


@repeatable
@given(st.lists(st.tuples(int16, int16), min_size=1, max_size=8), int16.filter(bool))
def test_against_exact_fractions(pairs, scale):
    assert amplify(pairs, scale=scale) == expected(pairs, scale)


extremes = st.sampled_from([-32768, -32767, 32767])


@repeatable
@given(st.lists(st.tuples(extremes, extremes), min_size=2, max_size=8), st.sampled_from([1, -1, -32768, 32767]))
def test_sums_at_the_edge_of_32_bit_against_exact_fractions(pairs, scale):
    assert amplify(pairs, scale=scale) == expected(pairs, scale)


@pytest.mark.parametrize(
    "channels",
    [
        "INPUT1=A%, GAIN1=10, INPUT2=B%, GAIN2=C%, INPUT3=3, GAIN3=100",
        "INPUT3=3, GAIN3=100, GAIN1=10, GAIN2=C%, INPUT2=B%, INPUT1=A%",
    ],
)
def test_the_order_of_entry_does_not_matter(channels):
    task = ran("A% = 20 \\ B% = -7 \\ C% = 30", f"CALL AMPLIFIER({channels}, SCALE=10, OUTPUT=T%(2))")
    assert task.value("T%")[2] == (20 * 10 - 7 * 30 + 3 * 100) // 10
    assert logged(task) == []


def test_channels_are_summed_by_number_not_by_order_of_entry():
    """Channel 1 and 2 overflow, although 3 stands between them."""
    task = ran(
        "A% = -32768 \\ B% = 32767",
        "CALL AMPLIFIER(INPUT1=A%, GAIN1=A%, INPUT3=A%, GAIN3=B%, INPUT2=A%, GAIN2=A%, SCALE=B%, OUTPUT=C%)",
    )
    assert task.value("C%") == 32767
    assert logged(task) == [(40, 7002)]


def test_each_error_is_logged_once_per_scan():
    text = lines("CALL AMPLIFIER(INPUT1=A%, GAIN1=1, SCALE=B%, OUTPUT=C%)")
    task, _ = task_of(text)
    run_scans(task, 3)
    assert task.errors.count == 3
    assert set(logged(task)) == {(30, 7003)}
