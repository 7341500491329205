"""Which installation of the package this is: machines that work on one thing must have the same."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import automax_ros


@dataclass(frozen=True)
class Installation:
    """The version of the package, and a SHA-256 of all its sources."""

    version: str
    sources: str

    def __str__(self) -> str:
        return f"{self.version} (sources {self.sources[:12]})"


@lru_cache(maxsize=1)
def installation() -> Installation:
    """Return what is installed here."""
    folder = Path(automax_ros.__file__).parent
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        content = path.read_bytes()
        found.update(f"{path.relative_to(folder).as_posix()} {len(content)}\n".encode())
        found.update(content)
    return Installation(automax_ros.__version__, found.hexdigest())
