"""The responses of a block as text tables, as CSV and as JSON."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from typing import TextIO

from automax_ros.cli.tasks.tune_info_text import frequency_text
from automax_ros.core.text import table
from automax_ros.tuning.driven import STANDING
from automax_ros.tuning.frequency import Measured, decibels
from automax_ros.tuning.response import BlockResponse, Point
from automax_ros.tuning.step_response import SETTLED
from automax_ros.tuning.transfer_text import fixed, number

COLUMNS = (
    "response", "t_s", "rad_s", "hz", "mark", "amplitude", "measured", "discrete", "laplace",
    "measured_deg", "discrete_deg", "laplace_deg", "uncertainty_db", "uncertainty_deg", "reliable",
)  # fmt: skip
_ROWS = 14
_MOST_ROWS = 1000
_NOTHING = "-"


def report(response: BlockResponse) -> str:
    """Return both responses as tables."""
    return "\n".join([_heading(response), _step(response), _bode(response)])


def notes(response: BlockResponse) -> str:
    """Return the text to print with a picture: heading, summary of the step, legend."""
    return _heading(response) + _step_summary(response) + _legend(response)


def _heading(response: BlockResponse) -> str:
    tuning = response.tuning
    lines = [f"{response.path} {response.call.title}: {tuning.laplace}"]
    lines.append(f"  {tuning.period_text}, Nyquist {frequency_text(tuning.nyquist_rad_s)}")
    lines += [f"  {remark}" for remark in response.remarks]
    return "\n".join(lines) + "\n"


def _step_summary(response: BlockResponse) -> str:
    step = response.step
    if step.final is None:
        end = f"at the end it moves {number(step.rate, 5)} counts/s"
    else:
        time = step.settling_s
        settled = "does not settle in this time" if time is None else f"settles in {number(time, 4)} s"
        end = f"{settled} within {SETTLED * 100.0:g} % ({step.band:.0f} counts) of {number(step.final, 5)}"
        if step.overshoot is not None:
            end += f", overshoot {step.overshoot * 100.0:.1f} %"
    lines = [f"Step of {step.counts} counts: {end}"]
    lines += [f"  ! it runs into {what}" for what in step.touched]
    return "\n".join(lines) + "\n"


def _step(response: BlockResponse) -> str:
    step = response.step
    rows = [("t, s", "OUTPUT", "discrete", "Laplace")]
    places = step_places(len(step.output), _ROWS)
    ideal = response.laplace_at([place * step.period_s for place in places])
    for place, laplace in zip(places, ideal, strict=True):
        time = f"{place * step.period_s:.6g}"
        rows.append((time, str(step.output[place]), fixed(step.design[place], 1), fixed(laplace, 1)))
    return _step_summary(response) + _aligned(rows)


def step_places(scans: int, rows: int) -> list[int]:
    """Return the scans of a response to show: all of a short one, else denser at the beginning."""
    if scans <= rows:
        return list(range(scans))
    return sorted({round((scans - 1) * (row / (rows - 1)) ** 2) for row in range(rows)})


def _bode(response: BlockResponse) -> str:
    rows = [("rad/s", "Hz", "counts", "dB", "deg", "", "dB", "deg", "dB", "deg", "")]
    for point in response.points:
        found = point.measured
        counts = _NOTHING if found is None else str(found.amplitude)
        rows.append(
            (
                number(point.rad_s, 5),
                number(point.hz, 4),
                counts,
                _NOTHING if found is None else _level(found.gain),
                _NOTHING if point.measured_deg is None else fixed(point.measured_deg, 1),
                _doubt(point),
                _level(point.design),
                _angle(point.design, point.design_deg),
                _level(point.laplace),
                _angle(point.laplace, point.laplace_deg),
                f"  {point.mark}" if point.mark else "",
            )
        )
    table = _aligned(rows, left=(5, 10))
    head, _, body = table.partition("\n")
    places = [head.index("dB", 0)]
    while len(places) < 3:
        places.append(head.index("dB", places[-1] + 1))
    above = ""
    for place, title in zip(places, ("measured", "discrete", "Laplace"), strict=True):
        above = above.ljust(place - 3) + title
    return f"Bode diagram; counts: the amplitude of the sine\n{above}\n{head}\n{body}{_legend(response)}"


def _doubt(point: Point) -> str:
    found = point.measured
    if found is None or found.reliable:
        return ""
    if found.touched:
        return "~ limit"
    return "~" if found.uncertainty_db > 20.0 else f"~ +-{found.uncertainty_db:.1f} dB"


def _legend(response: BlockResponse) -> str:
    found = [point.measured for point in response.points if point.measured is not None]
    lines = []
    if any(not item.reliable and not item.touched for item in found):
        lines.append("~ few counts come out: rounding to whole counts leaves 0.5 dB or more uncertain")
    touched = sorted({what for item in found for what in item.touched})
    if touched:
        advice = "; a smaller --amplitude may avoid it" if _may_be_smaller(found) else ""
        lines.append(f"~ limit: the block runs into {' and '.join(touched)}{advice}")
    missed = sum(point.measured is None for point in response.points)
    if missed:
        lines.append(f"- not measured ({missed}): so slow that it would take millions of scans")
    return "".join(f"{line}\n" for line in lines)


def _may_be_smaller(found: Sequence[Measured]) -> bool:
    """Return whether a smaller sine could avoid the limits that were reached; it cannot avoid a MAX_CHANGE of 0."""
    return any(item.amplitude > 1 and item.touched and STANDING not in item.touched for item in found)


def _level(gain: complex) -> str:
    level = decibels(gain)
    return "none" if level is None or level < -200.0 else fixed(level, 2)


def _angle(gain: complex, degrees: float) -> str:
    level = decibels(gain)
    return _NOTHING if level is None or level < -200.0 else fixed(degrees, 1)


def _aligned(rows: Sequence[tuple[str, ...]], left: Sequence[int] = ()) -> str:
    right = set(range(len(rows[0]))).difference(left)
    return "".join(f"  {line}\n" for line in table(rows, right))


def write_table(response: BlockResponse, stream: TextIO) -> None:
    """Write both responses as one CSV table: gains in dB, phases in degrees, steps in counts."""
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(COLUMNS)
    for row in [*_step_records(response), *_bode_records(response)]:
        table.writerow([_cell(row.get(name)) for name in COLUMNS])


def record(response: BlockResponse) -> dict[str, object]:
    """Return both responses for ``--json``."""
    step, tuning = response.step, response.tuning
    return {
        "file": str(response.path),
        "line": response.call.label,
        "block": tuning.block.name,
        "output": response.call.output,
        "period_s": tuning.period_s,
        "nyquist_rad_s": tuning.nyquist_rad_s,
        "laplace": tuning.laplace,
        "remarks": list(response.remarks),
        "marks": [{"name": name, "rad_s": rad_s} for name, rad_s in response.marks],
        "step": {
            "counts": step.counts,
            "final": step.final,
            "overshoot": step.overshoot,
            "settling_s": step.settling_s,
            "settling_band_counts": step.band,
            "rate_counts_per_s": step.rate if step.final is None else None,
            "touched": list(step.touched),
            "samples": [_without(item, "response") for item in _step_records(response)],
        },
        "bode": [_without(item, "response") for item in _bode_records(response)],
    }


def _without(item: dict[str, object], key: str) -> dict[str, object]:
    return {name: value for name, value in item.items() if name != key}


def _step_records(response: BlockResponse) -> list[dict[str, object]]:
    """Return the samples of the step response: every scan, or at most as many as a table has rows."""
    step = response.step
    every = -(-len(step.output) // _MOST_ROWS)
    places = range(0, len(step.output), every)
    ideal = response.laplace_at([place * step.period_s for place in places])
    return [
        {
            "response": "step",
            "t_s": place * step.period_s,
            "measured": step.output[place],
            "discrete": step.design[place],
            "laplace": laplace,
        }
        for place, laplace in zip(places, ideal, strict=True)
    ]


def _bode_records(response: BlockResponse) -> list[dict[str, object]]:
    return [_bode_record(point) for point in response.points]


def _bode_record(point: Point) -> dict[str, object]:
    found = point.measured
    doubt = None if found is None or not math.isfinite(found.uncertainty_db) else found.uncertainty_db
    return {
        "response": "bode",
        "rad_s": point.rad_s,
        "hz": point.hz,
        "mark": point.mark or None,
        "amplitude": None if found is None else found.amplitude,
        "measured": None if found is None else decibels(found.gain),
        "discrete": decibels(point.design),
        "laplace": decibels(point.laplace),
        "measured_deg": point.measured_deg,
        "discrete_deg": point.design_deg,
        "laplace_deg": point.laplace_deg,
        "uncertainty_db": doubt,
        "uncertainty_deg": None if found is None else found.uncertainty_deg,
        "reliable": found is not None and found.reliable,
    }


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return f"{value:.9g}" if isinstance(value, float) else str(value)
