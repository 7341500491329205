"""Quality of service of the topics in a recording, as data."""

from __future__ import annotations

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
