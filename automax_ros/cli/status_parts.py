"""What there is to tell of a rack's run, as data: each process of a distributed rack has its part of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S


@dataclass(frozen=True)
class Progress:
    """How a run stands.

    Attributes:
        now_ns: rack time.
        standing: what stands in the way of the tasks, such as ``power off``.
        scans_per_s: how many scans there were since the last time, per second of rack time.
        loads: what Processors do, in words; without any, ``pace`` is how many times faster than real time it went.
        pace: see ``loads``.
        trouble: counts of what went wrong, by its kind in words.
        values: the variables that the person wants to see.
    """

    now_ns: int
    standing: tuple[str, ...] = ()
    scans_per_s: float = 0.0
    loads: tuple[str, ...] = ()
    pace: float | None = None
    trouble: Mapping[str, int] = field(default_factory=dict)
    values: tuple[str, ...] = ()

    @property
    def parts(self) -> list[str]:
        """The parts of the line that shows it."""
        pace = [] if self.pace is None else [f"{self.pace:.0f}x"]
        trouble = [count_of(number, kind) for kind, number in self.trouble.items() if number]
        head = [f"{self.now_ns / NS_PER_S:8.1f} s", *self.standing, f"{self.scans_per_s:.0f} scans/s"]
        return [*head, *self.loads, *pace, *trouble, *self.values]


def merged_progress(parts: Sequence[Progress]) -> Progress:
    """Return how a rack stands of which each process has told its part, that of common memory first."""
    trouble: Counter[str] = Counter()
    for part in parts:
        trouble.update(part.trouble)
    return Progress(
        now_ns=parts[0].now_ns,
        standing=tuple(dict.fromkeys(word for part in parts for word in part.standing)),
        scans_per_s=sum(part.scans_per_s for part in parts),
        loads=tuple(load for part in parts for load in part.loads),
        trouble=dict(trouble),
        values=parts[0].values,
    )


@dataclass(frozen=True)
class Summary:
    """What a run came to.

    Attributes:
        seconds: rack time that has passed.
        live: whether execution times were measured.
        rows: of the table of tasks.
        notes: lines after it.
        values: the variables that the person wants to see.
        took_s: seconds that a run in simulated time took, None for one on the wall clock.
    """

    seconds: float
    live: bool
    rows: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    took_s: float | None = None

    @property
    def lines(self) -> list[str]:
        """The summary as lines of text."""
        took = self.took_s
        pace = "" if took is None else f" in {took:.2f} s ({self.seconds / took if took else 0:.0f} times real time)"
        head = f"  {'task':10}{'slot':>4}{'period ms':>11}{'scans':>10}{'late':>7}{'errors':>8}"
        head += f"{'mean us':>10}{'longest us':>12}" if self.live else ""
        values = ["  " + "  ".join(self.values)] if self.values else []
        return [f"ran {self.seconds:.3f} s{pace}", head, *self.rows, *self.notes, *values]


def merged_summary(parts: Sequence[Summary]) -> Summary:
    """Return what a rack's run came to of which each process has told its part, that of common memory first."""
    rows = tuple(row for part in parts for row in part.rows)
    return Summary(parts[0].seconds, True, rows, tuple(note for part in parts for note in part.notes), parts[0].values)


def recorded_size(folder: Path) -> str:
    """Return how much a recording's folder holds, in MB; its disk may have gone while the rack ran."""
    try:
        return f"{sum(item.stat().st_size for item in folder.iterdir()) / 1e6:.2f} MB"
    except OSError:
        return "cannot be read any more"
