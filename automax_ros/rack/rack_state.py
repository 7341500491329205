"""What a rack's future depends on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from automax_ros.core.types import Value
from automax_ros.drive.state import SavedState
from automax_ros.rack.modules.running import ModuleState
from automax_ros.rack.standing import OperationsState


@dataclass(frozen=True)
class RackState:
    """All that the future of a rack depends on, apart from its configuration and sources.

    ``image`` is (view, element, value) of all of memory, ``forced`` what is held, ``events`` those that are kept
    for the next who waits, ``clock_since_ns`` since when the common clock runs, ``modules`` by slot, ``plants`` by
    name: a module's state has nothing of its plant. ``under_forces`` is what ``forced`` would hold without the forces.
    """

    now_ns: int
    image: tuple[tuple[int, int, Value], ...]
    forced: frozenset[tuple[int, int]]
    events: tuple[str, ...]
    channels: tuple[Any, ...]
    operations: OperationsState
    clock_since_ns: int | None
    modules: Mapping[int, ModuleState]
    plants: Mapping[str, SavedState] = field(default_factory=dict)
    under_forces: tuple[tuple[int, int, Value], ...] = ()
