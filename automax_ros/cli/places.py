"""Where work is done that can be cut into pieces: ``--jobs`` and ``--scheduler``, alike for all commands."""

from __future__ import annotations

import argparse

from automax_ros.cli.numbers import whole_number
from automax_ros.cli.usage import UsageError
from automax_ros.pieces import Where

_AUTO = "auto"
MOST_JOBS = 1024
"""Most processes that are begun side by side (decision: a slip of the finger shall not bring a machine down)."""


def add_where_arguments(parser: argparse.ArgumentParser, what: str) -> None:
    """Add ``--jobs`` and ``--scheduler``; ``what`` is done side by side."""
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


def where_of(arguments: argparse.Namespace) -> Where:
    """Return where pieces are done.

    Raises:
        UsageError: on the cores of this machine and by a cluster, both.
    """
    jobs, scheduler = arguments.jobs, arguments.scheduler
    if scheduler is None:
        return Where(None if jobs == _AUTO else jobs)
    if not scheduler.strip():
        raise UsageError("--scheduler needs an address", "for example --scheduler tcp://10.0.0.1:8786")
    if jobs != _AUTO:
        raise UsageError("--jobs and --scheduler exclude each other", "a cluster has as many jobs as its workers")
    return Where(scheduler=scheduler.strip())


def _jobs(text: str) -> int | str:
    if text.strip().lower() == _AUTO:
        return _AUTO
    found = whole_number(text)
    if not 1 <= found <= MOST_JOBS:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to {MOST_JOBS}, or {_AUTO}")
    return found
