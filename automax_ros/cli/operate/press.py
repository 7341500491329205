"""`automax ctl RACK press`: sets push-buttons and contacts to TRUE for a while, then to FALSE."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from automax_ros.cli.options.values import seconds_above_0
from automax_ros.core.ticks import NS_PER_S

if TYPE_CHECKING:
    from automax_ros.cli.operate.actions import ServiceCall

DEFAULT_FOR_S = "0.2"
_LOOK_S = 0.01
Answer = Callable[["ServiceCall", int], Any]
"""Sends a request, waits for at most a given time (ns), and returns the answer."""


def add_press_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for what is pressed, and for how long."""
    parser.add_argument("names", nargs="+", metavar="NAME@", help="a BOOLEAN: START_PB@, LAMP@(3)")
    parser.add_argument(
        "--for",
        dest="held",
        type=seconds_above_0,
        metavar="S",
        default=DEFAULT_FOR_S,
        help=f"seconds for which it is held (default: {DEFAULT_FOR_S})",
    )


def press(
    answer: Answer, calls: Sequence[ServiceCall], given: argparse.Namespace, should_stop: Callable[[], bool]
) -> list[tuple[ServiceCall, Any]]:
    """Set all names at once, hold them, and reset those that were FALSE; return the answer for each.

    One that was TRUE already is not pressed, since no edge would result, and stays TRUE. Ctrl-C ends the press early.
    """
    pressed: list[tuple[ServiceCall, Any]] = []
    found: list[tuple[ServiceCall, Any]] = []
    try:
        for call in calls:
            set_to = answer(call, given.timeout)
            if set_to.ok and set_to.before == "TRUE":
                reason = f"it was already 1: `set {call.of}=0` lets it go"
                found.append((call, SimpleNamespace(ok=False, reason=reason)))
            else:
                found.append((call, set_to))
                pressed += [(call, set_to)] if set_to.ok else []
        end_ns = time.monotonic_ns() + (given.held if pressed else 0)
        while (left := end_ns - time.monotonic_ns()) > 0 and not should_stop():
            time.sleep(min(_LOOK_S, left / NS_PER_S))
    finally:
        for call, _ in pressed:
            released = answer(replace(call, fields={**call.fields, "value": "FALSE"}), given.timeout)
            if not released.ok:
                found = [item if item[0] is not call else (call, released) for item in found]
    return found
