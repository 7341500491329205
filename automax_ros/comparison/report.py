"""A comparison as text, as tables for a page, and as data for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from automax_ros.comparison.comparison import Compared, Comparison, Responses, Side, summary
from automax_ros.comparison.differences import Apart
from automax_ros.comparison.measures import Response
from automax_ros.core.text import printable, table
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType

DIFFERENCES = ("variable", "unit", "greatest", "at, s", "before", "after", "first, s", "before", "after", "for, s")
RESPONSES = ("variable", "to", "run", "step at, s", "rise, s", "overshoot, %", "settling, s", "error integral")
_MOST_LISTED = 12
"""Most names in one line of the text (decision); the data have all."""
_NOTHING = "-"


def report_text(found: Comparison) -> str:
    """Return the comparison as lines of text."""
    lines = [*table(run_rows(found)), "", f"{summary(found)} from {found.start_s:.6g} to {found.end_s:.6g} s"]
    lines += [printable(text) for text in remarks(found, _MOST_LISTED)]
    rows = difference_rows(found)
    if rows:
        lines += ["", *table([DIFFERENCES, *rows], right=range(2, len(DIFFERENCES)))]
    rows = response_rows(found)
    if rows:
        lines += ["", *table([RESPONSES, *rows], right=range(3, len(RESPONSES)))]
    return "\n".join(lines) + "\n"


def run_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Return a row for each recording: its role, its name, its rack, its part of the common axis."""
    return [
        (role, printable(str(side.bag)), printable(side.rack), f"{side.start_s:.6g} to {side.end_s:.6g} s")
        for role, side in (("before", found.before), ("after", found.after))
    ]


def remarks(found: Comparison, most: int | None = None) -> Iterator[str]:
    """Yield what is to be known besides: the axis of time, names of one recording alone, what is odd.

    Of names at most ``most`` are listed.
    """
    alignment = found.alignment
    if alignment.event:
        zeros = [seconds_text(time_ns) for time_ns in (alignment.before_ns, alignment.after_ns)]
        yield f"time 0 is {alignment.event}: {zeros[0]} s of the run before, {zeros[1]} s of the run after"
    if alignment.shift_ns:
        direction = "later" if alignment.shift_ns > 0 else "earlier"
        yield f"the run after is placed {seconds_text(abs(alignment.shift_ns))} s {direction}"
    for which, names in (("before", found.only_before), ("after", found.only_after)):
        if names:
            listed = ", ".join(names[:most]) + (", ..." if most is not None and len(names) > most else "")
            yield f"only in the recording {which}: {listed}"
    yield from found.notes
    for item in found.variables:
        if item.note:
            yield f"{item.name}: {item.note}"


def difference_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Return a row for each variable that differs, the first to differ first."""
    return [
        (
            item.name,
            item.unit,
            _signed(item, worst.difference),
            f"{worst.time_s:.6g}",
            *_pair(item, worst),
            f"{first.time_s:.6g}",
            *_pair(item, first),
            f"{item.difference.apart_s:.6g}",
        )
        for item in found.differing
        if item.difference is not None
        and (worst := item.difference.greatest) is not None
        and (first := item.difference.first) is not None
    ]


def response_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Return three rows for each variable with responses: before, after, and the change."""
    rows: list[tuple[str, ...]] = []
    for item in [*found.differing, *(item for item in found.variables if not item.differs)]:
        if (responses := item.responses) is None:
            continue
        for name, run, step_s, measures in (
            (item.name, "before", f"{responses.before.step_s:.6g}", responses.before.measures),
            ("", "after", f"{responses.after.step_s:.6g}", responses.after.measures),
            ("", "change", "", responses.change),
        ):
            form = "+.4g" if run == "change" else ".4g"
            to = (responses.reference or "its end") if name else ""
            rows.append((name, to, run, step_s, *(_measure(value, form) for value in asdict(measures).values())))
    return rows


def as_data(found: Comparison) -> dict[str, Any]:
    """Return the comparison as data for JSON; what is not there, or not a number, is null."""
    alignment = found.alignment
    return {
        "equal": found.equal,
        "before": _side(found.before),
        "after": _side(found.after),
        "aligned": {
            "event": alignment.event or None,
            "before_s": alignment.before_ns / 1e9,
            "after_s": alignment.after_ns / 1e9,
            "shift_s": alignment.shift_ns / 1e9,
        },
        "start_s": found.start_s,
        "end_s": found.end_s,
        "tolerance": found.tolerance,
        "only_before": list(found.only_before),
        "only_after": list(found.only_after),
        "notes": list(found.notes),
        "variables": [_variable(item) for item in found.variables],
    }


def _side(side: Side) -> dict[str, Any]:
    return {"recording": str(side.bag), "rack": side.rack, "start_s": side.start_s, "end_s": side.end_s}


def _variable(item: Compared) -> dict[str, Any]:
    found = item.difference
    return {
        "name": item.name,
        "type": item.before.variable.kind.word,
        "unit": item.unit,
        "scaled": item.is_scaled,
        "differs": item.differs,
        "greatest": None if found is None or found.greatest is None else _apart(found.greatest),
        "first": None if found is None or found.first is None else _apart(found.first),
        "differs_for_s": None if found is None else found.apart_s,
        "responses": None if item.responses is None else _responses(item.responses),
        "note": item.note,
    }


def _apart(apart: Apart) -> dict[str, float | None]:
    return {
        "time_s": apart.time_s,
        "before": _finite(apart.before),
        "after": _finite(apart.after),
        "difference": _finite(apart.difference),
    }


def _responses(responses: Responses) -> dict[str, Any]:
    return {
        "reference": responses.reference or None,
        "before": _response(responses.before),
        "after": _response(responses.after),
        "change": asdict(responses.change),
    }


def _response(found: Response) -> dict[str, Any]:
    return {
        "step_s": found.step_s,
        "start": _finite(found.start),
        "target": _finite(found.target),
        **asdict(found.measures),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _pair(item: Compared, apart: Apart) -> Sequence[str]:
    return [_value(item, value) for value in (apart.before, apart.after)]


def _value(item: Compared, value: float) -> str:
    kind = item.before.variable.kind
    if kind is DataType.BOOLEAN and value in (0.0, 1.0):
        return "TRUE" if value else "FALSE"
    return f"{value:.0f}" if _is_whole(item) and isfinite(value) else f"{value:.6g}"


def _signed(item: Compared, value: float) -> str:
    kind = item.before.variable.kind
    if kind is DataType.BOOLEAN:
        return ""
    return f"{value:+.0f}" if _is_whole(item) and isfinite(value) else f"{value:+.6g}"


def _is_whole(item: Compared) -> bool:
    return item.before.variable.kind.is_integer and not item.is_scaled


def _measure(value: float | None, form: str) -> str:
    return _NOTHING if value is None else f"{value:{form}}"
