"""`automax ctl RACK watch`: asks again and again, and prints what has changed."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from typing import Any

from automax_ros.cli.window import seconds_above_0
from automax_ros.core.faults import Fault
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S

DEFAULT_EVERY_S = "0.5"
_LOOK_S = 0.05

Read = Callable[[], list[dict[str, str]]]
"""Asks the rack for values: each with its ``name`` and ``value``."""


def add_watch_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is watched, how often, and for how long."""
    parser.add_argument("names", nargs="+", metavar="NAME", help="REF%%, TABLE%%(3), SPEED.ERROR%%")
    parser.add_argument(
        "--every",
        type=seconds_above_0,
        metavar="S",
        default=DEFAULT_EVERY_S,
        help=f"seconds from one look to the next (default: {DEFAULT_EVERY_S})",
    )
    parser.add_argument(
        "--duration", type=seconds_above_0, metavar="S", help="seconds to watch (default: until Ctrl-C)"
    )


def watch(read: Read, arguments: argparse.Namespace, is_over: Callable[[], bool]) -> None:
    """Print every value, then those that have changed, until the time or ``is_over`` ends it.

    A value that comes and goes between two looks is not seen: `automax record` misses none. With ``json`` each line is
    an object of its own.
    """
    end_ns = None if arguments.duration is None else time.monotonic_ns() + arguments.duration
    shown: dict[str, str] = {}
    while True:
        for item in read():
            if shown.get(item["name"]) != item["value"]:
                shown[item["name"]] = item["value"]
                print(json.dumps(item) if arguments.json else f"{item['name']} = {item['value']}")
        sys.stdout.flush()
        next_ns = time.monotonic_ns() + arguments.every
        if end_ns is not None and next_ns > end_ns:
            return
        while time.monotonic_ns() < next_ns:
            if is_over():
                return
            time.sleep(min(_LOOK_S, arguments.every / NS_PER_S))


def values_of(answer: Any) -> list[dict[str, str]]:
    """Return the names and values of an answer.

    Raises:
        Fault: they are not as many: no rack of ours answers so.
    """
    if len(answer.found) != len(answer.values):
        count = f"{count_of(len(answer.found), 'name')} and {count_of(len(answer.values), 'value')}"
        raise Fault(f"the rack answers with {count}", "look who else serves its operator's services in this ROS domain")
    return [{"name": name, "value": text} for name, text in zip(answer.found, answer.values, strict=True)]
