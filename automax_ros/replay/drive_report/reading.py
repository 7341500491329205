"""Reads a recording once for all parts of a report: commons, scans, writes from outside, plants, operations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from automax_ros.messages.types.messages import NAMES, Operation, Scan
from automax_ros.recordings.read.common_log import Cell
from automax_ros.recordings.tables.series import Progress, Series, Window
from automax_ros.replay.drive_report.happenings import ValuesSet


class PartReader(Protocol):
    """What one part of a report takes of a recording; times are ns from the start of the run.

    ``names`` are the labels of the values that it wants, ``types`` those of the messages besides Operation.
    """

    @property
    def names(self) -> Sequence[str]:
        """Labels of commons, locals and signals."""

    @property
    def types(self) -> Sequence[str]:
        """Names of types of messages."""

    def take_values(self, time_ns: int, changed: Mapping[str, Cell]) -> None:
        """Add the values that changed at an instant, by label."""

    def take_scan(self, time_ns: int, scan: Scan) -> None:
        """Add a scan."""

    def take_message(self, time_ns: int, message: Any) -> None:
        """Add a message of one of the types, or an Operation."""


class RunRead:
    """How the reading went: the rack's name, the end of the part that was read, ns, and the values set from outside."""

    def __init__(self, rack: str, end_ns: int, values_set: ValuesSet) -> None:
        self.rack, self.end_ns, self.values_set = rack, end_ns, values_set


def read_run(bag: Path, parts: Sequence[PartReader], window: Window, progress: Progress | None = None) -> RunRead:
    """Read a window of a recording into the parts of a report.

    Raises:
        BagError: the recording cannot be read, a name is unknown, or the window is empty.
    """
    values_set = ValuesSet()
    names = list(dict.fromkeys(name for part in parts for name in part.names))
    also = {NAMES[Operation]: partial(_hand_on, parts)}
    for kind in dict.fromkeys(kind for part in parts for kind in part.types):
        also[kind] = partial(_hand_on, [part for part in parts if kind in part.types])

    def take_scan(time_ns: int, scan: Scan) -> None:
        for part in parts:
            part.take_scan(time_ns, scan)

    series = Series(bag, names, window, progress, take_scan, values_set.take, also, brief=True)
    labels = [column.label for column in series.columns]
    wanted = [(part, frozenset(part.names)) for part in parts]
    takers = [[part for part, own in wanted if label in own] for label in labels]
    for time_ns, changed in series.changes():
        by_part: dict[int, tuple[PartReader, dict[str, Cell]]] = {}
        for column, value in changed.items():
            for part in takers[column]:
                by_part.setdefault(id(part), (part, {}))[1][labels[column]] = value
        for part, values in by_part.values():
            part.take_values(time_ns, values)
    return RunRead(series.rack, series.end_ns, values_set)


def _hand_on(parts: Sequence[PartReader], time_ns: int, message: Any) -> None:
    for part in parts:
        part.take_message(time_ns, message)
