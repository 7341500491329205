import pytest

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import run


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


@pytest.mark.parametrize(
    ("name", "literals", "standing", "carrier"),
    [
        ("LAG", {}, {"wlg": 20.0}, "input"),
        ("PROP_INT", {"wm": 3.0}, {"kp": 2.0, "wld": 4.0, "limit_plus": 900}, "input"),
        ("PID", {"loop_time": 0.022, "action": True}, {"kp": 2.0, "ki": 1.0, "input": 50}, "feedback"),
        ("RAMP", {"scale": 10}, {"accel_rate": 33}, "input"),
        ("LATCH", {}, {"clock": True}, "input"),
        ("SUMMER", {}, {"input2": 30000}, "input1"),
    ],
)
def test_driving_is_scanning(name, literals, standing, carrier):
    """Also from where a scan left the block, and back: outputs, states and error go on."""
    one, two = run(name, 22_000_000, **literals), run(name, 22_000_000, **literals)
    signal = [n * 7919 % 4001 - 2000 for n in range(200)]
    if name == "LATCH":
        signal = [value > 0 for value in signal]
    for part in (signal[:150], signal[150:]):
        scanned = [dict(one.scan(**standing, **{carrier: value}), **one.state) for value in part]
        driven = [dict(zip(two.results, result, strict=False)) for result in two.drive(carrier, part, **standing)]
        assert driven == scanned
        assert (two.outputs, two.state, two.error) == (one.outputs, one.state, one.error)
        assert two.scan(**standing, **{carrier: part[0]}) == one.scan(**standing, **{carrier: part[0]})


def test_driving_needs_what_scanning_needs():
    with pytest.raises(InstanceError, match="RAMP has no input SPEED"):
        next(run("RAMP").drive("speed", [1]))
    with pytest.raises(InstanceError, match="LAG needs WLG"):
        next(run("LAG").drive("input", [1]))


@pytest.mark.parametrize("name", ["ABSOLUTE_VALUE", "ALARM", "INVERTER"])
def test_input_must_be_a_variable(name):
    with pytest.raises(InstanceError, match=f"{name}: INPUT must be a variable"):
        run(name, input=5)
