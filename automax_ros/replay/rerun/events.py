"""What came from outside in a recorded run: writes, operations, tuning, each with its place in the order of events."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.types import Value

Entry = tuple[int, int, Value]
"""View, element, value."""


class Order(enum.IntEnum):
    """The place of an event among those of its instant.

    ``START`` is before the tasks are put into RUN, ``FIRST`` before all else of the instant, ``AFTER_IO`` after I/O and
    before scans, ``AFTER_SCAN`` right after a scan, ``LAST`` after all else.
    """

    START = 0
    FIRST = 1
    AFTER_IO = 2
    AFTER_SCAN = 3
    LAST = 4


@dataclass(frozen=True)
class Written:
    """Values that one writer has written together; ``shown`` are what changed with them, on the same registers."""

    writer: int
    entries: tuple[Entry, ...]
    shown: tuple[Entry, ...] = ()


@dataclass(frozen=True)
class Operated:
    """An operation on the rack, with the fields of its message.

    ``written`` is what a ``set`` wrote, ``source`` the new source of a reload.
    """

    what: str
    task: str = ""
    ok: bool = True
    reason: str = ""
    detail: str = ""
    written: Written | None = None
    source: SourceText | None = None


@dataclass(frozen=True)
class Tuned:
    """A tunable that was set without an operation, as ROS parameters do."""

    task: str
    name: str
    value: Value


Act = Written | Operated | Tuned


@dataclass(frozen=True)
class Event:
    """One act from outside at a rack time (ns); ``scan`` is the task and the number of the scan that it follows."""

    at_ns: int
    act: Act
    order: Order = Order.FIRST
    scan: tuple[str, int] | None = None
