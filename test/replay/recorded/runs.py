"""Recorded runs by time and scan, and what their messages say of each scan: what the tests of this folder share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import element_name
from automax_ros.core.types import DataType, Value, same_bits, type_of_name
from automax_ros.messages.types.messages import HELD_MARK, Scan, TaskState, Values
from automax_ros.recordings.read.common_log import CommonLog
from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.replay.recorded.lines import ScanLines
from automax_ros.replay.recorded.run import RecordedRun
from automax_ros.replay.recorded.task import RecordedTask
from automax_ros.replay.scans.state import recorded_fields


def run_of(bag: Path) -> RecordedRun:
    return RecordedRun(Replay(bag, {}, ReplayOptions()))


def task_of(run: RecordedRun, name: str) -> RecordedTask:
    return RecordedTask(run, name, run.replay)


def edited_replay(bag: Path, **tasks: str) -> Replay:
    sources = {name: SourceText(f"new/{name}.BLK", text) for name, text in tasks.items()}
    return Replay(bag, sources, ReplayOptions(only=tuple(tasks)))


class Messages:
    """What a recording's messages say of the scans of its tasks, read by nothing of the folder under test."""

    def __init__(self, bag: Path) -> None:
        self.bag, self._reader = bag, BagReader(bag)
        replay = Replay(bag, {}, ReplayOptions())
        self._log, self._variables = CommonLog(bag, replay.facts), replay.rack.config.variables
        self.scans: dict[str, list[Scan]] = {}
        self.states: dict[str, list[tuple[int, TaskState]]] = {}
        for entry in self._reader.messages():
            message = entry.message
            if isinstance(message, Scan):
                self.scans.setdefault(message.task, []).append(message)
            elif isinstance(message, TaskState):
                after = len(self.scans.get(message.task, ())) - 1
                self.states.setdefault(message.task, []).append((after, message))

    def written(self, scan: Scan) -> dict[str, Value]:
        """The commons that a scan left: BASIC statements wrote first, the blocks' outputs follow at END."""
        return {name: value for part in (scan.written, scan.committed) for name, value in self._named(part, scan)}

    def latched(self, scan: Scan) -> dict[str, Value]:
        return dict(self._named(scan.latched, scan))

    def _named(self, part: Values, scan: Scan) -> Iterator[tuple[str, Value]]:
        for view, index, value in self._log.reads(part, scan.stamp):
            if view < len(self._variables):
                yield element_name(self._variables[view], index), value


def assert_same(own: Mapping[str, Value], recorded: Mapping[str, Value], where: object) -> None:
    """Everything recorded is there, bit for bit."""
    for name, value in recorded.items():
        assert name in own, (where, name)
        assert same_bits(own[name], value), (where, name, value, own[name])


def left(lines: ScanLines) -> dict[str, Value]:
    """What the lines of a scan without jumps backwards left in the commons."""
    found: dict[str, Value] = {}
    for line in sorted(lines.after):
        found |= lines.after[line]
    return found


def own_in(messages: Messages, state: TaskState) -> dict[str, Value]:
    """The simple variables of a task in one of its states."""
    fields = recorded_fields(messages.bag, state)
    found: dict[str, Value] = {}
    for name, values in fields.items():
        plain = name != "PC" and not {" ", "."} & set(name) and not name.startswith(HELD_MARK)
        if len(values) == 1 and plain:
            (value,) = values
            kind = type_of_name(name)
            whole = kind in (DataType.INTEGER, DataType.DOUBLE)
            found[name] = bool(value) if kind is DataType.BOOLEAN else int(value) if whole else value
    return found
