"""`automax ctl RACK watch`: asks again and again, and prints what has changed."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

from automax_ros.cli.options.values import seconds_above_0
from automax_ros.core.faults import UserError
from automax_ros.core.text import count_of, printable
from automax_ros.core.ticks import NS_PER_S

DEFAULT_EVERY_S = "0.5"
NAMES_HELP = "REF%%, TABLE%%(3), SPEED.ERROR%%; patterns in quotes: 'F_*', 'SPEED.*'"
_LOOK_S = 0.05

Read = Callable[[], list[dict[str, str]]]
"""Asks the rack for values: each with its ``name`` and ``value``."""


def add_watch_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is watched, how often, and for how long."""
    parser.add_argument("names", nargs="+", metavar="NAME", help=NAMES_HELP)
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
                print(json.dumps(item) if arguments.json else printable(value_line(item)))
        sys.stdout.flush()
        next_ns = time.monotonic_ns() + arguments.every
        if end_ns is not None and next_ns > end_ns:
            return
        while time.monotonic_ns() < next_ns:
            if is_over():
                return
            time.sleep(min(_LOOK_S, arguments.every / NS_PER_S))


def values_of(answer: Any) -> list[dict[str, str]]:
    """Return the names and values of an answer; ``shown`` where a value has a unit.

    Raises:
        Fault: they are not as many: no rack of ours answers so.
    """
    if not len(answer.found) == len(answer.values) == len(answer.shown):
        count = f"{count_of(len(answer.found), 'name')} and {count_of(len(answer.values), 'value')}"
        raise UserError(
            f"the rack answers with {count}", "look who else serves its operator's services in this ROS domain"
        )
    items = zip(answer.found, answer.values, answer.shown, strict=True)
    return [{"name": name, "value": text} | ({"shown": shown} if shown else {}) for name, text, shown in items]


def value_line(item: Mapping[str, str]) -> str:
    """Return a value for a person: ``LEVEL% = 2048 (5.001 bar)``, ``SPEED% = 1500 fpm`` where the unit is all."""
    value, shown = item["value"], item.get("shown", "")
    if shown.startswith(f"{value} "):
        return f"{item['name']} = {shown}"
    return f"{item['name']} = {value}" + (f" ({shown})" if shown else "")
