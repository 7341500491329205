import pytest
from compile.support import ran
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run


@pytest.mark.parametrize("value", [-32767, -1, 0, 1, 32767])
def test_inverts_by_default(value):
    assert run("INVERTER").scan(input=value) == {"output": -value}


@pytest.mark.parametrize("value", [-32768, -32767, -1, 0, 1, 32767])
def test_passes_input_on_while_enable_is_false(value):
    assert run("INVERTER").scan(input=value, enable=False) == {"output": value}


def test_minus_minus_32768_clamps():
    """Section 14 does not say that this is logged."""
    block = run("INVERTER")
    assert block.scan(input=-32768) == {"output": 32767}
    assert block.error == 0


@repeatable
@given(st.lists(st.tuples(st.booleans(), int16), min_size=1, max_size=20))
def test_two_inverters_in_a_row_give_the_input_back(rows):
    first, second = run("INVERTER"), run("INVERTER")
    for enable, value in rows:
        between = first.scan(input=value, enable=enable)["output"]
        assert between == (value if not enable else max(min(-value, 32767), -32767))
        back = second.scan(input=between, enable=enable)["output"]
        assert back == (-32767 if enable and value == -32768 else value)


def test_enable_may_be_inverted():
    task = ran(
        "A% = 5", "CALL INVERTER(ENABLE=-X@, INPUT=A%, OUTPUT=B%)", "CALL INVERTER(ENABLE=X@, INPUT=A%, OUTPUT=C%)"
    )
    assert (task.value("B%"), task.value("C%")) == (-5, 5)
