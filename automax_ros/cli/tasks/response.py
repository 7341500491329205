"""Step response and Bode diagram of one dynamic block of a task (.BLK) as it runs, rounding to counts included.

The block's own step is driven from rest: by a step, and by sines over whole periods, of which OUTPUT's share at that
frequency is the measured gain. Next to it stand its discrete design without rounding and the Laplace function. Without
--output tables are printed. A point that rounding leaves uncertain by 0.5 dB or more, or where the block ran into a
limit, is marked "~" (hollow in the picture). A PID is driven in ERROR, at its LOOP_TIME.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from automax_ros.cli.options.task import add_call_arguments, add_target_arguments, chosen_calls
from automax_ros.cli.options.values import number, whole_number
from automax_ros.cli.output.files import opened_for_writing, require_different_files
from automax_ros.cli.tasks.tune_info import checked_program
from automax_ros.cli.tasks.tune_info_text import frequency_text
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.text import table
from automax_ros.core.user_error import UsageError
from automax_ros.tuning.driven import STANDING
from automax_ros.tuning.dynamic_calls import DynamicCall, require_running, tuning_of
from automax_ros.tuning.frequency import decibels
from automax_ros.tuning.response import BlockResponse, FrequencyPoint, FrequencyRange, measured_response
from automax_ros.tuning.step_response import MOST_SCANS, SETTLED, default_scans
from automax_ros.tuning.transfer_text import fixed, number_text
from automax_ros.tuning.tuning import Tuning

_PICTURES = (".png", ".svg", ".pdf")
_POINTS, _POINTS_DRAWN, _MOST_POINTS = 12, 30, 500
_LOWEST_SHARE, _HIGHEST_SHARE = 1.0 / 30.0, 0.95
"""The frequency range without --from and --to: from a share of the lowest corner to a share of Nyquist."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax response``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a task (.BLK)")
    add_target_arguments(parser)
    add_call_arguments(parser, required=True)
    parser.add_argument("--output", type=Path, metavar="PLOT.png", help="draw a picture (.png, .svg, .pdf)")
    parser.add_argument("--step", type=whole_number, metavar="COUNTS", help="size of the step (default: up to 4095)")
    parser.add_argument(
        "--amplitude",
        type=whole_number,
        metavar="COUNTS",
        help="of the sines (default: up to 4095, within the block's limits)",
    )
    parser.add_argument("--from", type=number, dest="low", metavar="RAD_S", help="lowest frequency")
    parser.add_argument("--to", type=number, dest="high", metavar="RAD_S", help="highest frequency, below Nyquist")
    parser.add_argument(
        "--points",
        type=whole_number,
        metavar="N",
        help=f"frequencies, corners extra (default: {_POINTS}, {_POINTS_DRAWN} drawn)",
    )
    parser.add_argument("--duration", type=number, metavar="S", help="length of the step response")
    parser.add_argument("--csv", type=Path, metavar="OUT.csv", help="write both responses to a table")
    parser.add_argument("--json", action="store_true", help="print all as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Measure the block and show its responses; 1 if the task has errors."""
    _check(arguments)
    program = checked_program(arguments)
    if program is None:
        return 1
    require_different_files({"FILE": arguments.file}, {"--output": arguments.output, "--csv": arguments.csv})
    (call,) = chosen_calls(program, arguments, driven=True)
    tuning = tuning_of(call, program)
    _require_known(call, tuning)
    if arguments.output is not None:
        from automax_ros.cli.output.figure import require_matplotlib

        require_matplotlib("--output")
    parameters, assumed = call.standing_inputs()
    require_running(call)
    response = measured_response(
        path=arguments.file,
        call=call,
        tuning=tuning,
        period_ns=program.period_ns,
        parameters=parameters,
        frequencies=_range(arguments, tuning),
        amplitude=arguments.amplitude,
        step=arguments.step,
        scans=_scans(arguments, tuning),
        assumed=assumed,
    )
    if arguments.output is not None:
        from automax_ros.cli.tasks.response_plot import plot

        plot(response, arguments.output)
    if arguments.csv is not None:
        with opened_for_writing(arguments.csv) as stream:
            write_table(response, stream)
    _show(arguments, response)
    return 0


def _show(arguments: argparse.Namespace, response: BlockResponse) -> None:
    if arguments.json:
        print(json.dumps(record(response), indent=2, allow_nan=False))
    elif arguments.output is None and arguments.csv is None:
        sys.stdout.write(report(response))
    else:
        sys.stdout.write(notes(response))


def _require_known(call: DynamicCall, tuning: Tuning) -> None:
    if call.dynamics.not_measured:
        raise UsageError(f"{call.title}: {call.dynamics.not_measured}", "`automax tune-info` shows its time constant")
    if tuning.missing:
        names = [call.parameters[name].variable for name in tuning.missing]
        what = " and ".join(f"{name} = {call.parameters[name].variable}" for name in tuning.missing)
        hint = "give " + " ".join(f"--set {name}=VALUE" for name in names)
        raise UsageError(f"{call.title}: the value of {what} is not known", hint)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse wrong options that can be recognized without the task."""
    if arguments.amplitude is not None and not 1 <= arguments.amplitude <= INT16_MAX:
        raise UsageError(f"--amplitude {arguments.amplitude}: it must be 1 to {INT16_MAX} counts")
    if arguments.step is not None and not 1 <= abs(arguments.step) <= INT16_MAX:
        raise UsageError(f"--step {arguments.step}: it must be 1 to {INT16_MAX} counts, or as many below 0")
    if arguments.points is not None and not 2 <= arguments.points <= _MOST_POINTS:
        raise UsageError(f"--points {arguments.points}: it must be 2 to {_MOST_POINTS}")
    for name, value in (("--from", arguments.low), ("--to", arguments.high), ("--duration", arguments.duration)):
        if value is not None and value <= 0.0:
            raise UsageError(f"{name} {value:g}: it must be a number above 0")
    if arguments.low is not None and arguments.high is not None and arguments.low >= arguments.high:
        raise UsageError(f"--from {arguments.low:g} must be below --to {arguments.high:g}")
    if arguments.output is not None and arguments.output.suffix.lower() not in _PICTURES:
        raise UsageError(f"--output {arguments.output}: a picture ends in {', '.join(_PICTURES)}")


def _range(arguments: argparse.Namespace, tuning: Tuning) -> FrequencyRange:
    """Return the range of frequencies to measure at."""
    nyquist = tuning.nyquist_rad_s
    for name, value in (("--from", arguments.low), ("--to", arguments.high)):
        if value is not None and value >= nyquist:
            raise UsageError(f"{name} {value:g}: it must be below the Nyquist frequency, {nyquist:.6g} rad/s")
    corners = [corner.rad_s for corner in tuning.corners if corner.discrete is not None]
    high = arguments.high or _HIGHEST_SHARE * nyquist
    low = arguments.low or min(_LOWEST_SHARE * min(corners, default=nyquist), high / 10.0)
    if low >= high:
        raise UsageError(f"--from {low:g}: without --to the highest frequency is {high:.6g} rad/s")
    points = arguments.points or (_POINTS if arguments.output is None else _POINTS_DRAWN)
    return FrequencyRange(low, high, points)


def _scans(arguments: argparse.Namespace, tuning: Tuning) -> int:
    assert tuning.transfer is not None
    if arguments.duration is None:
        return default_scans(tuning.transfer)
    scans = float(arguments.duration) / tuning.period_s
    if not 1.0 - 1e-9 <= scans <= MOST_SCANS:
        bounds = f"{tuning.period_s:g} to {MOST_SCANS * tuning.period_s:g} s"
        raise UsageError(f"--duration {arguments.duration:g}: it must be {bounds}, 1 to {MOST_SCANS} executions")
    return round(scans) + 1


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
        end = f"at the end it moves {number_text(step.rate, 5)} counts/s"
    else:
        time = step.settling_s
        settled = "does not settle in this time" if time is None else f"settles in {number_text(time, 4)} s"
        end = f"{settled} within {SETTLED * 100.0:g} % ({step.band:.0f} counts) of {number_text(step.final, 5)}"
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
    return _step_summary(response) + _align(rows)


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
                number_text(point.rad_s, 5),
                number_text(point.hz, 4),
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
    table = _align(rows, left=(5, 10))
    head, _, body = table.partition("\n")
    places = [head.index("dB", 0)]
    while len(places) < 3:
        places.append(head.index("dB", places[-1] + 1))
    above = ""
    for place, title in zip(places, ("measured", "discrete", "Laplace"), strict=True):
        above = above.ljust(place - 3) + title
    return f"Bode diagram; counts: the amplitude of the sine\n{above}\n{head}\n{body}{_legend(response)}"


def _doubt(point: FrequencyPoint) -> str:
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
        smaller = any(item.amplitude > 1 and item.touched and STANDING not in item.touched for item in found)
        advice = "; a smaller --amplitude may avoid it" if smaller else ""  # it cannot avoid a MAX_CHANGE of 0
        lines.append(f"~ limit: the block runs into {' and '.join(touched)}{advice}")
    missed = sum(point.measured is None for point in response.points)
    if missed:
        lines.append(f"- not measured ({missed}): so slow that it would take millions of scans")
    return "".join(f"{line}\n" for line in lines)


def _level(gain: complex) -> str:
    level = decibels(gain)
    return "none" if level is None or level < -200.0 else fixed(level, 2)


def _angle(gain: complex, degrees: float) -> str:
    level = decibels(gain)
    return _NOTHING if level is None or level < -200.0 else fixed(degrees, 1)


def _align(rows: Sequence[tuple[str, ...]], left: Sequence[int] = ()) -> str:
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


def _bode_record(point: FrequencyPoint) -> dict[str, object]:
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
