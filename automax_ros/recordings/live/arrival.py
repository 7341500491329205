"""Puts messages that came over several topics into the order in which they were sent.

ROS keeps the order within a topic only. A rack sends all its messages from one thread, each with the time of sending:
these times are the order. A message is held back until whatever was sent before it must have come.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from operator import itemgetter
from typing import Generic, TypeVar

Item = TypeVar("Item")
_SENT = itemgetter(0)


class SendOrder(Generic[Item]):
    """Holds messages until ``hold_ns`` have passed here since one that was sent later was taken.

    Times of sending are compared with each other alone, times of here likewise: the clocks may differ.
    """

    def __init__(self, hold_ns: int) -> None:
        self._hold_ns = hold_ns
        self._waiting: list[tuple[int, Item]] = []
        self._marks: deque[tuple[int, int]] = deque()
        self._newest = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, sent_ns: int, item: Item) -> None:
        """Take a message that was sent at a time of the sender's clock."""
        self._waiting.append((sent_ns, item))
        self._newest = max(self._newest, sent_ns)

    def due(self, now_ns: int) -> list[tuple[int, Item]]:
        """Return (time of sending, message) of those whose turn has come, in order.

        ``now_ns`` is the time here at which the look at the topics began that took the messages added last.
        """
        self._marks.append((now_ns, self._newest))
        mark = -1
        while self._marks and self._marks[0][0] <= now_ns - self._hold_ns:
            mark = self._marks.popleft()[1]
        if mark < 0 or not self._waiting:
            return []
        self._waiting.sort(key=_SENT)
        end = bisect_right(self._waiting, mark, key=_SENT)
        found, self._waiting = self._waiting[:end], self._waiting[end:]
        return found

    def rest(self) -> list[tuple[int, Item]]:
        """Return all that waits, in order."""
        found = sorted(self._waiting, key=_SENT)
        self._waiting = []
        return found
