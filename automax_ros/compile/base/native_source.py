"""What the translation of a task to C gives: its text and what the host must know of it, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass

NOT_KEPT = "a run this short gains nothing by building it, and no other has (--native on)"
"""Why a task is in Python that is only looked for in the cache, and not there."""


class NotNative(Exception):
    """A task cannot be native, or not here; it runs in Python, bit for bit the same.

    ``reason`` says what keeps it from that and, where something can be done, what to do; ``line`` is the BASIC line
    that cannot be translated, 0 where it is none.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        """Take the reason, and the line of the task."""
        super().__init__(f"line {line}: {reason}" if line else reason)
        self.reason, self.line = reason, line


@dataclass(frozen=True)
class NativeSource:
    """A task as C.

    Attributes:
        name: the task's name.
        text: the C text, complete in itself: it begins with ``abi.h`` and includes headers of the C library alone.
        limits: for each field of the layout the least and the greatest integer that the translation takes for granted;
            a state beyond them, such as a snapshot may bring, scans in Python. () where none but 64 bits are.
    """

    name: str
    text: str
    limits: tuple[tuple[int, int], ...] = ()
