"""What processes of one rack exchange, as messages and back. Both ends hold the same rack file: variables are numbers.

Times are instants of rack time on the wire, too: all processes of a run share its beginning.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Value
from automax_ros.rack.bus.link import Batch, HeldForce, Picture, Standing
from automax_ros.rack.bus.versions import Held
from automax_ros.rack.standing import StopCause
from automax_ros.wire.bus_messages import BusImage, BusWrite, Presence
from automax_ros.wire.cdr_parts import CdrError
from automax_ros.wire.qos import QosProfile
from automax_ros.wire.values import Values, values_of

BUS = QosProfile("reliable", "volatile", "keep_last", 1000)
"""Writes and images between processes: every message counts."""


def write_message(batch: Batch, run_id: int, process: int) -> BusWrite:
    """Return a batch as a message of one process in one run."""
    values = values_of(batch.entries)
    return BusWrite(batch.time_ns, run_id, process, batch.seat, batch.sequence, batch.writer, int(batch.kind), values)


def batch_of(message: BusWrite, texts: Collection[int]) -> Batch:
    """Return the writes of a message; ``texts`` are the views of STRING variables.

    Raises:
        CdrError: it is not one that a process of a rack sends.
    """
    try:
        kind = WriteKind(message.kind)
    except ValueError:
        raise CdrError(f"{message.kind} is not a kind of write") from None
    entries = tuple(_entries(message.values, texts))
    return Batch(message.seat, message.sequence, message.stamp, message.writer, kind, entries)


def image_message(picture: Picture, now_ns: int, run_id: int, process: int, asked_by: int) -> BusImage:
    """Return what a process holds as a message for the one that has asked."""
    values, forces = picture.values, picture.forces
    return BusImage(
        now_ns,
        run_id,
        process,
        picture.sequence,
        asked_by,
        values_of([(held.view, held.element, held.value) for held in values]),
        [held.mask for held in values],
        [held.version[0] for held in values],
        [held.version[1] for held in values],
        [held.version[2] for held in values],
        [force.view for force in forces],
        [force.element for force in forces],
        [float(force.value) for force in forces],
        [force.held for force in forces],
        [force.version[0] for force in forces],
        [force.version[1] for force in forces],
        [force.version[2] for force in forces],
    )


def picture_of(message: BusImage, texts: Collection[int]) -> Picture:
    """Return what a process holds; ``texts`` are the views of STRING variables.

    Raises:
        CdrError: it is not one that a process of a rack sends.
    """
    try:
        since = zip(message.since_ns, message.seat, message.order, strict=True)
        values = zip(_entries(message.values, texts), message.mask, since, strict=True)
        held = tuple(Held(view, element, value, mask, version) for (view, element, value), mask, version in values)
        keys = (message.force_variable, message.force_element, message.force_value, message.force_held)
        since = zip(message.force_since_ns, message.force_seat, message.force_order, strict=True)
        forces = tuple(HeldForce(*force) for force in zip(*keys, since, strict=True))
    except ValueError:
        raise CdrError("an image whose parts differ in length") from None
    return Picture(message.sequence, held, forces)


def standing_of(presence: Presence) -> Standing:
    """Return how the rack stands by the word of a process."""
    cause = None
    if presence.stopped:
        code = presence.stopped_code or None
        cause = StopCause(presence.standing_ns, presence.stopped_reason, code, presence.stopped_task)
    return Standing(presence.standing_ns, presence.standing_seat, cause)


def with_standing(presence: Presence, standing: Standing) -> Presence:
    """Return a process's word with how the rack stands."""
    cause = standing.cause
    return presence._replace(
        stopped=cause is not None,
        standing_ns=standing.at_ns,
        standing_seat=standing.seat,
        stopped_code=(cause.code or "") if cause else "",
        stopped_task=cause.task if cause else "",
        stopped_reason=cause.reason[:500] if cause else "",
    )


def _entries(values: Values, texts: Collection[int]) -> Iterator[tuple[int, int, Value]]:
    """Yield view, element and value; strings stand apart, in order, with a 0 for each among the numbers."""
    if not len(values.variable) == len(values.element) == len(values.value):
        raise CdrError("values whose parts differ in length")
    strings = iter(values.text)
    for view, element, value in zip(values.variable, values.element, values.value, strict=True):
        yield view, element, next(strings, "") if view in texts else value
