"""How a recording is stored: compression, size of its files, time of its chunks."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.core.ticks import NS_PER_S

CHUNK_NS = NS_PER_S // 2
"""A chunk ends with each of these times of the messages, ns (decision: one is open and one is being written, so a
killed process loses a second at most)."""
COMPRESSIONS = {"zstd": "zstd", "lz4": "lz4", "none": ""}
"""How chunks can be compressed: the word for it, and what the file calls it."""
MIN_SPLIT_BYTES = 1 << 16
"""Smallest size to split a recording at (decision): a smaller file holds little but the facts at its beginning."""


@dataclass(frozen=True)
class StorageOptions:
    """How a recording is stored.

    ``compression`` is a key of COMPRESSIONS. A file ends when it has ``split_bytes`` bytes, 0 for never. A chunk ends
    each ``chunk_ns`` of the messages' time: a killed process loses two of them at most.
    """

    compression: str = "zstd"
    split_bytes: int = 0
    chunk_ns: int = CHUNK_NS

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ValueError: an unknown compression, or a size or time out of range.
        """
        if self.compression not in COMPRESSIONS:
            raise ValueError(f"{self.compression!r} is not a compression: there are {', '.join(COMPRESSIONS)}")
        if self.split_bytes and self.split_bytes < MIN_SPLIT_BYTES:
            raise ValueError(
                f"files of {self.split_bytes} bytes are too small: at least {MIN_SPLIT_BYTES}, or 0 for no limit"
            )
        if self.chunk_ns <= 0:
            raise ValueError(f"chunks of {self.chunk_ns} ns")
