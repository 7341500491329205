"""The value of a tunable after it was set (2.4.5)."""

from __future__ import annotations

import math

from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.language.program import Symbol


def tunable_value(symbol: Symbol, name: str, value: object) -> int | float:
    """Return the value that a tunable would have if it were set to ``value``; ``name`` identifies it in messages.

    Raises KeyError if it cannot be tuned, ValueError if the value is outside its limits or not of its type.
    """
    if symbol.tuning is None:
        raise KeyError(name)
    low, high = symbol.tuning.low, symbol.tuning.high
    assert not isinstance(low, str)
    assert not isinstance(high, str)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{name} cannot be {value!r}: that is not a number")
    # A limit such as 0.1 is held in single precision too, so the stored value is what must lie inside.
    stored = stored_real(float(value))[0] if symbol.type is DataType.REAL else int(value)
    if symbol.type is not DataType.REAL and stored != value:
        raise ValueError(f"{name} = {value} is not a whole number")
    if not low <= stored <= high:
        raise ValueError(f"{name} = {value:.8g} lies outside {low:.8g} to {high:.8g}")
    return stored
