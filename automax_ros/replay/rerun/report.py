"""How a rerun went: as text for people, and as data for programs."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.replay.rerun.checking import Deviation
from automax_ros.replay.rerun.outside import Outside


@dataclass(frozen=True)
class RerunReport:
    """How a rerun went; times in ns of the run.

    ``at_ns`` is when the edit took its place, ``compared`` the number of messages that were as recorded before it
    (unedited: to the end), ``deviation`` the first that was not. ``is_exact``: bit for bit, all of them.
    """

    bag: str
    rack: str
    edited: tuple[str, ...]
    plants: tuple[str, ...]
    outside: Outside
    at_ns: int
    to_ns: int
    compared: int
    deviation: Deviation | None
    is_exact: bool
    is_live: bool
    scans: int
    refused: int
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """Return the report for people."""
        return "\n".join(self._lines()) + "\n"

    def _lines(self) -> list[str]:
        outside = self.outside
        whole = "on the wall clock" if self.is_live else "in simulated time"
        length = seconds_text(min(outside.ends_ns, self.to_ns))
        lines = [f"{self.bag}: rack {self.rack}, {whole}, {length} s"]
        lines.append(f"from outside: {_counts_text(outside)}")
        end, up_to = seconds_text(self.to_ns), seconds_text(self.at_ns)
        if not self.edited:
            lines.append(f"unedited, from the start to {end} s: {self._compared}")
        elif self.at_ns:
            lines.append(f"run up from the start to {up_to} s, for {self._lacks}: {self._compared}")
        else:
            lines.append("edited from the start on: there is nothing before it to compare")
        if self.edited:
            lines.append(f"edited, {seconds_text(self.at_ns)} to {end} s: {', '.join(self.edited)}")
        lines += [f"  {note}" for note in self.notes]
        lines.append(f"{count_of(self.scans, 'scan')} recorded")
        return lines

    @property
    def _compared(self) -> str:
        messages = count_of(self.compared, "message")
        if self.deviation is not None:
            return f"{messages} as recorded, and then not: {self.deviation.text}"
        if not self.is_exact:
            return f"{messages} with the recorded contents"
        if not self.edited and self.at_ns:
            return (
                f"{messages} as recorded, bit for bit up to {seconds_text(self.at_ns)} s, by their contents from there"
            )
        return f"{messages} as recorded, bit for bit"

    @property
    def _lacks(self) -> str:
        """Why the run does not begin at the moment of the edit."""
        if self.plants:
            return f"the recording does not hold the state of {', '.join(self.plants)} there"
        return "the recording does not hold where the scheduler is there"

    def as_json(self) -> dict[str, object]:
        """Return the report for programs."""
        deviation = self.deviation
        return {
            "bag": self.bag,
            "rack": self.rack,
            "simulated": not self.is_live,
            "edited": list(self.edited),
            "at_s": self.at_ns / NS_PER_S,
            "to_s": self.to_ns / NS_PER_S,
            "outside": dict(self.outside.counts()),
            "compared": self.compared,
            "exact": self.is_exact,
            "deviation": None if deviation is None else {"at_s": deviation.time_ns / NS_PER_S, "what": deviation.what},
            "scans": self.scans,
            "refused": self.refused,
            "notes": list(self.notes),
        }


def _counts_text(outside: Outside) -> str:
    counts = outside.counts()
    words = {
        "operator": ("write of the operator", "writes of the operator"),
        "ros": ("write from ROS", "writes from ROS"),
        "network": ("write of a network module", "writes of a network module"),
        "operations": ("operation", "operations"),
        "tuned": ("tunable set", "tunables set"),
    }
    parts = [f"{number} {words[name][number != 1]}" for name in words if (number := counts[name])]
    return ", ".join(parts) or "nothing"
