"""`automax play`: what it refuses before it needs anything of ROS 2."""

import pytest


@pytest.mark.parametrize("arguments", [["--from", "3", "--to", "2"], ["--from", "1", "--to", "0.999999999"]])
def test_a_range_that_ends_before_it_begins_is_2(automax, arguments):
    result = automax("play", "none", *arguments)
    assert (result.code, result.out) == (2, "")
    assert "--to lies before --from" in result.err
