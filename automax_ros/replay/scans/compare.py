"""Counts the differences between recorded and replayed scans: first, greatest, how often, and where they settle.

Memory does not grow with the recording: one tally is kept for each item that differs, up to a limit; the rest is only
counted.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.replay.scans.report import (
    Difference,
    DifferenceKind,
    FirstScan,
    Greatest,
    NamedValue,
    ScanPoint,
    Settled,
)

Ints = NDArray[np.int64]

BAND_COUNTS = 2
"""A difference of whole numbers counts as settled within this many counts (decision) ..."""
BAND_SHARE = 0.05
"""... or, for REALs too, within this share of the greatest difference (decision)."""
SETTLED_SCANS = 10
"""Scans that a difference must stay within that band to count as settled (decision)."""
_MOST_COUNTED = 100_000
"""Most items beyond the limit that are counted; a greater number would be of no use."""


class Found(NamedTuple):
    """An item that differs after one scan; ``counts`` is FALSE if the difference is within the tolerance."""

    kind: DifferenceKind
    key: Hashable
    recorded: Value
    replayed: Value
    counts: bool = True


class Label(NamedTuple):
    """An item's name in the report, its unit, and the BASIC lines that can write it."""

    name: str
    unit: str = ""
    lines: tuple[int, ...] = ()


class Seen(NamedTuple):
    """The inputs of a scan: latched values and reads, with their names."""

    latched: tuple[NamedValue, ...] = ()
    read: tuple[NamedValue, ...] = ()


class Stretch(NamedTuple):
    """One whole number, or BOOLEAN, after each of some scans; ``counts`` is as in ``Found``."""

    recorded: Ints
    replayed: Ints
    counts: NDArray[np.bool_]
    boolean: bool


class _Run:
    """The latest stretch of scans in which a difference has stayed in its band; ``floor`` is the band's least width."""

    def __init__(self, scan: int, time_s: float, difference: float, floor: float) -> None:
        self._floor = floor
        self._scan, self._time_s = scan, time_s
        self._low = self._high = self._begin = self._latest = difference
        self._scans = self._same = 1
        self._zero_scan, self._zero_time_s, self._zeros = scan, time_s, 0

    def add(self, scans: Sequence[int], times_s: Sequence[float], differences: Sequence[float]) -> None:
        """Add scans; outside of the band, and after a stretch of equality, a new stretch begins."""
        low, high, latest, same = self._low, self._high, self._latest, self._same
        count, zeros, floor = self._scans, self._zeros, self._floor
        for scan, time_s, difference in zip(scans, times_s, differences, strict=True):
            was_equal = False
            if difference:
                was_equal, zeros = zeros >= SETTLED_SCANS, 0
            else:
                if not zeros:
                    self._zero_scan, self._zero_time_s = scan, time_s
                zeros += 1
            count += 1
            if was_equal or not low <= difference <= high:
                low, high = min(low, difference), max(high, difference)
                if was_equal or high - low > max(floor, BAND_SHARE * max(abs(low), abs(high))):
                    self._scan, self._time_s, count = scan, time_s, 1
                    low = high = self._begin = difference
            same = same + 1 if difference == latest else 1
            latest = difference
        self._low, self._high, self._latest, self._same = low, high, latest, same
        self._scans, self._zeros = count, zeros

    def settled(self) -> Settled | None:
        """Return the stretch, None if it is too short or still drifts."""
        if self._zeros >= SETTLED_SCANS:
            return Settled(self._zero_scan, self._zero_time_s, 0, 0)
        moves = self._high - self._low > self._floor and self._same < SETTLED_SCANS
        drifts = moves and {self._begin, self._latest} == {self._low, self._high}
        if self._scans < SETTLED_SCANS or drifts:
            return None
        return Settled(self._scan, self._time_s, self._low, self._high)


class _Count:
    """The tally of one item that differs in at least one scan."""

    def __init__(self, task: str, kind: DifferenceKind, label: Label, first: ScanPoint) -> None:
        self.task, self.kind, self.label, self.first = task, kind, label, first
        self._scans = 0
        self._greatest: Greatest | None = None
        self._run: _Run | None = None

    def differs(self, found: Found, scan: int, time_s: float) -> None:
        """Count a scan after which the item differs."""
        self._scans += found.counts
        if self.kind is not DifferenceKind.VARIABLE:
            return
        difference = _difference(found.recorded, found.replayed)
        if difference is None:
            self._goes_on(scan, time_s, 1, 0)
            return
        if self._greatest is None or abs(difference) > abs(self._greatest.difference):
            self._greatest = Greatest(scan, time_s, difference)
        self._goes_on(scan, time_s, difference, BAND_COUNTS if isinstance(difference, int) else 0)

    def agrees(self, scans: Sequence[int], times_s: Sequence[float]) -> None:
        """Count scans after which the item does not differ."""
        if self._run is not None:
            self._run.add(scans, times_s, (0,) * len(scans))

    def stretch(self, stretch: Stretch, scans: Sequence[int], times_s: Sequence[float]) -> None:
        """Count scans one after another, of which some may not differ, as ``differs`` and ``agrees`` do."""
        self._scans += int(np.count_nonzero(stretch.counts))
        differences = stretch.replayed - stretch.recorded
        if stretch.boolean:
            differences = np.abs(differences)
        else:
            place = int(np.argmax(np.abs(differences)))
            greatest = int(differences[place])
            if self._greatest is None or abs(greatest) > abs(self._greatest.difference):
                self._greatest = Greatest(scans[place], times_s[place], greatest)
        assert self._run is not None
        self._run.add(scans, times_s, differences.tolist())

    def result(self) -> Difference:
        """Return the difference that was counted."""
        settled = self._run.settled() if self._run else None
        label = self.label
        return Difference(
            self.task,
            self.kind,
            label.name,
            self.first,
            self._scans,
            label.unit,
            label.lines,
            self._greatest,
            settled,
        )

    def _goes_on(self, scan: int, time_s: float, difference: float, floor: float) -> None:
        if self._run is None:
            self._run = _Run(scan, time_s, difference, floor)
        else:
            self._run.add((scan,), (time_s,), (difference,))


