"""``--jobs`` and ``--scheduler``: where work is done; ``--native`` and ``--verbose``: scans as machine code."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable

from automax_ros.cli.options.values import whole_number
from automax_ros.compile.native.run.compiler_process import LIMIT_S
from automax_ros.compile.native.run.forms import NativeForms, NativeMode, NativeOutcome
from automax_ros.core.user_error import UsageError
from automax_ros.parallel.job import Workers

_AUTO = "auto"
MOST_JOBS = 1024
"""Most processes that are started in parallel (decision: a slip of the finger shall not bring a machine down)."""


_LIVE_LIMIT_S = 20.0
"""Longest time that the start of a rack on the wall clock waits for the build of one task, s (decision)."""


def add_where_arguments(parser: argparse.ArgumentParser, what: str) -> None:
    """Add ``--jobs`` and ``--scheduler``; ``what`` is done in parallel."""
    parser.add_argument(
        "--jobs",
        type=_jobs,
        default=_AUTO,
        metavar="N",
        help=f"{what} side by side in this many processes; auto (the default): as many as there are cores",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help=f"{what} by the workers of this Dask cluster, such as tcp://10.0.0.1:8786",
    )


def where_of(arguments: argparse.Namespace) -> Workers:
    """Return the workers that the options choose.

    Raises:
        UsageError: both options are given, or an address is empty.
    """
    jobs, scheduler = arguments.jobs, arguments.scheduler
    if scheduler is None:
        return Workers(None if jobs == _AUTO else jobs)
    if not scheduler.strip():
        raise UsageError("--scheduler needs an address", "for example --scheduler tcp://10.0.0.1:8786")
    if jobs != _AUTO:
        raise UsageError("--jobs and --scheduler exclude each other", "a cluster has as many jobs as its workers")
    return Workers(scheduler=scheduler.strip())


def _jobs(text: str) -> int | str:
    if text.strip().lower() == _AUTO:
        return _AUTO
    found = whole_number(text)
    if not 1 <= found <= MOST_JOBS:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to {MOST_JOBS}, or {_AUTO}")
    return found


def add_native_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--native`` and ``--verbose``."""
    parser.add_argument(
        "--native",
        choices=[mode.value for mode in NativeMode],
        default=NativeMode.AUTO.value,
        help="scans as machine code, with the same results: where it pays (auto), wherever it can be (on), or never "
        "(default: auto; docs/speed.md)",
    )
    parser.add_argument(
        "--verbose", action="store_true", help="say on standard error which tasks are native, and why others are not"
    )


def native_forms(arguments: argparse.Namespace, expected_ns: int | None, *, wall_clock: bool = False) -> NativeForms:
    """Return the native forms that the options choose; ``expected_ns`` is the task time of the run, None if endless.

    On the wall clock scans gain nothing by it, for they wait for their deadlines: only ``on`` makes them native there.
    Tasks are built before the rack is put into RUN, those of a reload while the old ones scan (decision).
    """
    mode = NativeMode(arguments.native)
    forms = NativeForms(mode, expected_ns, limit_s=_LIVE_LIMIT_S if wall_clock else LIMIT_S)
    if wall_clock and mode is NativeMode.AUTO:
        return forms.off("on the wall clock scans gain nothing by it (--native on)")
    return forms


def print_native(outcomes: Iterable[NativeOutcome]) -> None:
    """Print the outcome for each task on standard error."""
    for outcome in outcomes:
        print(outcome.text, file=sys.stderr)
