"""Topics of a stream, and what takes their messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.wire.qos import QosProfile


@dataclass(frozen=True)
class Topic:
    """A topic of the stream: full name, ROS type, quality of service; ``slot`` of the module that sends on it.

    Several modules send on one topic: each has a Topic of its own. ``slot`` None is the common memory. ``plant`` is the
    plant whose node sends, "" where it is the module's own.
    """

    name: str
    type_name: str
    qos: QosProfile
    slot: int | None = None
    plant: str = ""


Take = Callable[[int, bytes], None]
"""Takes a message of one topic: its stamp in ns, its CDR bytes."""
Sink = Callable[[Topic], Take | None]
"""Asked once for each topic: what takes its messages, None where nothing does."""
Takes = dict[Topic, Take]
"""What a sink takes."""
