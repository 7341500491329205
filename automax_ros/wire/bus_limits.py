"""What of a message between processes can be true: seats and slots are the rack's, times lie where a run's can.

Whoever can publish on the bus can send any numbers. What cannot be true is refused where it comes in, here alone: a
time that no later one can exceed, for example, would decide for ever who is right (decision: limits as below).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from automax_ros.core.ticks import NS_PER_S
from automax_ros.wire.bus_messages import BusImage, BusWrite, Presence

AHEAD_NS = 60 * NS_PER_S
"""So far ahead of this process's time another's may be: clocks of hosts differ, and a process may have been held up."""
LONGEST_RUN_NS = 10 * 366 * 24 * 3600 * NS_PER_S
"""The longest run of a rack, where its start is not known."""
LARGEST_SEQUENCE = 1 << 62
LAST_STATE = 3
"""The last of the states of a process, LEAVING."""
INSTALLED_NS = -1
"""The time of what a rack has as it is installed."""


class BusLimits:
    """Judges messages. ``seats`` are the slots of all processes of the rack, by the slot that names each."""

    def __init__(self, seats: Mapping[int, tuple[int, ...]]) -> None:
        """Take the processes of the rack."""
        self._seats = {seat: tuple(sorted(slots)) for seat, slots in seats.items()}
        self._slots = {0}.union(*seats.values())  # 0 stands with what is as installed

    def of_presence(self, presence: Presence, wall_ns: int, latest_ns: int) -> str:
        """Return what of a process's word cannot be true, "" where all can.

        Args:
            presence: the word.
            wall_ns: the wall clock here.
            latest_ns: the latest rack time that there can be.
        """
        slots = self._seats.get(presence.seat)
        if slots is None:
            return f"a process in slot {presence.seat}, which is none of the rack"
        if tuple(sorted(presence.slots)) != slots:
            return f"a process of slot {presence.seat} with other slots than the rack's"
        if presence.epoch_ns and not wall_ns - LONGEST_RUN_NS <= presence.epoch_ns <= wall_ns + AHEAD_NS:
            return "a start of the run that cannot be"
        if presence.standing_seat not in self._slots:
            return f"a stop by slot {presence.standing_seat}, which is none of the rack"
        if not 0 <= presence.standing_ns <= latest_ns:
            return "a time of a stop that cannot be"
        if presence.state > LAST_STATE or presence.sequence > LARGEST_SEQUENCE:
            return "a state or a number that no process has"
        return ""

    def of_write(self, message: BusWrite, latest_ns: int) -> str:
        """Return what of a write cannot be true, "" where all can."""
        if message.seat not in self._seats:
            return f"a write by slot {message.seat}, which is none of the rack"
        if not 0 <= message.stamp <= latest_ns:
            return "a write at a time that cannot be"
        return "a write with a number that none has" if message.sequence > LARGEST_SEQUENCE else ""

    def of_image(self, message: BusImage, latest_ns: int) -> str:
        """Return what of an image cannot be true, "" where all can."""
        times = (*message.since_ns, *message.force_since_ns)
        if not all(INSTALLED_NS <= time_ns <= latest_ns for time_ns in times):
            return "an image with a time that cannot be"
        if not self._are_seats((*message.seat, *message.force_seat)):
            return "an image with a slot that is none of the rack"
        most = max((message.sequence, *message.order, *message.force_order))
        return "an image with a number that none has" if most > LARGEST_SEQUENCE else ""

    def _are_seats(self, seats: Iterable[int]) -> bool:
        return self._slots.issuperset(seats)
