"""Values of common variables as messages carry them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Values(NamedTuple):
    """Values of common variables: entry i is ``element[i]`` of ``variable[i]``."""

    variable: Sequence[int] = ()
    element: Sequence[int] = ()
    value: Sequence[float] = ()
    text: Sequence[str] = ()


NO_VALUES = Values()
"""The one empty Values: most messages of a recording hold it, and the codec knows it by its identity."""
