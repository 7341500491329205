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


TRUNCATED = [(19, 1), (-19, -1), (20, 2), (-20, -2), (9, 0), (-9, 0)]
DIVIDED_BY_0 = [(5, 32767), (1, 32767), (-5, -32768), (-1, -32768), (32767, 32767), (-32768, -32768), (0, 0)]


@pytest.mark.parametrize(
    ("pairs", "scale", "output", "error"),
    [
        *(pytest.param([(sum_, 1)], 10, output, 0, id=f"{sum_}/10 is truncated") for sum_, output in TRUNCATED),
        *(pytest.param([(sum_, 1)], 0, output, 7003, id=f"{sum_}/0 is logged") for sum_, output in DIVIDED_BY_0),
        pytest.param([(6, 1), (6, 1)], 10, 1, 0, id="only the sum is divided: 0.6 + 0.6 = 1.2"),
        pytest.param([(500, 1), (120, -1), (30, -1)], 1, 350, 0, id="a gain of -1 subtracts (section 7 note 3)"),
        pytest.param([(500, 3)], -10, -150, 0, id="a negative SCALE inverts the output (section 7 note 4)"),
        pytest.param([(-500, 3)], -10, 150, 0, id="a negative SCALE inverts a negative output"),
        pytest.param([(0, 0), (7, 3), (0, 5), (4, 0), (1, 1)], 1, 22, 0, id="a channel of zeros does not end the sum"),
        pytest.param([(32767, 1)], 1, 32767, 0, id="the largest quotient"),
        pytest.param([(16384, 2)], 1, 32767, 7001, id="a greater one is clamped and logged"),
        pytest.param([(-16384, 2)], 1, -32768, 0, id="the smallest quotient"),
        pytest.param([(-10923, 3)], 1, -32768, 7001, id="a smaller one is clamped and logged"),
        pytest.param([(-32768, 1)], -1, 32767, 7001, id="-32768/-1 is clamped and logged"),
    ],
)
def test_output_and_error(pairs, scale, output, error):
    assert amplify(pairs, scale=scale) == (output, error)


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
