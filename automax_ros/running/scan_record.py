"""What a task is doing, and what one of its scans saw and did."""

from __future__ import annotations

import enum
from collections.abc import Callable, Generator

from automax_ros.core.types import Latched, Value


class Status(enum.Enum):
    """What a task is doing."""

    STOPPED = "stopped"
    RUNNING = "running"
    ENDED = "ended by STOP"
    FAULTED = "faulted"


_FIELDS = ("commits", "duration_ns", "errors", "latched", "reads", "scan", "skipped", "time_ns", "writes")


class ScanRecord:  # noqa: PLW1641  # no hash: it changes while the scan goes on
    """All that one scan saw and did; ``reads``, ``writes`` are (view, element, value), ``commits`` (view, value).

    ``time_ns`` is the instant of the latch, ``duration_ns`` the time of execution: the host's, or the modeled one from
    the scan's beginning to its end, the time in which it was suspended included.
    """

    # Not a dataclass: every recorded scan makes one, and that takes twice as long.
    __slots__ = _FIELDS

    def __init__(self, time_ns: int, scan: int, skipped: int = 0) -> None:
        """Begin the record of a scan that has seen and done nothing; ``skipped`` deadlines were missed before it."""
        self.time_ns = time_ns
        self.scan = scan
        self.latched: Latched = ()
        self.reads: list[tuple[int, int, Value]] = []
        self.writes: list[tuple[int, int, Value]] = []
        self.commits: list[tuple[int, Value]] = []
        self.errors: list[tuple[int, int]] = []
        self.skipped = skipped
        self.duration_ns = 0

    def __eq__(self, other: object) -> bool:
        """Return whether another record says the same."""
        if not isinstance(other, ScanRecord):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in _FIELDS)

    def __reduce__(self) -> tuple[Callable[..., ScanRecord], tuple[object, ...]]:
        """Return what makes a copy: a class of machine code has none of its own."""
        return _with_fields, tuple(getattr(self, name) for name in _FIELDS)

    def __repr__(self) -> str:
        """Return all of it as text."""
        return f"ScanRecord({', '.join(f'{name}={getattr(self, name)!r}' for name in _FIELDS)})"


def _with_fields(*values: object) -> ScanRecord:
    record = ScanRecord(0, 0)
    for name, value in zip(_FIELDS, values, strict=True):
        setattr(record, name, value)
    return record


Steps = Generator[int, int | None, ScanRecord | None]
"""A scan in steps: yields the ns of execution before each access to actual memory, and is sent the time it is then.

Sent None, the time is what it was. Returns the record of the scan, if one is kept.
"""
