"""Converts the data that processes of one rack exchange to messages and back, and checks received messages.

Both ends have the same rack file, so variables are identified by numbers. Times in messages are instants of rack time:
all processes of a run share its start.

Any program that can publish on the bus can send any numbers. Processes and slots that the rack does not have, and times
outside of a run, are refused on reception, only here: a time that no later one can exceed, for example, would override
all later writes for ever (decision: limits as below).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.messages.cdr.parts import CdrError
from automax_ros.messages.types.messages import BusImage, BusWrite, Presence, Values, values_of
from automax_ros.messages.types.topics import QosProfile
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.distributed.image_sync import Batch, HeldForce, ImageCopy, StopState
from automax_ros.rack.distributed.versions import VersionedValue

AHEAD_NS = 60 * NS_PER_S
"""How far another process's time may be ahead of this one's: hosts' clocks differ, and a process may be held up."""
LONGEST_RUN_NS = 10 * 366 * 24 * 3600 * NS_PER_S
"""The longest run of a rack, if its start is unknown."""
LARGEST_SEQUENCE = 1 << 62
LAST_STATE = 3
"""The last of the states of a process, LEAVING."""
INSTALLED_NS = -1
"""The time of values that a rack has at its installation."""


BUS = QosProfile("reliable", "volatile", "keep_last", 1000)
"""Writes and images between processes: every message counts."""


class BusLimits:
    """Checks messages. ``process_slots`` are the slots of all processes of the rack, by the slot that names each."""

    def __init__(self, process_slots: Mapping[int, tuple[int, ...]]) -> None:
        self._process_slots = {process_slot: tuple(sorted(slots)) for process_slot, slots in process_slots.items()}
        self._slots = {0}.union(*process_slots.values())  # 0 is that of values as installed

    def of_presence(self, presence: Presence, wall_ns: int, latest_ns: int) -> str:
        """Return why a presence cannot be valid, "" if it can.

        Args:
            presence: the message.
            wall_ns: the wall clock of this process.
            latest_ns: the latest possible rack time.
        """
        slots = self._process_slots.get(presence.seat)
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
        """Return why a write cannot be valid, "" if it can."""
        if message.seat not in self._process_slots:
            return f"a write by slot {message.seat}, which is none of the rack"
        if not 0 <= message.stamp <= latest_ns:
            return "a write at a time that cannot be"
        return "a write with a number that none has" if message.sequence > LARGEST_SEQUENCE else ""

    def of_image(self, message: BusImage, latest_ns: int) -> str:
        """Return why an image cannot be valid, "" if it can."""
        times = (*message.since_ns, *message.force_since_ns)
        if not all(INSTALLED_NS <= time_ns <= latest_ns for time_ns in times):
            return "an image with a time that cannot be"
        if not self._slots.issuperset((*message.seat, *message.force_seat)):
            return "an image with a slot that is none of the rack"
        most = max((message.sequence, *message.order, *message.force_order))
        return "an image with a number that none has" if most > LARGEST_SEQUENCE else ""


def write_message(batch: Batch, run_id: int, process: int) -> BusWrite:
    """Return a batch as a message of one process in one run."""
    values = values_of(batch.entries)
    return BusWrite(
        batch.time_ns, run_id, process, batch.process_slot, batch.sequence, batch.writer, int(batch.kind), values
    )


def batch_of(message: BusWrite, texts: Collection[int]) -> Batch:
    """Return the writes of a message; ``texts`` are the views of STRING variables.

    Raises:
        CdrError: the message is not one that a process of a rack sends.
    """
    try:
        kind = WriteKind(message.kind)
    except ValueError:
        raise CdrError(f"{message.kind} is not a kind of write") from None
    entries = tuple(_entries(message.values, texts))
    return Batch(message.seat, message.sequence, message.stamp, message.writer, kind, entries)


def image_message(picture: ImageCopy, now_ns: int, run_id: int, process: int, asked_by: int) -> BusImage:
    """Return the image of a process as a message for the process that requested it."""
    values = [(item.view, item.element, item.value) for item in picture.values]
    versions = [(item.mask, *item.version) for item in picture.values]
    forces = [(item.view, item.element, float(item.value), item.held, *item.version) for item in picture.forces]
    columns = (*_columns(versions, 4), *_columns(forces, 7))
    return BusImage(now_ns, run_id, process, picture.sequence, asked_by, values_of(values), *columns)


def image_of(message: BusImage, texts: Collection[int]) -> ImageCopy:
    """Return the image in a message; ``texts`` are the views of STRING variables.

    Raises:
        CdrError: the message is not one that a process of a rack sends.
    """
    try:
        since = zip(message.since_ns, message.seat, message.order, strict=True)
        values = zip(_entries(message.values, texts), message.mask, since, strict=True)
        held = tuple(
            VersionedValue(view, element, value, mask, version) for (view, element, value), mask, version in values
        )
        keys = (message.force_variable, message.force_element, message.force_value, message.force_held)
        since = zip(message.force_since_ns, message.force_seat, message.force_order, strict=True)
        forces = tuple(HeldForce(*force) for force in zip(*keys, since, strict=True))
    except ValueError:
        raise CdrError("an image whose parts differ in length") from None
    return ImageCopy(message.sequence, held, forces)


def stop_state_of(presence: Presence) -> StopState:
    """Return the operating state of the rack in a process's presence."""
    cause = None
    if presence.stopped:
        code = presence.stopped_code or None
        cause = StopCause(presence.standing_ns, presence.stopped_reason, code, presence.stopped_task)
    return StopState(presence.standing_ns, presence.standing_seat, cause)


def with_stop_state(presence: Presence, standing: StopState) -> Presence:
    """Return a process's presence with the operating state of the rack."""
    cause = standing.cause
    return presence._replace(
        stopped=cause is not None,
        standing_ns=standing.at_ns,
        standing_seat=standing.process_slot,
        stopped_code=(cause.code or "") if cause else "",
        stopped_task=cause.task if cause else "",
        stopped_reason=cause.reason[:500] if cause else "",
    )


def _columns(rows: Sequence[tuple[Any, ...]], number: int) -> Iterator[list[Any]]:
    return ([row[place] for row in rows] for place in range(number))


def _entries(values: Values, texts: Collection[int]) -> Iterator[tuple[int, int, Value]]:
    """Yield view, element and value; strings are in a list of their own, in order, each with a 0 among the numbers."""
    if not len(values.variable) == len(values.element) == len(values.value):
        raise CdrError("values whose parts differ in length")
    strings = iter(values.text)
    for view, element, value in zip(values.variable, values.element, values.value, strict=True):
        yield view, element, next(strings, "") if view in texts else value
