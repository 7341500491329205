"""`scale` of a common variable: converts its counts on the module to the engineer's unit.

On ROS 2 the variable is a Float32 in that unit, in both directions; what people look at, reports, pictures, comparisons
and trends, shows that unit too. In tasks, `--set`, stimuli, recordings of common memory and tables exported from them
it is counts (decision).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, listed, section
from automax_ros.core.numbers import REAL_LIMIT, round_count
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node, YamlSequence
from automax_ros.rackfile.reading.values import (
    ProblemList,
    Section,
    entries_of,
    integer_value,
    number_value,
    wrong_kind,
)

_CODE = "AMX6450"
_KEYS: Keys = {
    key: listed(text, {"type": "number"}, least=2, most=2)
    for key, text in (("counts", "Counts at two points."), ("value", "What they mean there, in `unit`."))
}
SCHEMA: Schema = section("What the counts mean in `unit`: a straight line through two points.", _KEYS, _KEYS)
_N = TypeVar("_N", int, float)


@dataclass(frozen=True)
class Scale:
    """A straight line through two points: ``counts`` and, at the same place, ``value``; neither pair is equal."""

    counts: tuple[int, int]
    value: tuple[float, float]

    def value_of(self, counts: int) -> float:
        """Return the value of counts; beyond the two points the line continues (decision: nothing true is hidden)."""
        (first, last), (low, high) = self.counts, self.value
        if counts == last:
            return high
        return low + (counts - first) * (high - low) / (last - first)

    def counts_of(self, value: float) -> tuple[int, bool]:
        """Return the nearest count to a finite value, and whether it had to be clamped to the range of ``counts``."""
        (first, last), (low, high) = self.counts, self.value
        share = (value - low) / (high - low)
        if not 0.0 <= share <= 1.0:
            return (last if share > 1.0 else first), True
        return first + round_count(share * (last - first)), False


def scale_of(
    node: Node, name: str, kind: DataType, span: Span, findings: ProblemList, *, is_array: bool = False
) -> Scale | None:
    """Read the scale of a variable, ``{counts: [a, b], value: [x, y]}``; None if a problem was reported."""
    what = f"scale of {name}"
    if entries_of(node, what, findings) is None:
        return None
    if is_array or not kind.is_integer:
        message = f"{name} cannot have a scale: it is {'an array' if is_array else kind.word}"
        findings.add(_CODE, message, span, "only a simple INTEGER or DOUBLE INTEGER has counts")
        return None
    section = Section(node, what, _KEYS, findings)
    if not section.require(_KEYS, what, span):
        return None
    low, high = (int(limit) for limit in kind.range)
    counts = _pair(section, "counts", partial(integer_value, low=low, high=high, code=_CODE))
    value = _pair(section, "value", partial(number_value, low=-REAL_LIMIT, high=REAL_LIMIT, code=_CODE))
    return Scale(counts, value) if counts is not None and value is not None else None


def _pair(section: Section, key: str, read: Callable[[Node, str, ProblemList], _N | None]) -> tuple[_N, _N] | None:
    """Return two numbers that differ enough for a line through them, None if a problem was reported."""
    node, what = section.get(key), f"{key} of the {section.owner}"
    assert node is not None
    if not isinstance(node, YamlSequence) or len(node.items) != 2:
        wrong_kind(node, what, "a list of two numbers", section.findings)
        return None
    first, last = [read(item, what, section.findings) for item in node.items]
    if first is None or last is None:
        return None
    if first == last or not math.isfinite(1.0 / (last - first)):
        message = f"the two numbers of {what} are equal"
        section.findings.add(_CODE, message, section.key_span(key), "write those of two different points")
        return None
    return first, last
