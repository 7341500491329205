"""``--native``: whether scans are machine code; ``--verbose``: which tasks are, and why others are not."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable

from automax_ros.compile.native.compiler_process import LIMIT_S
from automax_ros.compile.native.forms import NativeForms, NativeMode, NativeOutcome

_LIVE_LIMIT_S = 20.0
"""Longest that the start of a rack on the wall clock waits for one task to be built, s (decision)."""


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
    """Return what the command line wants; ``expected_ns`` is the task time that will pass, None without an end.

    On the wall clock scans gain nothing by it, for they wait for their deadlines: only ``on`` makes them native there.
    Tasks are built before the rack is put into RUN, those of a reload while the old ones scan (decision).
    """
    mode = NativeMode(arguments.native)
    forms = NativeForms(mode, expected_ns, limit_s=_LIVE_LIMIT_S if wall_clock else LIMIT_S)
    if wall_clock and mode is NativeMode.AUTO:
        return forms.off("on the wall clock scans gain nothing by it (--native on)")
    return forms


def tell_native(outcomes: Iterable[NativeOutcome]) -> None:
    """Say what became of each task."""
    for outcome in outcomes:
        print(outcome.text, file=sys.stderr)
