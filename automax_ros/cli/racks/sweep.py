"""Run a rack many times in simulated time with other values, and measure each run.

Grid: `--vary SPEED.KP=0.2:2.0:19 --vary REF%=500,1000`; sample: `--vary SPEED.KP=0.2:2.0 --sample 500`. What varies:
tunables TASK.NAME, commons before RUN, numbers of plants PLANT.load.torque_nm. Exit code 1: a run was stopped by a
fault, or the rack has errors.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from automax_ros.cli.options.rack import add_outside_argument, config_of, print_refused
from automax_ros.cli.options.stimuli import StimuliRefused, stimulation
from automax_ros.cli.options.values import add_output_argument, seconds_above_0, whole_number
from automax_ros.cli.options.work import add_native_arguments, add_where_arguments, native_forms, print_native, where_of
from automax_ros.cli.output.screen import ProgressBar
from automax_ros.cli.output.signals import StopRequest, WorkInterrupted, stop_signals
from automax_ros.cli.racks.sweep_output import SweepOutput, Wanted, best_of, prepared, print_best
from automax_ros.cli.run.plan import warn
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.messages.stream.stream import RackStream
from automax_ros.parallel.job import Workers
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.sweep.measures import FUNCTIONS, read_measures
from automax_ros.sweep.points import Point, Varied, grid, read_varied, sample
from automax_ros.sweep.run import Plan, RackTemplate, Row, Stimuli, run_point, run_sweep
from automax_ros.sweep.tables import records

_T = TypeVar("_T")
USUAL_DURATION_NS = 10 * NS_PER_S
"""Duration of a run without ``--duration`` (decision)."""
_FEW = 16
"""Fewer runs than this are done by this process alone unless ``--jobs`` is given (decision: they end as soon)."""


def record_run(plan: Plan, point: Point, folder: Path, should_stop: Callable[[], bool]) -> list[Row]:
    """Run a point, record it into a new folder, and return its row, the same as without recording.

    There is no row if ``should_stop`` has ended the run; the recording up to then is complete.

    Raises:
        BagError: the run cannot be recorded.
    """

    def attend(rack: Rack) -> Callable[[], None]:
        stream = RackStream(rack, rack.fingerprint)
        recorder = Recorder(rack, stream, folder)

        def end() -> None:
            stream.end()
            recorder.close()
            if recorder.failure is not None:
                raise recorder.failure

        stream.begin()
        return end

    outcome = run_point(plan, point, attend, should_stop)
    return [] if should_stop() else [Row(1, point, outcome)]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax sweep``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file")
    parser.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="LOW:HIGH:N, or V1,V2,..., or with --sample LOW:HIGH; may be given again",
    )
    parser.add_argument(
        "--measure",
        action="append",
        default=[],
        metavar="MEASURES",
        help=f"such as 'rms(SPEED_ERR%%) max(I%%, from=1 to=3)'; there are {', '.join(FUNCTIONS)} (docs/sweep.md)",
    )
    parser.add_argument(
        "--best",
        metavar="'min MEASURE'",
        help="what makes a run the best: min or max of a measure (default: min of the first)",
    )
    parser.add_argument("--sample", type=whole_number, metavar="N", help="a Latin hypercube of N runs, not the grid")
    parser.add_argument("--seed", type=whole_number, metavar="N", help="of --sample, 0 or more (default: 1)")
    parser.add_argument(
        "--duration", type=seconds_above_0, default=USUAL_DURATION_NS, metavar="S", help="of a run (default: 10)"
    )
    parser.add_argument(
        "--stimuli", type=Path, metavar="FILE", help="play this stimuli file in each run (docs/stimuli.md)"
    )
    add_output_argument(parser, "FOLDER", "new folder for runs.csv, runs.npz, sweep.json, sweep.png")
    parser.add_argument("--record", type=Path, metavar="DIR", help="record the run, of which there must be only one")
    add_where_arguments(parser, "do the runs")
    parser.add_argument("--json", action="store_true", help="print all runs for programs to read")
    add_native_arguments(parser)
    add_outside_argument(parser)


@dataclass(frozen=True)
class _Sweep:
    plan: Plan
    points: list[Point]
    where: Workers
    wanted: Wanted


def run(arguments: argparse.Namespace) -> int:
    """Run the sweep."""
    with stop_signals() as stop:
        try:
            with stop.cut_short():
                sweep = _sweep(arguments)
            if sweep is None:
                return 1
            return _carry_out(sweep, arguments, stop)
        except WorkInterrupted:
            return stop.code
        except RackError as error:
            return print_refused("sweep", error)
        except StimuliRefused:
            return 1
        except BagError as error:
            print(error, file=sys.stderr)
            return 2


def _sweep(arguments: argparse.Namespace) -> _Sweep | None:
    """Return the sweep that the arguments describe, None where the rack has errors; all values are checked."""
    where = where_of(arguments)
    config = config_of(arguments.config, allow_outside=arguments.allow_outside)
    if config is None:
        return None
    rack = Rack(config)
    warn(rack)
    stimulation(rack, arguments.stimuli, allow_outside=arguments.allow_outside)
    varied = _read_varied(rack, arguments.vary)
    points = _points(varied, arguments)
    measures = _read("--measure", lambda: read_measures(" ".join(arguments.measure), config, arguments.duration))
    best, greatest = best_of(arguments.best, config, measures, arguments.duration)
    if best not in measures:
        measures = (*measures, best)
    stimuli = arguments.stimuli and Stimuli.of(arguments.stimuli, allow_outside=arguments.allow_outside)
    quantities = tuple(item.quantity for item in varied)
    if len(points) < _FEW and where == Workers(None):
        where = Workers(1)
    native = native_forms(arguments, arguments.duration * len(points) // where.processes)
    plan = Plan(RackTemplate.of(rack, native), quantities, measures, arguments.duration, stimuli)
    first = _read("--vary", lambda: plan.template.rack(plan.beginning(points[0]).plants))
    if arguments.verbose:
        print_native(first.operations.installation.native.values())
    wanted = Wanted(arguments, rack.installed, measures.index(best), greatest=greatest)
    return _Sweep(plan, points, where, wanted)


def _carry_out(sweep: _Sweep, arguments: argparse.Namespace, stop: StopRequest) -> int:
    plan, points, wanted = sweep.plan, sweep.points, sweep.wanted
    if arguments.record is not None and len(points) != 1:
        raise UsageError(f"--record: there are {count_of(len(points), 'run')}", "give each --vary one value")
    with prepared(arguments.output):
        if arguments.record is None:
            rows = _rows(sweep, stop)
        else:
            rows = record_run(plan, points[0], arguments.record, lambda: stop.requested)
        output = SweepOutput(plan, wanted, rows, len(points))
        if arguments.output is not None:
            output.write(arguments.output)
    if arguments.json:
        print(json.dumps(records(plan, rows, output.repeat), indent=1, allow_nan=False))
    else:
        print_best(output)
    if len(rows) < len(points):
        print(f"automax sweep: ended after {len(rows)} of {count_of(len(points), 'run')}", file=sys.stderr)
        return stop.code
    return 1 if any(row.outcome.fault for row in rows) else 0


def _rows(sweep: _Sweep, stop: StopRequest) -> list[Row]:
    """Return the rows of all runs that ended before a signal came, in their order."""
    found: dict[int, Row] = {}
    with ProgressBar("sweep", len(sweep.points)) as bar:

        def take(rows: list[Row]) -> None:
            found.update((row.number, row) for row in rows)
            bar.show(len(found))

        try:
            with stop.cut_short():
                run_sweep(sweep.plan, sweep.points, sweep.where, take)
        except WorkInterrupted:
            pass
    return [found[number] for number in sorted(found)]


def _read_varied(rack: Rack, texts: list[str]) -> list[Varied]:
    found: dict[str, Varied] = {}
    for text in texts:
        item = _read("--vary", partial(read_varied, rack, text))
        if item.quantity.label in found:
            raise UsageError(f"--vary: {item.quantity.label} is given twice")
        found[item.quantity.label] = item
    return list(found.values())


def _points(varied: list[Varied], arguments: argparse.Namespace) -> list[Point]:
    """Return the values of each run; without ``--vary`` there is one run of the unchanged rack."""
    if arguments.sample is None:
        if arguments.seed is not None:
            raise UsageError("--seed belongs to --sample")
        return _read("--vary", lambda: grid(varied))
    if not varied:
        raise UsageError("--sample: nothing varies", "give --vary NAME=LOW:HIGH")
    seed = 1 if arguments.seed is None else arguments.seed
    if arguments.sample < 1 or seed < 0:
        raise UsageError("--sample takes 1 or more, --seed 0 or more")
    points = _read("--sample", lambda: sample(varied, arguments.sample, seed))
    if len(points) < arguments.sample:
        count = count_of(arguments.sample - len(points), "run")
        print(f"automax sweep: {count} duplicate points of the sample skipped", file=sys.stderr)
    return points


def _read(option: str, read: Callable[[], _T]) -> _T:
    """Return the value of an option, which ``read`` parses."""
    try:
        return read()
    except UserError as fault:
        raise UsageError(f"{option}: {fault.message}", fault.hint) from fault
