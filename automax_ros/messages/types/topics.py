"""Topics of a stream, their quality of service as data, and the sinks of their messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

_INFINITE = {"sec": 9223372036, "nsec": 854775807}
"""The infinite duration, as ROS 2 writes it."""


Take = Callable[[int, bytes], None]
"""Receives a message of one topic: its stamp in ns, its CDR bytes."""


@dataclass(frozen=True)
class QosProfile:
    """The four policies that our topics set; the others keep their defaults."""

    reliability: str
    durability: str
    history: str
    depth: int

    def as_yaml_data(self) -> dict[str, object]:
        """Return the profile as in ``offered_qos_profiles`` of bag metadata (version 9: policies by name)."""
        return {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": dict(_INFINITE),
            "lifespan": dict(_INFINITE),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_INFINITE),
            "avoid_ros_namespace_conventions": False,
        }


LATCHED = QosProfile("reliable", "transient_local", "keep_last", 1)
"""The last message is kept for late joiners."""
VALUE = LATCHED
"""The value of a common variable."""
OPERATION = QosProfile("reliable", "transient_local", "keep_last", 100)
"""The last operations are kept for late joiners, oldest first (decision: 100 operations)."""
SCAN = QosProfile("reliable", "volatile", "keep_last", 1000)
"""A stream of which every message counts."""
NETWORK = QosProfile("best_effort", "volatile", "keep_last", 256)
"""Messages that are repeated after 5.5 ms: a lost one is not sent again, a slow reader is not waited for (decision)."""
PLANT = QosProfile("reliable", "volatile", "keep_last", 100)
"""A second of a plant's samples (decision)."""


@dataclass(frozen=True)
class Topic:
    """A topic of the stream: full name, ROS type, quality of service; ``slot`` of the module that publishes on it.

    If several modules publish on one topic, each has its own Topic. ``slot`` None is the common memory. ``plant`` is
    the plant whose node publishes, "" if it is the module's own.
    """

    name: str
    type_name: str
    qos: QosProfile
    slot: int | None = None
    plant: str = ""


Sink = Callable[[Topic], Take | None]
"""Called once for each topic; returns the function that receives its messages, None if there is none."""
Takes = dict[Topic, Take]
"""The topics that a sink takes, with the functions that receive their messages."""
