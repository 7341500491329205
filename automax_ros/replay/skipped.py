"""What the path scan by scan must know of scans that were executed otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.types import Value


@dataclass(frozen=True)
class Skipped:
    """Scans that were executed again elsewhere: stamp, length, number and ``latched`` are those of the last.

    ``errors`` are scan, line and code of each that was logged.
    """

    count: int
    scan: int
    stamp: int
    duration_ns: int
    latched: Sequence[Value]
    errors: Sequence[tuple[int, int, int]]
    counted: bool
