"""Numbers on the command line, all spelled alike (core/values.py): as argparse types, and for options read later."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TypeVar

from automax_ros.cli.usage import UsageError
from automax_ros.core import values

_T = TypeVar("_T", int, float)


def number(text: str) -> float:
    """Return an argument's decimal number, for ``type=``."""
    return _argument(values.number, text)


def whole_number(text: str) -> int:
    """Return an argument's whole number, for ``type=``."""
    return _argument(values.whole_number, text)


def option_number(option: str, text: str, low: float, high: float, what: str = "a number") -> float:
    """Return the number that was given to an option.

    Raises:
        UsageError: it is not one from ``low`` to ``high``.
    """
    try:
        found = values.number(text)
    except ValueError as error:
        raise UsageError(f"{option}: {error}", f"give {what} from {low:.10g} to {high:.10g}") from None
    if not low <= found <= high:
        raise UsageError(f"{option}: {text} is not {what} from {low:.10g} to {high:.10g}")
    return found


def _argument(read: Callable[[str], _T], text: str) -> _T:
    try:
        return read(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
