"""Tells apart, of the writes of a recording, what somebody wrote and what changed with it.

A write to a point of a module is in the log with what it changed on the same registers: the word of a bit, the bits of
a word. Only the write itself is done again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence

from automax_ros.core.types import Value
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.replay.rerun.events import Entry
from automax_ros.replay.scans.commons import RecordedCommons, UnknownValue

Read = Callable[[int, int], Value]
"""Returns the value of a view's element."""


class Causes:
    """Follows the writes of one recording, whose commons stand before each of them."""

    def __init__(self, commons: RecordedCommons, config: RackConfig) -> None:
        self._commons, self._variables = commons, config.variables
        self._expected: deque[Entry] = deque()
        self._expected_of: tuple[int, int] = (-1, -1)

    def of(self, entries: Sequence[Entry], now: int, writer: int) -> tuple[tuple[Entry, ...], tuple[Entry, ...]]:
        """Return the entries that a writer wrote at an instant (ns), and those that changed with them.

        What one message has not told of the changes the next one of the same writer and instant may.
        """
        if (now, writer) != self._expected_of:
            self._expected.clear()
            self._expected_of = now, writer
        overlay: dict[tuple[int, int], Value] = {}
        causes: list[Entry] = []
        shown: list[Entry] = []

        def read(view: int, element: int) -> Value:
            found = overlay.get((view, element))
            return self._commons.value((view, element)) if found is None else found

        for entry in entries:
            view, element, value = entry
            if self._expected and self._expected[0] == entry:
                self._expected.popleft()
                shown.append(entry)
            else:
                causes.append(entry)
                self._expected = deque(self._consequences(view, element, value, read))
            overlay[view, element] = value
        return tuple(causes), tuple(shown)

    def _consequences(self, view: int, element: int, value: Value, read: Read) -> Iterator[Entry]:
        variable = self._variables[view]
        if variable.point is None and variable.bank is None:
            return
        try:
            for change in self._commons.registers.consequences(view, element, value, read):
                if change[:2] not in self._commons.forced:
                    yield change
        except UnknownValue:
            return
