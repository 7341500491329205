"""REALs at the ends of their range."""

import pytest

from automax_ros.core.numbers import REAL_LIMIT, REAL_MAX, stored_real


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_largest_magnitude_of_the_manual_is_held_without_a_clamp(sign: float) -> None:
    assert stored_real(sign * REAL_LIMIT) == (sign * REAL_MAX, False)
    assert stored_real(sign * 9.2233718e18) == (sign * REAL_MAX, True)
    assert stored_real(sign * REAL_MAX) == (sign * REAL_MAX, False)


def test_what_is_too_small_becomes_0() -> None:
    assert stored_real(5.4e-20) == (0.0, False)
    assert stored_real(-5.4e-20)[0] < 0.0
    assert stored_real(-2.7e-20) == (0.0, False)
