from fractions import Fraction
from math import trunc

import pytest
from compile.support import logged, ran
from hypothesis import given

from blocks.support import int16, repeatable, run


def divided(first, second, third):
    """Output and error of one scan."""
    block = run("MULTIPLY_DIVIDE")
    return block.scan(input1=first, input2=second, input3=third)["output"], block.error


@pytest.mark.parametrize(
    ("inputs", "output"),
    [
        ((6, 7, 2), 21),
        ((7, 1, 2), 3),
        ((-7, 1, 2), -3),
        ((7, -1, 2), -3),
        ((7, 1, -2), -3),
        ((-7, -1, 2), 3),
        ((-7, -1, -2), -3),
        ((1, 1, 32767), 0),
        ((-1, 1, 32767), 0),
        ((0, 5, -3), 0),
    ],
)
def test_the_quotient_truncates_toward_zero(inputs, output):
    assert divided(*inputs) == (output, 0)


def test_the_product_has_32_bits():
    """32767 x 32767 / 32767 comes back, and -32768 squared over -32768."""
    assert divided(32767, 32767, 32767) == (32767, 0)
    assert divided(-32768, -32768, -32768) == (-32768, 0)
    assert divided(-32768, 32767, 32767) == (-32768, 0)
    assert divided(20000, 30000, 25000) == (24000, 0)


@pytest.mark.parametrize(
    ("inputs", "output"),
    [
        ((32767, 2, 1), 32767),
        ((-32768, 2, 1), -32768),
        ((-32768, 1, -1), 32767),
        ((-32768, -32768, 1), 32767),
        ((-32768, -32768, -1), -32768),
        ((32767, 32767, 32766), 32767),
    ],
)
def test_a_result_beyond_16_bit_is_clamped_but_not_logged(inputs, output):
    """Section 18 speaks of the clamp alone."""
    assert divided(*inputs) == (output, 0)


@pytest.mark.parametrize(
    ("first", "second", "output"),
    [(1, 1, 32767), (-1, -1, 32767), (1, -1, -32768), (-1, 1, -32768), (0, 5, 0), (5, 0, 0)],
)
def test_division_by_zero_is_logged_and_gives_the_clamp_of_the_products_sign(first, second, output):
    assert divided(first, second, 0) == (output, 7003)


@repeatable
@given(int16, int16, int16.filter(bool))
def test_against_exact_fractions(first, second, third):
    exact = trunc(Fraction(first * second, third))
    assert divided(first, second, third) == (min(max(exact, -32768), 32767), 0)


def test_in_a_task_with_constants():
    task = ran(
        "A% = 900",
        "CALL MULTIPLY_DIVIDE(INPUT1=A%, INPUT2=-7, INPUT3=100, OUTPUT=A%)",
        "CALL MULTIPLY_DIVIDE(INPUT1=-3, INPUT2=5, INPUT3=C%, OUTPUT=B%)",
    )
    assert (task.value("A%"), task.value("B%")) == (-63, -32768)
    assert logged(task) == [(50, 7003)]
