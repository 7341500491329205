"""Common memory as recorded so far, from which every task's scans read in a replay."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Value
from automax_ros.messages.types.messages import CommonImage, CommonWrite
from automax_ros.rack.base.views import backplane_of, view_specs
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.recordings.read.common_log import CommonLog, Entry, Key
from automax_ros.recordings.read.run_facts import RunFacts
from automax_ros.runtime.memory.registers import RegisterMap

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
_FORCES_KEPT = 1000
"""Changes of the force table that are remembered, including those by an image (decision: a bound on memory)."""


class UnknownValue(Exception):
    """A scan needs a value that is not in the recording; ``key`` identifies it."""

    def __init__(self, key: Key) -> None:
        super().__init__(key)
        self.key = key


class RecordedCommons(CommonLog):
    """All of common memory as recorded so far; ``rack`` are the variables of the recorded rack.

    ``backplane`` finds the registers of its modules.
    ``asked_back``: forces at an instant before the first message were needed.
    ``gaps`` counts places where writes are missing; after one nothing is known until the next image. ``forced`` are the
    forced values.
    """

    def __init__(self, bag: Path, facts: RunFacts, rack: RackConfig) -> None:
        super().__init__(bag, facts)
        self.rack = rack.variables
        self.backplane = backplane_of(rack)
        self.registers = RegisterMap(view_specs(rack.variables))
        self.gaps = 0
        self.forced: frozenset[Key] = frozenset()
        self._forced_before: deque[tuple[int, frozenset[Key]]] = deque(maxlen=_FORCES_KEPT)
        self.asked_back = False
        self._since: int | None = None
        self._start: list[int] = []
        size = 0
        for item in rack.variables:
            self._start.append(size)
            size += item.elements
        self._begins = np.array(self._start, np.int64)
        self._cells: list[Value | None] = [None] * size

    def take(self, message: CommonImage | CommonWrite) -> list[Entry] | None:
        """Apply a message of the write log; return its entries, None if they were known already.

        Raises:
            BagError: it does not fit the variables of the rack.
        """
        entries = super().take(message)
        if entries is not None:
            if self._since is None:
                self._since = message.stamp
            self._put(entries)
            self._follow_forces(message)
        return entries

    @property
    def carried(self) -> tuple[object, ...]:
        """All that is known so far, except the times at which forces changed."""
        return self._cells, self._log.sequence, self.gaps > 0, sorted(self.forced)

    @property
    def knows_no_force(self) -> bool:
        """Whether no force has ever held, as far as recorded."""
        return not self.forced and not self._forced_before

    def value(self, key: Key) -> Value:
        """Return the present value.

        Raises:
            UnknownValue: it has not been recorded.
        """
        value = self._cells[self._start[key[0]] + key[1]]
        if value is None:
            raise UnknownValue(key)
        return value

    def is_known(self, key: Key) -> bool:
        """Return whether a value has been recorded."""
        return self._cells[self._start[key[0]] + key[1]] is not None

    def forced_at(self, stamp: int) -> frozenset[Key]:
        """Return the values forced at a recent instant: a modeled scan is in the log where it ended."""
        if self._since is None or stamp < self._since:
            self.asked_back = True
        forced = self.forced
        for changed_at, before in reversed(self._forced_before):
            if changed_at <= stamp:
                break
            forced = before
        return forced

    def unforced_since(self, stamp: int) -> bool:
        """Return whether it is known that no force has held from an instant on."""
        is_told = self._since is not None and stamp >= self._since
        return is_told and not self.forced and all(changed_at <= stamp for changed_at, _ in self._forced_before)

    def take_many(self, sequences: Ints, views: Ints, elements: Ints, values: Floats) -> bool:
        """Apply the entries of consecutive writes of this run, which fit the variables; no force is among them.

        Returns FALSE, with nothing applied, if they do not follow the last known write.
        """
        log = self._log
        if log.sequence is None or int(sequences[0]) != log.sequence + 1:
            return False
        log.sequence = self._last_write = int(sequences[-1])
        cells = self._begins[views] + elements
        newest = np.full(len(self._cells), -1, np.int64)
        np.maximum.at(newest, cells, np.arange(len(cells)))
        last = newest[newest >= 0]
        chosen = (views[last].tolist(), cells[last].tolist(), values[last].tolist())
        for view, cell, value in zip(*chosen, strict=True):
            typed = self._kinds[view][0]
            assert typed is not None
            self._cells[cell] = typed(value)
        return True

    def _odd(self, name: str, value: float) -> Value:
        raise ValueError(f"{name} cannot be {value!r}")

    def _bridge(self, missing: int, message: CommonImage | CommonWrite) -> None:  # noqa: ARG002
        self.gaps += 1
        self._cells = [None] * len(self._cells)

    def _follow_forces(self, message: CommonImage | CommonWrite) -> None:
        """Update the forced values: forces and releases change them, and after an image they are recorded again."""
        if isinstance(message, CommonImage):
            self._hold(frozenset(), message.stamp)
            return
        keys = zip(message.values.variable, message.values.element, strict=False)
        if message.kind == WriteKind.FORCE:
            self._hold(self.forced.union(keys), message.stamp)
        elif message.kind == WriteKind.RELEASE:
            self._hold(self.forced.difference(keys), message.stamp)

    def _hold(self, forced: frozenset[Key], stamp: int) -> None:
        if forced != self.forced:
            self._forced_before.append((stamp, self.forced))
            self.forced = forced

    def _put(self, entries: Iterable[Entry]) -> None:
        cells, start = self._cells, self._start
        for view, element, value in entries:
            cells[start[view] + element] = value
