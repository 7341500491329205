"""Times as options, in seconds: ``--from`` and ``--to`` for a part of a recorded run, ``--every`` for a grid on it."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from automax_ros.cli.usage import UsageError
from automax_ros.core.ticks import seconds_ns

if TYPE_CHECKING:
    from automax_ros.bags.series import Window


def add_window_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--from`` and ``--to``."""
    parser.add_argument(
        "--from", dest="start", type=seconds, metavar="S", help="begin S seconds from the start of the run"
    )
    parser.add_argument("--to", dest="end", type=seconds, metavar="S", help="end S seconds from the start of the run")


def add_grid_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--every``."""
    parser.add_argument(
        "--every", type=seconds_above_0, metavar="S", help="a row every S seconds with the values that hold then"
    )


def window_of(arguments: argparse.Namespace) -> Window:
    """Return the window that the options ask for.

    Raises:
        UsageError: it ends before it begins.
    """
    from automax_ros.bags.series import Window

    start = arguments.start or 0
    if arguments.end is not None and arguments.end < start:
        raise UsageError("--to lies before --from")
    return Window(start, arguments.end, getattr(arguments, "every", None) or 0)


def seconds(text: str) -> int:
    """Return a time in seconds, 0 or more, in nanoseconds, rounded to the nearest: the type of an option."""
    try:
        return seconds_ns(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def seconds_above_0(text: str) -> int:
    """Return a time in seconds that is not 0, in nanoseconds: the type of an option."""
    found = seconds(text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text} s is too short: give more")
    return found
