"""The status of a task, and the record of one of its scans."""

from __future__ import annotations

import enum
from collections.abc import Callable, Generator

from automax_ros.core.types import Latched, Value


class Status(enum.Enum):
    """The status of a task."""

    STOPPED = "stopped"
    RUNNING = "running"
    ENDED = "ended by STOP"
    FAULTED = "faulted"


_FIELDS = ("commits", "duration_ns", "errors", "latched", "reads", "scan", "skipped", "time_ns", "writes")

_KEPT = {"commits": "_commits", "errors": "_errors", "reads": "_reads", "writes": "_writes"}
"""The attributes that store lists created on first access."""


class ScanRecord:  # noqa: PLW1641  # no hash: it changes during the scan
    """All inputs and effects of one scan; ``reads``, ``writes`` are (view, element, value), ``commits`` (view, value).

    ``time_ns`` is the instant of the latch, ``duration_ns`` the host's time of execution, or the modeled one.
    """

    # Not a dataclass: every recorded scan makes one, and that takes twice as long. Few need any of the lists.
    __slots__ = ("_commits", "_errors", "_reads", "_writes", "duration_ns", "latched", "scan", "skipped", "time_ns")

    def __init__(self, time_ns: int, scan: int, skipped: int = 0) -> None:
        """Create an empty record; ``skipped`` deadlines were missed before the scan."""
        self.time_ns = time_ns
        self.scan = scan
        self.latched: Latched = ()
        self._reads: list[tuple[int, int, Value]] | None = None
        self._writes: list[tuple[int, int, Value]] | None = None
        self._commits: list[tuple[int, Value]] | None = None
        self._errors: list[tuple[int, int]] | None = None
        self.skipped = skipped
        self.duration_ns = 0

    @property
    def reads(self) -> list[tuple[int, int, Value]]:
        """The reads of actual memory, in order."""
        if self._reads is None:
            self._reads = []
        return self._reads

    @property
    def writes(self) -> list[tuple[int, int, Value]]:
        """The writes to actual memory, in order."""
        if self._writes is None:
            self._writes = []
        return self._writes

    @property
    def commits(self) -> list[tuple[int, Value]]:
        """The changes by blocks."""
        if self._commits is None:
            self._commits = []
        return self._commits

    @commits.setter
    def commits(self, changes: list[tuple[int, Value]]) -> None:
        self._commits = changes

    @property
    def errors(self) -> list[tuple[int, int]]:
        """The run-time errors, (line, code), in order."""
        if self._errors is None:
            self._errors = []
        return self._errors

    @property
    def has_errors(self) -> bool:
        """Whether there were run-time errors."""
        return bool(self._errors)

    @property
    def has_commits(self) -> bool:
        """Whether blocks changed anything."""
        return bool(self._commits)

    @property
    def has_accesses(self) -> bool:
        """Whether actual memory was read or written apart from latch and commit."""
        return bool(self._reads) or bool(self._writes)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ScanRecord):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in _FIELDS)

    def __reduce__(self) -> tuple[Callable[..., ScanRecord], tuple[object, ...]]:
        """Return how to make a copy, which a compiled class cannot make otherwise."""
        return _with_fields, tuple(getattr(self, name) for name in _FIELDS)

    def __repr__(self) -> str:
        return f"ScanRecord({', '.join(f'{name}={getattr(self, name)!r}' for name in _FIELDS)})"


def _with_fields(*values: object) -> ScanRecord:
    record = ScanRecord(0, 0)
    for name, value in zip(_FIELDS, values, strict=True):
        setattr(record, _KEPT.get(name, name), value)
    return record


Steps = Generator[int, int | None, ScanRecord | None]
"""A scan in steps: yields the ns of execution before each access to actual memory, and is sent the time after them.

If it is sent None, the time does not change. It returns the record of the scan, if one is kept.
"""
