"""The messages between the processes of one rack, as Python tuples with names: no recording holds them.

A time (``builtin_interfaces/Time``) is an integer of nanoseconds.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import NamedTuple

from automax_ros.wire.values import NO_VALUES, Values


class Stage(enum.IntEnum):
    """How far a process is: ``Presence.state``."""

    JOINING = 0
    READY = 1
    RUNNING = 2
    LEAVING = 3


class BusWrite(NamedTuple):
    """Writes of one process to common memory, for the others."""

    stamp: int
    run_id: int
    process: int
    seat: int
    sequence: int
    writer: int
    kind: int
    values: Values


class BusImage(NamedTuple):
    """What one process holds of common memory, for one that joins or that has missed a message."""

    stamp: int
    run_id: int
    process: int
    sequence: int
    asked_by: int
    values: Values = NO_VALUES
    mask: Sequence[int] = ()
    since_ns: Sequence[int] = ()
    seat: Sequence[int] = ()
    order: Sequence[int] = ()
    force_variable: Sequence[int] = ()
    force_element: Sequence[int] = ()
    force_value: Sequence[float] = ()
    force_held: Sequence[bool] = ()
    force_since_ns: Sequence[int] = ()
    force_seat: Sequence[int] = ()
    force_order: Sequence[int] = ()


class Presence(NamedTuple):
    """A process says that it lives, how far it is, and how the rack stands as it knows it."""

    stamp: int
    rack: str
    run_id: int
    process: int
    seat: int
    slots: Sequence[int]
    fingerprint: int
    state: int
    epoch_ns: int = 0
    sequence: int = 0
    asks: int = 0
    stopped: bool = False
    standing_ns: int = 0
    standing_seat: int = 0
    stopped_code: str = ""
    stopped_task: str = ""
    stopped_reason: str = ""
    host: str = ""
    pid: int = 0
