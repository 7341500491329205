"""State of a rack, and a number for its file and sources."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.types import Value
from automax_ros.drive.base.state import SavedState
from automax_ros.rack.base.stop_cause import OperationsState
from automax_ros.rack.modules.module import ModuleState


@dataclass(frozen=True)
class RackState:
    """All state on which the future of a rack depends, apart from its configuration and sources.

    ``image`` is (view, element, value) of all of memory, ``forced`` the forced elements, ``under_forces`` their values
    without the forces; ``events`` are kept for the next task that waits. ``modules`` by slot exclude their ``plants``.
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


def digest_of(text: str, sources: Mapping[str, SourceText]) -> int:
    """Return a number of 63 bits that a rack's file and its sources determine."""
    digest = hashlib.sha256(text.encode())
    for name, source in sorted(sources.items()):
        digest.update(name.encode() + b"\0" + source.text.encode() + b"\0")
    return int.from_bytes(digest.digest()[:8], "big") >> 1
