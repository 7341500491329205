"""A number for what a rack runs."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from automax_ros.core.diagnostics import SourceText


def digest_of(text: str, sources: Mapping[str, SourceText]) -> int:
    """Return a number of 63 bits that a rack's file and its sources determine."""
    digest = hashlib.sha256(text.encode())
    for name, source in sorted(sources.items()):
        digest.update(name.encode() + b"\0" + source.text.encode() + b"\0")
    return int.from_bytes(digest.digest()[:8], "big") >> 1
