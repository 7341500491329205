from hypothesis import given

from blocks.support import int16, repeatable, run


@repeatable
@given(int16, int16)
def test_select_true_passes_input1(input1, input2):
    block = run("SWITCH")
    assert block.scan(input1=input1, input2=input2, select=True) == {"output": input1}
    assert block.scan(input1=input1, input2=input2, select=False) == {"output": input2}
