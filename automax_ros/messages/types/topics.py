"""Topics of a stream, and what takes their messages.

Quality of service of the topics in a recording, as data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

_INFINITE = {"sec": 9223372036, "nsec": 854775807}
"""How ROS 2 writes a duration without end."""


@dataclass(frozen=True)
class QosProfile:
    """The four policies that our topics set; the others keep their defaults."""

    reliability: str
    durability: str
    history: str
    depth: int

    def as_yaml_data(self) -> dict[str, object]:
        """The profile as ``offered_qos_profiles`` of bag metadata lists it (version 9: policies by name)."""
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
"""The last message waits for late joiners."""
VALUE = LATCHED
"""The value of a common variable."""
OPERATION = QosProfile("reliable", "transient_local", "keep_last", 100)
"""What was done last waits for late joiners, oldest first (decision: 100 operations)."""
SCAN = QosProfile("reliable", "volatile", "keep_last", 1000)
"""A stream of which every message counts."""
NETWORK = QosProfile("best_effort", "volatile", "keep_last", 256)
"""What comes again in 5.5 ms: one that is lost is not sent again, nobody waits for a slow reader (decision)."""
PLANT = QosProfile("reliable", "volatile", "keep_last", 100)
"""A second of a plant's samples (decision)."""


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
