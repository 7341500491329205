import numpy as np
import pytest
from compile.support import run_scans, task_of
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run


@pytest.mark.parametrize(("value", "output"), [(0, 0), (1, 1), (-1, 1), (32767, 32767), (-32767, 32767)])
def test_magnitude(value, output):
    assert run("ABSOLUTE_VALUE").scan(input=value) == {"output": output}


def test_the_magnitude_of_minus_32768_does_not_fit_and_clamps():
    """Section 5 does not say that this is logged."""
    block = run("ABSOLUTE_VALUE")
    assert block.scan(input=-32768) == {"output": 32767}
    assert block.error == 0


@repeatable
@given(st.lists(int16, min_size=1, max_size=30))
def test_against_numpy(values):
    block = run("ABSOLUTE_VALUE")
    expected = np.minimum(np.abs(np.array(values, dtype=np.int32)), 32767)
    assert [block.scan(input=value)["output"] for value in values] == list(expected)


def test_a_common_may_be_input_and_output():
    text = "10 COMMON REF%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL ABSOLUTE_VALUE(INPUT=REF%, OUTPUT=REF%)\n40 END\n"
    task, memory = task_of(text, **{"REF%": -1234})
    run_scans(task, 2)
    assert memory.read_now(0) == 1234
