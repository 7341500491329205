"""What a task is doing, and what one of its scans saw and did."""

from __future__ import annotations

import enum
from collections.abc import Generator
from dataclasses import dataclass, field

from automax_ros.core.types import Latched, Value


class Status(enum.Enum):
    """What a task is doing."""

    STOPPED = "stopped"
    RUNNING = "running"
    ENDED = "ended by STOP"
    FAULTED = "faulted"


@dataclass
class ScanRecord:
    """All that one scan saw and did; ``reads``, ``writes`` are (view, element, value), ``commits`` (view, value).

    ``time_ns`` is the instant of the latch, ``duration_ns`` the time of execution: the host's, or the modeled one from
    the scan's beginning to its end, the time in which it was suspended included.
    """

    time_ns: int
    scan: int
    latched: Latched = ()
    reads: list[tuple[int, int, Value]] = field(default_factory=list)
    writes: list[tuple[int, int, Value]] = field(default_factory=list)
    commits: list[tuple[int, Value]] = field(default_factory=list)
    errors: list[tuple[int, int]] = field(default_factory=list)
    skipped: int = 0
    duration_ns: int = 0


Steps = Generator[int, int | None, ScanRecord | None]
"""A scan in steps: yields the ns of execution before each access to actual memory, and is sent the time it is then.

Sent None, the time is what it was. Returns the record of the scan, if one is kept.
"""
