"""How a process of a distributed rack is called: as its first module."""

from __future__ import annotations

from collections.abc import Collection

from automax_ros.rack.config import RackConfig


def part_name(config: RackConfig, slots: Collection[int]) -> str:
    """Return the name of the process that has the modules of some slots; ``slot N`` where the rack has none there."""
    first = min(slots, default=config.home_slot)
    return next((module.name for module in config.modules if module.slot == first), f"slot {first}")