class DifferenceCounts:
    """All differences of one replay; times count from ``origin`` (ns), at most ``limit`` items are kept in full."""

    def __init__(self, origin: int, limit: int) -> None:
        self.origin = origin
        self._limit = limit
        self._by_task: dict[str, dict[tuple[DifferenceKind, Hashable], _Count]] = {}
        self._count = 0
        self._beyond: set[tuple[str, DifferenceKind, Hashable]] = set()
        self._first: tuple[str, int, float, Seen] | None = None

    def time_s(self, stamp: int) -> float:
        """Return the time of a stamp since the start of the run."""
        return (stamp - self.origin) / NS_PER_S

    def is_clean(self, task: str) -> bool:
        """Return whether nothing of a task has differed so far."""
        return not self._by_task.get(task)

    def scan(
        self,
        task: str,
        scan: int,
        stamp: int,
        found: Sequence[Found],
        label: Callable[[DifferenceKind, Hashable], Label],
        seen: Callable[[], Seen],
    ) -> bool:
        """Count one scan; return whether it differs. ``label`` is called for a new item, ``seen`` for the first."""
        tallies = self._by_task.setdefault(task, {})
        if not found and not tallies:
            return False
        time_s = self.time_s(stamp)
        now: set[tuple[DifferenceKind, Hashable]] = set()
        for item in found:
            key = (item.kind, item.key)
            tally = tallies.get(key) or (self._new(task, item, scan, time_s, label) if item.counts else None)
            if tally is not None:
                tally.differs(item, scan, time_s)
                now.add(key)
        for key, tally in tallies.items():
            if key not in now:
                tally.agrees((scan,), (time_s,))
        differs = any(item.counts for item in found)
        if differs and self._first is None:
            self._first = (task, scan, time_s, seen())
        return differs

    def has(self, task: str, key: Hashable) -> bool:
        """Return whether a variable of a task has differed before, counted in full or not."""
        known = DifferenceKind.VARIABLE, key
        return known in self._by_task.get(task, {}) or (task, *known) in self._beyond

    def stretches(self, task: str, found: Mapping[Hashable, Stretch], scans: Ints, stamps: Ints) -> int:
        """Count scans of variables by their keys, of which each that differs has differed before.

        Nothing else of the task differs in these scans. Returns how many of them differ.
        """
        numbers, times_s = scans.tolist(), ((stamps - self.origin) / NS_PER_S).tolist()
        for (kind, key), tally in self._by_task.get(task, {}).items():
            if kind is DifferenceKind.VARIABLE and key in found:
                tally.stretch(found[key], numbers, times_s)
            else:
                tally.agrees(numbers, times_s)
        differs = np.zeros(len(scans), bool)
        for stretch in found.values():
            differs |= stretch.counts
        return int(np.count_nonzero(differs))

    def states(
        self,
        task: str,
        scan: int,
        stamp: int,
        found: Sequence[Found],
        label: Callable[[DifferenceKind, Hashable], Label],
        seen: Callable[[], Seen],
    ) -> None:
        """Count the fields in which one recorded state differs."""
        tallies = self._by_task.setdefault(task, {})
        time_s = self.time_s(stamp)
        for item in found:
            tally = tallies.get((item.kind, item.key)) or self._new(task, item, scan, time_s, label)
            if tally is not None:
                tally.differs(item, scan, time_s)
        if found and self._first is None:
            self._first = (task, scan, time_s, seen())

    def differences(self) -> tuple[Difference, ...]:
        """Return all differences that are kept in full, by the time of their first occurrence."""
        tallies = [tally for by_key in self._by_task.values() for tally in by_key.values()]
        return tuple(sorted((tally.result() for tally in tallies), key=lambda item: item.first.time_s))

    @property
    def more(self) -> int:
        """Number of items that differ beyond the limit."""
        return len(self._beyond)

    def first(self) -> FirstScan | None:
        """Return the first scan that differs."""
        if self._first is None:
            return None
        task, scan, time_s, seen = self._first
        here = (task, scan, time_s)
        differences = [item for item in self.differences() if (item.task, item.first.scan, item.first.time_s) == here]
        return FirstScan(task, scan, time_s, tuple(differences), seen.latched, seen.read)

    def _new(
        self, task: str, item: Found, scan: int, time_s: float, label: Callable[[DifferenceKind, Hashable], Label]
    ) -> _Count | None:
        """Create a tally; None beyond the limit."""
        if self._count >= self._limit:
            if len(self._beyond) < _MOST_COUNTED:
                self._beyond.add((task, item.kind, item.key))
            return None
        self._count += 1
        first = ScanPoint(scan, time_s, item.recorded, item.replayed)
        tally = _Count(task, item.kind, label(item.kind, item.key), first)
        self._by_task[task][item.kind, item.key] = tally
        return tally


def within(recorded: Value, replayed: Value, tolerance: float) -> bool:
    """Whether two numbers differ by at most a tolerance; booleans and strings never do."""
    difference = _difference(recorded, replayed) if tolerance else None
    return difference is not None and abs(difference) <= tolerance


def _difference(recorded: Value, replayed: Value) -> float | None:
    """Return the replayed minus the recorded value; None if they are not numbers."""
    for value in (recorded, replayed):
        if isinstance(value, (bool, str)):
            return None
    assert not isinstance(recorded, str)
    assert not isinstance(replayed, str)
    return replayed - recorded
