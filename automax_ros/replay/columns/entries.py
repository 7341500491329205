"""Values of common variables in many messages, concatenated in plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.types import DataType
from automax_ros.rackfile.model.config import CommonVariable

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Entries:
    """Entries of messages: message k has those from ``offsets[k]`` to before ``offsets[k + 1]``."""

    offsets: Ints
    views: Ints
    elements: Ints
    values: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def counts(self) -> Ints:
        """The number of entries of each message."""
        return np.diff(self.offsets)

    def part(self, begin: int, end: int) -> Entries:
        """Return the entries of the messages from ``begin`` to before ``end``."""
        offsets = self.offsets[begin : end + 1]
        first, last = int(offsets[0]), int(offsets[-1])
        return Entries(offsets - first, self.views[first:last], self.elements[first:last], self.values[first:last])


class ValueRules:
    """The possible values of a rack's ``count`` variables, by number; strings have none here.

    Each has a number of ``elements``, a ``least`` and a ``greatest`` value, and may be a ``real``.
    """

    def __init__(self, variables: Sequence[CommonVariable]) -> None:
        count = len(variables)
        self.count = count
        # The last item of each is for variables that the rack does not have: no value fits it.
        self.real = np.array([*(item.type is DataType.REAL for item in variables), False], bool)
        self.elements = np.array([*(item.elements for item in variables), 0], np.int64)
        ranges = [*(item.type.range if item.type is not DataType.STRING else (1, 0) for item in variables), (1, 0)]
        self.least = np.array([low for low, _ in ranges], np.float64)
        self.greatest = np.array([high for _, high in ranges], np.float64)


def first_other(recorded: Entries, own: Entries) -> int:
    """Return the first message whose entries differ, values bit for bit, or the number of messages."""
    count = min(len(recorded), len(own))
    other_counts = np.flatnonzero(recorded.offsets[1 : count + 1] != own.offsets[1 : count + 1])
    if len(other_counts):
        count = int(other_counts[0])
    total = int(recorded.offsets[count])
    same = recorded.views[:total] == own.views[:total]
    same &= recorded.elements[:total] == own.elements[:total]
    same &= recorded.values[:total].view(np.int64) == own.values[:total].view(np.int64)
    return count if same.all() else int(np.searchsorted(recorded.offsets, int(np.argmin(same)), side="right")) - 1
