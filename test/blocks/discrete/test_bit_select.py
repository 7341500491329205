import pytest
from compile.support import lines, run_scans, task_of
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run


def selected(block, value, **inputs):
    """The numbers of the outputs that are TRUE."""
    return [int(name.removeprefix("output")) for name, state in block.scan(input=value, **inputs).items() if state]


@pytest.mark.parametrize("number", range(16))
def test_one_output_of_sixteen(number):
    block = run("BIT_SELECT")
    result = block.scan(input=number)
    assert result == {f"output{n}": n == number for n in range(16)}


@pytest.mark.parametrize("value", [-32768, -1, 16, 32767])
def test_all_outputs_are_false_beyond(value):
    block = run("BIT_SELECT")
    assert selected(block, 3) == [3]
    assert selected(block, value) == []


def test_offset_is_subtracted():
    block = run("BIT_SELECT", offset=100)
    assert [selected(block, value) for value in (99, 100, 107, 115, 116)] == [[], [0], [7], [15], []]
    block = run("BIT_SELECT", offset=-5)
    assert [selected(block, value) for value in (-6, -5, 10, 11)] == [[], [0], [15], []]


@pytest.mark.parametrize(
    ("value", "offset"), [(-32768, 32761), (32767, -32767), (-32768, 32767), (32767, -32768), (-32766, 32767)]
)
def test_the_difference_does_not_wrap(value, offset):
    """In 16 bits each of these differences would lie between 0 and 15 or change its sign."""
    assert selected(run("BIT_SELECT", offset=offset), value) == []


@repeatable
@given(int16, st.integers(-20, 20))
def test_the_number_of_the_output_is_the_distance(offset, distance):
    value = offset + distance
    if -32768 <= value <= 32767:
        assert selected(run("BIT_SELECT"), value, offset=offset) == ([distance] if 0 <= distance <= 15 else [])


def test_outputs_may_be_left_out_and_come_in_any_order():
    text = lines(
        "C% = C% + 1",
        "CALL BIT_SELECT(INPUT=C%, OUTPUT3=X@, OUTPUT1=Y@)",
    )
    task, _ = task_of(text)
    seen = []
    for number in range(1, 5):
        run_scans(task, 1, first=number)
        seen.append((task.value("Y@"), task.value("X@")))
    assert seen == [(True, False), (False, False), (False, True), (False, False)]
