import pytest
from hypothesis import given

from blocks.support import int16, repeatable, run


@pytest.mark.parametrize(
    ("value", "output", "plus", "minus"),
    [
        (0, 0, False, False),
        (999, 999, False, False),
        (1000, 1000, True, False),
        (1001, 1000, True, False),
        (-499, -499, False, False),
        (-500, -500, False, True),
        (-32768, -500, False, True),
    ],
)
def test_saturated_is_true_from_the_limit_on(value, output, plus, minus):
    result = run("LIMIT", limit_plus=1000, limit_minus=-500).scan(input=value)
    assert result == {"output": output, "saturated_plus": plus, "saturated_minus": minus}


def test_defaults_are_the_whole_range_of_an_integer():
    block = run("LIMIT")
    assert block.scan(input=32766) == {"output": 32766, "saturated_plus": False, "saturated_minus": False}
    assert block.scan(input=32767)["saturated_plus"]
    assert block.scan(input=-32768) == {"output": -32768, "saturated_plus": False, "saturated_minus": True}


@pytest.mark.parametrize("value", [-2000, -1000, 0, 1000, 2000])
def test_limit_plus_wins_where_it_lies_below_limit_minus(value):
    result = run("LIMIT").scan(input=value, limit_plus=-1000, limit_minus=1000)
    assert result == {"output": -1000, "saturated_plus": True, "saturated_minus": True}


@repeatable
@given(int16, int16, int16)
def test_limiting_twice_changes_nothing_and_keeps_what_lies_inside(value, plus, minus):
    block = run("LIMIT")
    once = block.scan(input=value, limit_plus=plus, limit_minus=minus)
    assert block.scan(input=once["output"], limit_plus=plus, limit_minus=minus) == once
    assert once["output"] <= plus
    if minus <= value <= plus:
        assert once["output"] == value
    if minus <= plus:
        assert once["output"] == sorted((minus, value, plus))[1]
