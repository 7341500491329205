"""Parameters of PULSE_MULT as PMUL's, and both side by side."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.logix.pulse_comparison import ConversionError, Pair, PulseComparison, PulseParameters
from logix.support import repeatable

integers = st.integers(-32768, 32767)
word_sizes = st.integers(0, 16).filter(lambda size: size != 1)


def test_multiplier_left_out_is_a_gain_of_exactly_1():
    parameters = PulseParameters()
    assert (parameters.numerator, parameters.pmul_multiplier, parameters.error_per_million) == (32768, 100_000, 0.0)


@pytest.mark.parametrize(
    ("multiplier", "converted", "error"),
    [
        (8192, 25000, 0.0),
        (-32768, -100_000, 0.0),
        (0, 0, 0.0),
        (32767, 99997, 0.517578125),
        (10000, 30518, 4.21875),
        (1, 3, -0.517578125),
        (-1, -3, 0.517578125),
        (512, 1563, 5.0),  # 1562.5: halves go away from zero
        (-512, -1563, -5.0),
    ],
)
def test_multiplier_and_the_error_of_its_rounding(multiplier, converted, error):
    parameters = PulseParameters(12, multiplier)
    assert (parameters.pmul_multiplier, parameters.error_per_million) == (converted, error)


def test_no_other_multiplier_is_nearer():
    for multiplier in range(-32768, 32768):
        parameters = PulseParameters(12, multiplier)
        error = parameters.pmul_multiplier * 32768 - multiplier * 100_000  # in 1/(32768 * 100,000)
        assert abs(error) <= 32768 // 2
        assert parameters.error_per_million * 32768 == error * 10


@pytest.mark.parametrize(("word_size", "mode", "size"), [(0, False, 14), (2, True, 2), (16, True, 16)])
def test_word_size_0_is_absolute_mode(word_size, mode, size):
    tag = PulseParameters(word_size, 8192, -5).pmul()
    assert (tag.Mode, tag.WordSize, tag.Multiplier, tag.InitialValue) == (mode, size, 25000, -5)


@pytest.mark.parametrize(
    ("parameters", "message", "hint"),
    [
        ((1,), "WORD_SIZE 1 has no equivalent: PMUL's WordSize is at least 2", None),
        ((-1,), "WORD_SIZE lies between 0 and 16, -1 does not", None),
        ((17,), "WORD_SIZE lies between 0 and 16, 17 does not", None),
        ((12, 32768), "MULTIPLIER is an INTEGER, -32768 to 32767, 32768 is not", "left out"),
        ((12, 32769), "MULTIPLIER is an INTEGER, -32768 to 32767, 32769 is not", None),
        ((12, -32769), "MULTIPLIER is an INTEGER", None),
        ((12, 1, 32768), "INITIAL_VALUE is an INTEGER", None),
    ],
)
def test_parameters_out_of_range(parameters, message, hint):
    with pytest.raises(ConversionError, match=message) as caught:
        PulseParameters(*parameters)
    assert caught.value.hint is None if hint is None else hint in caught.value.hint


def test_the_one_output_that_pulse_mult_cannot_show():
    """-32768 * -1 is 32768: an INTEGER gives 32767 and the last count on the next scan, a REAL all at once."""
    comparison = PulseComparison(PulseParameters(0, -32768))
    comparison.scan(-32768)
    assert comparison.output == Pair(1, 32767, 32768)
    comparison.scan(0)
    assert (comparison.output, comparison.total) == (Pair(2, 1, 0), Pair(2, 32768, 32768))
    assert comparison.differing == 2
    assert (comparison.first_output, comparison.greatest_output) == (Pair(1, 32767, 32768), Pair(1, 32767, 32768))
    assert (comparison.first_total, comparison.greatest_total) == (Pair(1, 32767, 32768), Pair(1, 32767, 32768))


def test_total_runs_on_through_a_reset():
    comparison = PulseComparison(PulseParameters(12))
    for feedback, reset in [(0, False), (10, False), (20, True), (30, False)]:
        comparison.scan(feedback, reset)
    assert comparison.total == Pair(4, 40, 40)  # 10, then from INITIAL_VALUE 0 to 30


@repeatable
@given(word_sizes, st.none() | integers, integers, st.lists(st.tuples(integers, st.booleans()), max_size=40))
def test_what_differs_is_what_a_list_of_all_scans_shows(word_size, multiplier, initial_value, rows):
    comparison = PulseComparison(PulseParameters(word_size, multiplier, initial_value))
    outputs, totals = [], []
    for row in rows:
        comparison.scan(*row)
        outputs.append(comparison.output)
        totals.append(Pair(len(outputs), sum(pair.pulse_mult for pair in outputs), sum(pair.pmul for pair in outputs)))
        assert comparison.total == totals[-1]
    assert [pair.scan for pair in outputs] == list(range(1, len(rows) + 1))
    assert comparison.differing == sum(pair.pmul != pair.pulse_mult for pair in outputs)
    for pairs, first, greatest in (
        (outputs, comparison.first_output, comparison.greatest_output),
        (totals, comparison.first_total, comparison.greatest_total),
    ):
        unequal = [pair for pair in pairs if pair.pmul != pair.pulse_mult]
        assert first == (unequal[0] if unequal else None)
        assert greatest == max(unequal, key=lambda pair: abs(pair.pmul - pair.pulse_mult), default=None)


@repeatable
@given(word_sizes, st.none() | st.integers(-32767, 32767), st.lists(integers, min_size=1, max_size=60))
def test_totals_stay_as_near_as_the_rounded_ratio_allows(word_size, multiplier, feedback):
    """They differ by the ratio's error times the counts that went in, and by less than a count for each remainder."""
    parameters = PulseParameters(word_size, multiplier)
    comparison = PulseComparison(parameters)
    exact = PulseComparison(PulseParameters(word_size))
    for value in feedback:
        comparison.scan(value)
        exact.scan(value)
    drift = Fraction(parameters.error_per_million) * exact.total.pmul / 1_000_000
    assert abs(comparison.total.difference - drift) < 2
