"""The table of a rack's tasks, as Python tuples with names: no recording holds it.

A time (``builtin_interfaces/Time``) is an integer of nanoseconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class TaskInfo(NamedTuple):
    """One task as it stands."""

    task: str
    module: str
    slot: int
    status: str
    priority: int
    critical: bool
    period_ms: float
    scans: int
    skipped: int
    errors: int
    last_error: str
    source_hash: str


class TaskTable(NamedTuple):
    """The tasks of a rack, or of the modules of one of its processes."""

    stamp: int
    rack: str
    run_id: int
    tasks: Sequence[TaskInfo] = ()
