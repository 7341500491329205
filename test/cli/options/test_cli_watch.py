"""The names of `--watch`."""

import pytest

from automax_ros.cli.options.values import watch_list


@pytest.mark.parametrize(
    ("values", "names"),
    [
        (None, None),
        (["A%"], ["A%"]),
        (["A%,B@", "C"], ["A%", "B@", "C"]),
        (["T%(1,2), B@,,U%[3,4,5]"], ["T%(1,2)", "B@", "U%[3,4,5]"]),
        ([""], []),
    ],
)
def test_commas_between_subscripts_do_not_separate(values, names):
    assert watch_list(values) == names
