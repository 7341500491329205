"""Reads files that nobody vouches for: regular files only, within a size, and within a folder."""

from __future__ import annotations

import stat
from pathlib import Path

MAX_BYTES = 1_000_000
"""Largest rack file and largest task source, in bytes (decision: a bound on untrusted files)."""


class FileFault(OSError):
    """A file cannot be used; ``too_large`` tells the one reason that has its own problem code."""

    def __init__(self, message: str, *, too_large: bool = False) -> None:
        """Keep the reason."""
        super().__init__(message)
        self.too_large = too_large


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Return what a regular file holds.

    Raises:
        FileFault: the file does not exist, is no regular file, cannot be read, or has more than ``limit`` bytes.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise FileFault("is not a file" if not path.is_dir() else "is a folder, not a file")
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except FileFault:
        raise
    except (OSError, ValueError, RuntimeError) as error:
        raise FileFault(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if len(data) > limit:
        raise FileFault(f"has more than {limit} bytes", too_large=True)
    return data


def is_inside(path: Path, folder: Path) -> bool:
    """Whether a path, all symbolic links followed, ends inside a folder; FALSE where that cannot be told."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False
