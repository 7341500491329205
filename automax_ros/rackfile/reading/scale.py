"""`scale` of a common variable: its counts on the module, and what they mean in the engineer's unit.

On ROS 2 the variable is a Float32 in that unit, both ways. Everywhere else, in tasks, `--set`, stimuli, reports and
recordings of common memory, it is counts (decision).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, listed, section
from automax_ros.core.numbers import REAL_LIMIT, round_count
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node, Sequence
from automax_ros.rackfile.reading.names import VariableName
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
        """Return what counts mean; beyond the two points the line goes on (decision: nothing true is hidden)."""
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


def scale_of(node: Node, declared: VariableName, span: Span, findings: ProblemList) -> Scale | None:
    """Read ``{counts: [a, b], value: [x, y]}``; None where there was something to report."""
    what = f"scale of {declared.name}"
    entries = entries_of(node, what, findings)
    if entries is None:
        return None
    if declared.dimensions or not declared.type.is_integer:
        kind = "an array" if declared.dimensions else declared.type.word
        hint = "only a simple INTEGER or DOUBLE INTEGER has counts"
        findings.add(_CODE, f"{declared.name} cannot have a scale: it is {kind}", span, hint)
        return None
    section = Section(entries, what, _KEYS, findings)
    if not section.require(_KEYS, what, span, findings):
        return None
    counts = _counts(section, what, declared.type, findings)
    value = _values(section, what, findings)
    return Scale(counts, value) if counts is not None and value is not None else None


def _counts(section: Section, what: str, kind: DataType, findings: ProblemList) -> tuple[int, int] | None:
    low, high = (int(limit) for limit in kind.range)
    items = _pair(section, "counts", what, findings)
    numbers = [integer_value(item, f"counts of the {what}", findings, low=low, high=high, code=_CODE) for item in items]
    return _different(section, "counts", what, numbers, findings)


def _values(section: Section, what: str, findings: ProblemList) -> tuple[float, float] | None:
    items = _pair(section, "value", what, findings)
    limit = {"low": -REAL_LIMIT, "high": REAL_LIMIT}
    numbers = [number_value(item, f"value of the {what}", findings, **limit, code=_CODE) for item in items]
    found = _different(section, "value", what, numbers, findings)
    if found is not None and not math.isfinite(1.0 / (found[1] - found[0])):
        _report_equal(section, "value", what, findings)
        return None
    return found


def _pair(section: Section, key: str, what: str, findings: ProblemList) -> tuple[Node, ...]:
    """Return the two items of a list, () (reported) where there is something else."""
    node = section.get(key)
    assert node is not None
    if not isinstance(node, Sequence) or len(node.items) != 2:
        wrong_kind(node, f"{key} of the {what}", "a list of two numbers", findings)
        return ()
    return node.items


def _different(
    section: Section, key: str, what: str, numbers: list[_N | None], findings: ProblemList
) -> tuple[_N, _N] | None:
    given = [number for number in numbers if number is not None]
    if len(given) != 2:
        return None
    if given[0] == given[1]:
        _report_equal(section, key, what, findings)
        return None
    return given[0], given[1]


def _report_equal(section: Section, key: str, what: str, findings: ProblemList) -> None:
    message = f"the two numbers of {key} of the {what} are equal"
    findings.add(_CODE, message, section.key_span(key), "write those of two different points")
