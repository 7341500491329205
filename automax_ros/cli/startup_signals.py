"""Signals before a command has begun its work: nothing is open yet, so they end the program at once and silently.

An exception that interrupts an import would be printed. Only modules that Python has loaded anyway are imported here.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]
import os

_SIGNALLED = 128
_NUMBERS = (_signal.SIGINT, _signal.SIGTERM, _signal.SIGHUP)


def end_at_once(number: int, _: object) -> None:
    """End the program with the shell's exit code for a signal."""
    os._exit(_SIGNALLED + number)


def end_well(_: int, __: object) -> None:
    """End a program that runs until it is stopped, with exit code 0."""
    os._exit(0)


EARLY = (end_at_once, end_well)


def until_work_begins(*, ends_well: bool) -> None:
    """Make SIGINT, SIGTERM and SIGHUP end the program at once; one that is ignored stays ignored.

    ``ends_well``: with exit code 0, since to be stopped is its end (decision: launch files and supervisors take another
    code for a failure, and the user cannot know how far the program has come).
    """
    for number in _NUMBERS:
        if _signal.getsignal(number) != _signal.SIG_IGN:
            _signal.signal(number, end_well if ends_well else end_at_once)


def work_begins() -> None:
    """Make Ctrl-C raise an exception again, so that a command cleans up; no effect without ``until_work_begins``."""
    if _signal.getsignal(_signal.SIGINT) in EARLY:
        _signal.signal(_signal.SIGINT, _signal.default_int_handler)


def work_has_ended() -> None:
    """Ignore signals from here on; the exit code is final."""
    for number in _NUMBERS:
        _signal.signal(number, _signal.SIG_IGN)
