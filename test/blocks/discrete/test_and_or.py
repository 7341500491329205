import itertools

import pytest

from blocks.support import run


@pytest.mark.parametrize(("name", "expected"), [("AND", all), ("OR", any)])
@pytest.mark.parametrize("count", range(1, 9))
def test_truth_table_with_that_many_inputs(count, name, expected):
    block = run(name)
    for states in itertools.product((False, True), repeat=count):
        inputs = {f"input{n}": state for n, state in enumerate(states, 1)}
        assert block.scan(**inputs)["output"] is expected(states)
