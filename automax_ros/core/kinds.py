"""Enumerations whose numbers stand in messages and recordings: those of the constants in msg_defs/."""

from __future__ import annotations

import enum


class WriteKind(enum.IntEnum):
    """How a value came into common memory: ``CommonWrite.kind``.

    FORCE and RELEASE are entries of the write log too: they tell from when to when a view is held.
    """

    COMMIT = 1
    BASIC = 2
    OUTSIDE = 3
    FORCE = 4
    RELEASE = 5


class WriterKind(enum.IntEnum):
    """Who writes common memory: ``Writer.kind``."""

    TASK = 1
    ROS = 2
    PRESET = 3
    IO = 4
    PLANT = 5
    OPERATOR = 6
    FORCE = 7


class Direction(enum.IntEnum):
    """What ROS 2 sees of a common variable, and may do with it: ``Variable.direction``."""

    CLOSED = 0
    OUT = 1
    IN = 2
