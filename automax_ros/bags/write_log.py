"""How far the write log of one run is known, by the numbers of its messages; for every reader and recorder of it."""

from __future__ import annotations


class WriteLog:
    """Follows the write log of a run. ``sequence`` is the number of the last write that is known, None before any."""

    def __init__(self, run_id: int) -> None:
        self.run_id = run_id
        self.sequence: int | None = None

    def missing(self, sequence: int, *, image: bool) -> int:
        """Return how many writes are missing before a message, negative if all that it tells is known.

        An image contains the write whose number it has, a write comes after the one before it.
        """
        if self.sequence is None:
            return 0
        return sequence - self.sequence - (0 if image else 1)
