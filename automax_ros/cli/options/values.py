"""Values of options: numbers, times, windows, and the list of variables given with ``--watch``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from automax_ros.core import values
from automax_ros.core.ticks import seconds_ns
from automax_ros.core.user_error import UsageError, UserError

if TYPE_CHECKING:
    from automax_ros.recordings.tables.series import Window


_T = TypeVar("_T", int, float)
_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


_COMMA = re.compile(r",(?![^(\[]*[)\]])")
"""A comma that is not between subscripts."""


def number(text: str) -> float:
    """Return an argument's decimal number, for ``type=``."""
    return _argument(values.number, text)


def whole_number(text: str) -> int:
    """Return an argument's whole number, for ``type=``."""
    return _argument(values.whole_number, text)


def option_number(option: str, text: str, low: float, high: float, what: str = "a number") -> float:
    """Return the number given to an option.

    Raises:
        UsageError: it is not a number from ``low`` to ``high``.
    """
    try:
        found = values.number(text)
    except ValueError as error:
        raise UsageError(f"{option}: {error}", f"give {what} from {low:.10g} to {high:.10g}") from None
    if not low <= found <= high:
        raise UsageError(f"{option}: {text} is not {what} from {low:.10g} to {high:.10g}")
    return found


def each_once(option: str, pairs: Iterable[tuple[_Key, _Value]]) -> dict[_Key, _Value]:
    """Return what an option that may be given again says, as a mapping.

    Raises:
        UsageError: it says two things of one key.
    """
    found: dict[_Key, _Value] = {}
    for key, value in pairs:
        if key in found:
            raise UsageError(f"{option} {key} is given twice", "leave one of them out")
        found[key] = value
    return found


@contextmanager
def naming(option: str) -> Iterator[None]:
    """Name the option in the error of a block that reads its value.

    Raises:
        UsageError: the block raised a UserError or a ValueError.
    """
    try:
        yield
    except UserError as error:
        raise UsageError(f"{option}: {error.message}", error.hint) from error
    except ValueError as error:
        raise UsageError(f"{option}: {error}") from error


def _argument(read: Callable[[str], _T], text: str) -> _T:
    try:
        return read(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_output_argument(
    parser: argparse.ArgumentParser, metavar: str, help_text: str, *, required: bool = False
) -> None:
    """Add ``--output``, for short ``-o``."""
    parser.add_argument("--output", "-o", type=Path, required=required, metavar=metavar, help=help_text)


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
    """Return the window that the options give.

    Raises:
        UsageError: it ends before it begins.
    """
    from automax_ros.recordings.tables.series import Window

    start = arguments.start or 0
    if arguments.end is not None and arguments.end < start:
        raise UsageError("--to lies before --from")
    return Window(start, arguments.end, getattr(arguments, "every", None) or 0)


def seconds(text: str) -> int:
    """Convert a time of 0 s or more to nanoseconds, rounded to the nearest: the type of an option."""
    try:
        return seconds_ns(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def seconds_above_0(text: str) -> int:
    """Convert a time of more than 0 s to nanoseconds: the type of an option."""
    found = seconds(text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text} s is too short: give more")
    return found


def add_watch_argument(parser: argparse.ArgumentParser, default: str) -> None:
    """Add ``--watch``; ``default`` describes what is watched without it."""
    parser.add_argument(
        "--watch",
        action="append",
        metavar="A%,B@",
        help=f"variables for the output, such as REF%%,RUN@,TABLE%%(3) (default: {default})",
    )


def watch_list(values: list[str] | None) -> list[str] | None:
    """Return the names in all ``--watch`` options, in their order; None if there is none."""
    if values is None:
        return None
    return [name.strip() for value in values for name in _COMMA.split(value) if name.strip()]
