import itertools

import pytest

from blocks.support import run


@pytest.mark.parametrize(("reset", "set_", "clock", "data", "before"), list(itertools.product((False, True), repeat=5)))
def test_truth_table(reset, set_, clock, data, before):
    """Section 15's sentence, whatever the output was before."""
    block = run("LATCH")
    block.outputs["output"] = before
    output = block.scan(reset=reset, set=set_, clock=clock, input=data)["output"]
    if reset:
        assert output is False
    elif set_:
        assert output is True
    elif clock:
        assert output is data
    else:
        assert output is before


def test_it_has_no_copy_of_its_own():
    """What another writes into the output variable stays while the latch does not write it."""
    block = run("LATCH")
    assert block.scan(set=True, reset=False) == {"output": True}
    block.outputs["output"] = False
    assert block.scan(set=False, reset=False) == {"output": False}
    assert block.state == {}
