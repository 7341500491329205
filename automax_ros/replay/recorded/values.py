"""Values of common memory, of plants and of webs over time, in arrays."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.types import DataType, Value, same_bits
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.messages.types.messages import PlantState, RollState, WebState
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.plant_signals import SIGNAL_KINDS
from automax_ros.recordings.read.common_log import Entry, Key

Course = tuple[NDArray[np.int64], NDArray[np.float64]]
"""Times in ns of the run, and the values from then on."""


class ValueLog:
    """All values of common memory over time; entries are taken in the order of the log."""

    def __init__(self, variables: Sequence[CommonVariable]) -> None:
        self._kinds = [variable.type for variable in variables]
        sizes = [variable.elements for variable in variables]
        self._starts = [0, *np.cumsum(sizes).tolist()]
        self._last: list[Value | None] = [None] * self._starts[-1]
        self._taken = array("q"), array("i"), array("d")
        self._texts: dict[str, int] = {}
        self._gaps: list[int] = []

    def take(self, time_ns: int, entries: Iterable[Entry], *, image: bool) -> None:
        """Add entries; of an image those that differ from what is known."""
        (times, cells, values), last, starts = self._taken, self._last, self._starts
        for view, index, value in entries:
            cell = starts[view] + index
            before = last[cell]
            if image and before is not None and same_bits(before, value):
                continue
            last[cell] = value
            times.append(time_ns)
            cells.append(cell)
            values.append(self._texts.setdefault(value, len(self._texts)) if isinstance(value, str) else value)

    def lose(self, time_ns: int) -> None:
        """Forget all values: writes are missing after this time."""
        self._gaps.append(time_ns)
        self._last = [None] * len(self._last)

    def __len__(self) -> int:
        return len(self._taken[0])

    def finish(self) -> None:
        """Sort what was taken by variable; ``first_ns`` is the time of the first value, 0 without one."""
        times, cells, values = (np.frombuffer(item, item.typecode) for item in self._taken)
        self.first_ns = int(times[0]) if len(times) else 0
        order = np.argsort(cells, kind="stable")
        self._times, self._values = times[order], values[order]
        self._bounds = np.searchsorted(cells[order], np.arange(len(self._last) + 1)).tolist()
        self._known = list(self._texts)
        self._taken, self._last = (array("q"), array("i"), array("d")), []

    def at(self, key: Key, at_ns: int) -> Value | None:
        """Return the value at a time, None if it is not known."""
        times, values = self.course(key)
        found = int(np.searchsorted(times, at_ns, "right")) - 1
        if found < 0 or bisect_left(self._gaps, at_ns) > bisect_left(self._gaps, int(times[found])):
            return None
        return self.typed(key, float(values[found]))

    def course(self, key: Key) -> Course:
        """Return all values of a simple variable or an element."""
        cell = self._starts[key[0]] + key[1]
        part = slice(self._bounds[cell], self._bounds[cell + 1])
        return self._times[part], self._values[part]

    def typed(self, key: Key, value: float) -> Value:
        """Return a value of a course in its variable's type."""
        kind = self._kinds[key[0]]
        return self._known[int(value)] if kind is DataType.STRING else typed(kind, value)


def typed(kind: DataType, value: float) -> Value:
    """Return a number in a type."""
    if kind is DataType.BOOLEAN:
        return bool(value)
    return value if kind is DataType.REAL or not math.isfinite(value) else int(value)


class SignalLog:
    """The signals of one thing over time: fields of its messages, by names with types."""

    def __init__(self, kinds: Mapping[str, DataType]) -> None:
        self._kinds, self._names = kinds, tuple(kinds)
        self._times, self._values = array("q"), array("d")

    def take(self, time_ns: int, state: PlantState | RollState | WebState) -> int:
        """Add a state; return how many values it has."""
        self._times.append(time_ns)
        self._values.extend(float(getattr(state, name)) for name in self._names)
        return len(self._names)

    def course(self, signal: str) -> Course:
        """Return all values of a signal."""
        values = np.frombuffer(self._values, np.float64).reshape(-1, len(self._names))
        return np.frombuffer(self._times, np.int64), values[:, self._names.index(signal)]

    def at(self, at_ns: int) -> Any:
        """Return the signals at a time, None before the first state."""
        found, size = bisect_right(self._times, at_ns) - 1, len(self._names)
        if found < 0:
            return None
        row = self._values[found * size : (found + 1) * size]
        return SimpleNamespace(
            **{name: typed(self._kinds[name], value) for name, value in zip(self._names, row, strict=True)}
        )


class PlantLog(SignalLog):
    """The states of one plant over time, with what was broken."""

    def __init__(self) -> None:
        super().__init__(SIGNAL_KINDS)
        self._faults: list[tuple[int, tuple[str, ...]]] = []

    def take(self, time_ns: int, state: PlantState | RollState | WebState) -> int:
        """Add a state; return how many values it has."""
        assert isinstance(state, PlantState)
        if not self._faults or self._faults[-1][1] != tuple(state.faults):
            self._faults.append((time_ns, tuple(state.faults)))
        return super().take(time_ns, state)

    def at(self, at_ns: int) -> Any:
        """Return the signals and faults at a time, None before the first state."""
        found = super().at(at_ns)
        if found is not None:
            found.faults = self._faults[bisect_right(self._faults, at_ns, key=lambda item: item[0]) - 1][1]
        return found


class DriveLogs:
    """The signals of all plants, of their rolls and rollers, and of webs, each by name."""

    def __init__(self) -> None:
        self.plants: dict[str, PlantLog] = {}
        self.rolls: dict[str, SignalLog] = {}
        self.webs: dict[str, SignalLog] = {}

    def take(self, time_ns: int, state: PlantState | RollState | WebState) -> int:
        """Add a state; return how many values it has."""
        if isinstance(state, PlantState):
            return self.plants.setdefault(state.plant, PlantLog()).take(time_ns, state)
        if isinstance(state, RollState):
            return self.rolls.setdefault(state.plant, SignalLog(END_KINDS)).take(time_ns, state)
        return self.webs.setdefault(state.web, SignalLog(WEB_KINDS)).take(time_ns, state)

    def of(self, name: str, signal: str) -> SignalLog | None:
        """Return the log that holds a signal of a plant or web, None if nothing of it is recorded."""
        logs = self.webs if signal in WEB_KINDS else self.rolls if signal in END_KINDS else self.plants
        return logs.get(name)
