"""The options ``--from``, ``--to`` and ``--every``: a part of a recorded run, and a grid on it."""

from __future__ import annotations

import argparse
from decimal import Decimal, InvalidOperation

from automax_ros.bags.series import Window
from automax_ros.cli.usage import UsageError
from automax_ros.core.ticks import NS_PER_S

_MOST_S = 10**10
"""Longest time in seconds: over 300 years."""


def add_window_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--from`` and ``--to``."""
    parser.add_argument(
        "--from", dest="start", type=_seconds, metavar="S", help="begin S seconds from the start of the run"
    )
    parser.add_argument("--to", dest="end", type=_seconds, metavar="S", help="end S seconds from the start of the run")


def add_grid_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--every``."""
    parser.add_argument(
        "--every", type=_seconds, metavar="S", help="a row every S seconds with the values that hold then"
    )


def window_of(arguments: argparse.Namespace) -> Window:
    """Return the window that the options ask for.

    Raises:
        UsageError: it is empty, or the grid has no step.
    """
    start = arguments.start or 0
    if arguments.end is not None and arguments.end < start:
        raise UsageError("--to lies before --from")
    step = getattr(arguments, "every", None)
    if step == 0:
        raise UsageError("--every has to be above 0")
    return Window(start, arguments.end, step or 0)


def _seconds(text: str) -> int:
    """Return a number of seconds, 0 or more, in nanoseconds."""
    try:
        seconds = Decimal(text)
        if not 0 <= seconds <= _MOST_S:
            raise ValueError
        exact = seconds * NS_PER_S
        whole = int(exact.to_integral_value())
    except (ValueError, InvalidOperation, OverflowError):
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a number of seconds from 0 on") from None
    if whole != exact:
        raise argparse.ArgumentTypeError(f"{text[:40]} s is not a whole number of nanoseconds")
    return whole
