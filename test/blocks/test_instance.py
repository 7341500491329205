import pytest

from automax_ros.blocks.instance import InstanceError

from .support import run


def test_defaults_fill_in_what_is_not_given():
    assert run("RAMP").scan(input=100) == {"output": 100, "rate": 100}


@pytest.mark.parametrize(
    ("literals", "inputs", "message"),
    [
        ({}, {}, "RAMP needs INPUT"),
        ({}, {"input": 1, "speed": 2}, "RAMP has no input SPEED"),
        ({"speed": 2}, {}, "RAMP has no input SPEED"),
        ({"scale": 0}, {}, "SCALE must lie between 1 and 32767, not 0"),
        ({"scale": 32768}, {}, "SCALE must lie between 1 and 32767, not 32768"),
        ({}, {"input": 1, "scale": 5}, "SCALE must be a literal"),
        ({"hold": True}, {"input": 1, "hold": False}, "HOLD is given as a literal already"),
    ],
)
def test_says_what_is_wrong(literals, inputs, message):
    with pytest.raises(InstanceError, match=message):
        run("RAMP", **literals).scan(**inputs)


def test_variable_only_inputs_take_no_literal():
    with pytest.raises(InstanceError, match="LIMIT: INPUT must be a variable"):
        run("LIMIT", input=5)


@pytest.mark.parametrize("wlg", [0.001, 300.0])
def test_literal_coefficients_must_lie_within_their_limits(wlg):
    with pytest.raises(InstanceError, match="LAG: WLG out of limits"):
        run("LAG", wlg=wlg)


def test_error_is_that_of_the_last_scan_only():
    block = run("SUMMER")
    block.scan(input1=32767, input2=1)
    assert block.error == 7001
    block.scan(input1=0, input2=1)
    assert block.error == 0


def test_outputs_are_a_copy():
    block = run("SUMMER")
    block.scan(input1=1, input2=1)["output"] = 99
    assert block.outputs == {"output": 2}
