"""Step response and Bode diagram of one dynamic block of a task (.BLK) as it runs, rounding to counts included.

The block's own step is driven from rest: by a step, and by sines over whole periods, of which OUTPUT's share at that
frequency is the measured gain. Next to it stand its discrete design without rounding and the Laplace function. Without
--output tables are printed. A point that rounding leaves uncertain by 0.5 dB or more, or where the block ran into a
limit, is marked "~" (hollow in the picture). A PID is driven in ERROR, at its LOOP_TIME.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from automax_ros.cli.options.task import add_call_arguments, add_target_arguments, chosen_calls
from automax_ros.cli.options.values import number, whole_number
from automax_ros.cli.output.files import opened_for_writing, require_different_files
from automax_ros.cli.tasks.tune_info import checked_program
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.user_error import UsageError
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, require_running, tuning_of
from automax_ros.tuning.response import BlockResponse, Range, measured_response
from automax_ros.tuning.step_response import MOST_SCANS, default_scans
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
    response = _measured(arguments, program, call, tuning)
    if arguments.output is not None:
        from automax_ros.cli.tasks.response_plot import plot

        plot(response, arguments.output)
    if arguments.csv is not None:
        from automax_ros.cli.tasks.response_text import write_table

        with opened_for_writing(arguments.csv) as stream:
            write_table(response, stream)
    _show(arguments, response)
    return 0


def _show(arguments: argparse.Namespace, response: BlockResponse) -> None:
    from automax_ros.cli.tasks.response_text import notes, record, report

    if arguments.json:
        print(json.dumps(record(response), indent=2, allow_nan=False))
    elif arguments.output is None and arguments.csv is None:
        sys.stdout.write(report(response))
    else:
        sys.stdout.write(notes(response))


def _measured(arguments: argparse.Namespace, program: Program, call: DynamicCall, tuning: Tuning) -> BlockResponse:
    parameters, assumed = call.standing_inputs()
    require_running(call)
    return measured_response(
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


def _range(arguments: argparse.Namespace, tuning: Tuning) -> Range:
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
    return Range(low, high, points)


def _scans(arguments: argparse.Namespace, tuning: Tuning) -> int:
    assert tuning.transfer is not None
    if arguments.duration is None:
        return default_scans(tuning.transfer)
    scans = float(arguments.duration) / tuning.period_s
    if not 1.0 - 1e-9 <= scans <= MOST_SCANS:
        bounds = f"{tuning.period_s:g} to {MOST_SCANS * tuning.period_s:g} s"
        raise UsageError(f"--duration {arguments.duration:g}: it must be {bounds}, 1 to {MOST_SCANS} executions")
    return round(scans) + 1
