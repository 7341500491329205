"""Divides C sources into parts, each compiled at once: headers are read only a few times, and all cores have work."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def parts(sources: Sequence[Path], part_bytes: int) -> list[list[Path]]:
    """Divide sources in their order: each part ends with the source that brings it to ``part_bytes`` or more."""
    divided: list[list[Path]] = []
    size = part_bytes
    for source in sources:
        if size >= part_bytes:
            divided.append([])
            size = 0
        divided[-1].append(source)
        size += source.stat().st_size
    return divided
