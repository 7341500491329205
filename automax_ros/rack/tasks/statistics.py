"""Statistics of a task's scans on this host: counts and times, of a window and since the rack was started."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Times:
    """Execution times and lateness of scans, ns; stepped scans are never late: rack time waits for them."""

    scans: int = 0
    skipped: int = 0
    total_ns: int = 0
    least_ns: int = 0
    longest_ns: int = 0
    late_ns: int = 0
    latest_ns: int = 0

    def add(self, taken_ns: int, late_ns: int) -> None:
        """Count a scan with its time and its lateness."""
        if taken_ns < self.least_ns or not self.scans:
            self.least_ns = taken_ns
        self.longest_ns = max(self.longest_ns, taken_ns)
        self.latest_ns = max(self.latest_ns, late_ns)
        self.scans += 1
        self.total_ns += taken_ns
        self.late_ns += late_ns

    @property
    def mean_ns(self) -> float:
        """The mean execution time; 0 without a scan."""
        return self.total_ns / self.scans if self.scans else 0.0

    @property
    def mean_late_ns(self) -> float:
        """The mean lateness; 0 without a scan."""
        return self.late_ns / self.scans if self.scans else 0.0


@dataclass
class TaskStatistics(Times):
    """Counts of one task since the rack was started; ``window`` counts since it was last taken.

    Times (ns) are the host's where the rack has a stopwatch, in modeled execution modeled ones, from start to end.
    """

    last_ns: int = 0
    window: Times = field(default_factory=Times)

    def add(self, taken_ns: int, late_ns: int = 0) -> None:
        """Count a scan with its time and its lateness."""
        self.last_ns = taken_ns
        super().add(taken_ns, late_ns)
        self.window.add(taken_ns, late_ns)

    def skip(self, scans: int) -> None:
        """Count missed deadlines."""
        self.skipped += scans
        self.window.skipped += scans

    def take_window(self) -> Times:
        """Return the times since the last call, and restart their count."""
        taken, self.window = self.window, Times()
        return taken
