import pytest
from hypothesis import given

from blocks.support import int16, repeatable, run


@pytest.mark.parametrize(
    ("name", "input1", "input2", "output", "error"),
    [
        ("DIFFERENCE", 5, 3, 2, 0),
        ("DIFFERENCE", -32768, 0, -32768, 0),
        ("DIFFERENCE", 32767, 0, 32767, 0),
        ("DIFFERENCE", 32767, -1, 32767, 7001),
        ("DIFFERENCE", -32768, 1, -32768, 7001),
        ("DIFFERENCE", -32768, 32767, -32768, 7001),
        ("DIFFERENCE", 0, -32768, 32767, 7001),
        ("SUMMER", 5, 3, 8, 0),
        ("SUMMER", 32767, 0, 32767, 0),
        ("SUMMER", 32767, 1, 32767, 7001),
        ("SUMMER", -32768, 0, -32768, 0),
        ("SUMMER", -32768, -1, -32768, 7001),
        ("SUMMER", 32767, 32767, 32767, 7001),
        ("SUMMER", -32768, -32768, -32768, 7001),
    ],
)
def test_the_clamp_is_logged(name, input1, input2, output, error):
    block = run(name)
    assert block.scan(input1=input1, input2=input2) == {"output": output}
    assert block.error == error


@pytest.mark.parametrize(("name", "sign"), [("SUMMER", 1), ("DIFFERENCE", -1)])
@repeatable
@given(int16, int16)
def test_logs_exactly_when_the_result_does_not_fit(name, sign, input1, input2):
    block = run(name)
    exact = input1 + sign * input2
    output = block.scan(input1=input1, input2=input2)["output"]
    assert (output == exact) == (block.error == 0)
    assert output == sorted((-32768, exact, 32767))[1]
