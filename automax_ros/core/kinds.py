"""Enumerations whose numbers are in messages and recordings: those of the constants in msg_defs/."""

from __future__ import annotations

import enum


class WriteKind(enum.IntEnum):
    """How a value was written to common memory: ``CommonWrite.kind``.

    FORCE and RELEASE are entries of the write log too: they are the start and end of a force.
    """

    COMMIT = 1
    BASIC = 2
    OUTSIDE = 3
    FORCE = 4
    RELEASE = 5


class WriterKind(enum.IntEnum):
    """The kind of a writer of common memory: ``Writer.kind``."""

    TASK = 1
    ROS = 2
    PRESET = 3
    IO = 4
    PLANT = 5
    OPERATOR = 6
    FORCE = 7


class Direction(enum.IntEnum):
    """Access of ROS 2 to a common variable: ``Variable.direction``."""

    CLOSED = 0
    OUT = 1
    IN = 2
