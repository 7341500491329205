from hypothesis import given
from hypothesis import strategies as st

from blocks.support import repeatable, run


def test_true_on_the_scan_that_input_goes_on():
    block = run("TRANSITION")
    inputs = [False, True, True, False, True, False, False]
    assert [block.scan(input=value)["output"] for value in inputs] == [False, True, False, False, True, False, False]


def test_an_input_that_is_on_at_the_first_scan_is_a_transition():
    assert run("TRANSITION").scan(input=True) == {"output": True}


@repeatable
@given(st.lists(st.booleans()))
def test_counts_the_rising_edges(inputs):
    block = run("TRANSITION")
    found = sum(block.scan(input=value)["output"] for value in inputs)
    text = "".join("01"[value] for value in [False, *inputs])
    assert found == text.count("01")
