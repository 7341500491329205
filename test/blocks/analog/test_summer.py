import pytest
from hypothesis import given

from blocks.support import int16, repeatable, run


@pytest.mark.parametrize(
    ("input1", "input2", "output", "error"),
    [
        (5, 3, 8, 0),
        (32767, 0, 32767, 0),
        (32767, 1, 32767, 7001),
        (-32768, 0, -32768, 0),
        (-32768, -1, -32768, 7001),
        (32767, 32767, 32767, 7001),
        (-32768, -32768, -32768, 7001),
    ],
)
def test_adds_and_logs_the_clamp(input1, input2, output, error):
    block = run("SUMMER")
    assert block.scan(input1=input1, input2=input2) == {"output": output}
    assert block.error == error


@repeatable
@given(int16, int16)
def test_logs_exactly_when_the_sum_does_not_fit(input1, input2):
    block = run("SUMMER")
    output = block.scan(input1=input1, input2=input2)["output"]
    assert (output == input1 + input2) == (block.error == 0)
    assert output == sorted((-32768, input1 + input2, 32767))[1]
