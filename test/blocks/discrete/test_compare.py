import pytest
from compile.support import ran
from hypothesis import given

from blocks.support import int16, repeatable, run

GREATER, EQUAL, LESS = "output_gtr", "output_equ", "output_les"


def true_output(first, second):
    """The output that is TRUE; fails unless it is exactly one."""
    (name,) = (name for name, state in run("COMPARE").scan(input1=first, input2=second).items() if state)
    return name


@pytest.mark.parametrize(
    ("first", "second", "name"),
    [
        (2, 1, GREATER),
        (1, 1, EQUAL),
        (1, 2, LESS),
        (-1, -2, GREATER),
        (-2, -1, LESS),
        (1, -1, GREATER),
        (0, 0, EQUAL),
        (-32768, 32767, LESS),
        (32767, -32768, GREATER),
        (-32768, 1, LESS),
        (-32768, -32768, EQUAL),
    ],
)
def test_which_output_is_true(first, second, name):
    """The far ends of the range included, where a difference of 16 bits would wrap."""
    assert true_output(first, second) == name


def test_outputs_follow_the_inputs_scan_by_scan():
    block = run("COMPARE", input2=10)
    assert [list(block.scan(input1=value).values()) for value in (11, 10, 9)] == [
        [True, False, False],
        [False, True, False],
        [False, False, True],
    ]


@repeatable
@given(int16, int16)
def test_exchanged_inputs_exchange_greater_and_less(first, second):
    mirror = {GREATER: LESS, EQUAL: EQUAL, LESS: GREATER}
    assert true_output(second, first) == mirror[true_output(first, second)]
    assert (true_output(first, second) == EQUAL) is (first == second)
    assert (true_output(first, second) == GREATER) is (max(first, second) == first != second)


def test_one_output_is_enough():
    task = ran(
        "A% = 5", "CALL COMPARE(INPUT1=A%, INPUT2=4, OUTPUT_LES=X@)", "CALL COMPARE(INPUT1=3, INPUT2=A%, OUTPUT_LES=Y@)"
    )
    assert (task.value("X@"), task.value("Y@")) == (False, True)
