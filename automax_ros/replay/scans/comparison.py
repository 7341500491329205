"""Compares the recorded scans of one task with the replayed ones."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import cast

from automax_ros.core.names import element_name
from automax_ros.core.types import Value, same_bits
from automax_ros.core.values import source_text
from automax_ros.language.tree.tree import Direction
from automax_ros.messages.types.messages import Scan
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.recordings.read.common_log import Entry, Key
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.compare import DifferenceCounts, Found, Label, Seen, within
from automax_ros.replay.scans.inputs import CHANNELS, ScanMemory
from automax_ros.replay.scans.report import Kind, NamedValue, errors_text
from automax_ros.replay.scans.stored_rack import ReplaySource
from automax_ros.runtime.scan.drive_record import COMMAND_VIEW, MEASURED_NAMES, MEASURED_VIEW
from automax_ros.runtime.tasks.task import ScanRecord


class ScanComparison:
    """Finds the differences in the scans of one task, with their names; ``source`` is executed now.

    Numbers that differ by at most ``tolerance`` count as equal.
    """

    def __init__(
        self,
        source: ReplaySource,
        commons: RecordedCommons,
        memory: ScanMemory,
        tallies: DifferenceCounts,
        tolerance: float,
    ) -> None:
        self.take_up(source)
        self._commons, self._memory, self._tallies, self._tolerance = commons, memory, tallies, tolerance
        self._record: ScanRecord | None = None

    def take_up(self, source: ReplaySource) -> None:
        """Switch to another source, after the recorded task was reloaded."""
        self._source, self._written_at = source, source.written_at

    def scan(self, scan: Scan, record: ScanRecord, changes: Sequence[tuple[Key, Value, Value]]) -> bool:
        """Compare a scan; return whether it differs."""
        self._record = record
        found = [
            Found(Kind.VARIABLE, key, recorded, own, not within(recorded, own, self._tolerance))
            for key, recorded, own in changes
        ]
        if not self._source.edited and not self._memory.writes_agree and not any(item.counts for item in found):
            found += self._other_writes(record.writes)
        found += self._other_messages()
        found += self._other_commands()
        if record.errors or scan.errors:
            found += self._other_errors(scan, record)
        return self.tally(scan.scan, scan.stamp, found)

    def tally(self, scan: int, stamp: int, found: list[Found]) -> bool:
        """Count the differences after a scan; return whether the scan differs."""
        return bool(self._tallies.scan(self._source.name, scan, stamp, found, self.label, self.seen))

    def label(self, kind: Kind, key: Hashable) -> Label:
        """Return the label of an item in the report."""
        if kind is Kind.VARIABLE:
            variable = self._variable(cast(Key, key))
            lines = self._written_at.get(variable.name, ())
            return Label(element_name(variable, cast(Key, key)[1]), variable.unit, lines)
        if kind is Kind.MESSAGE:
            return Label(f"message to channel #{key}")
        if kind is Kind.COMMAND:
            return Label(f"{key} commanded to the 57C406")
        words = {Kind.WRITES: "order of writes", Kind.ERRORS: "run-time errors", Kind.STATUS: "running"}
        return Label(words.get(kind) or f"state {key}")

    def seen(self) -> Seen:
        """Return the inputs of the last scan."""
        record = self._record
        if record is None:
            return Seen()
        names = self._source.compiled.latched
        latched = [NamedValue(name, value) for name, value in zip(names, record.latched, strict=False)]
        read = (entry for entry in record.reads[:1000] if entry[0] != COMMAND_VIEW)
        reads = [NamedValue(self._read_name(view, element), value) for view, element, value in read]
        return Seen(tuple(latched), tuple(reads))

    def _read_name(self, view: int, element: int) -> str:
        if view in CHANNELS:
            return f"channel #{element}"
        if view == MEASURED_VIEW:
            return f"57C406 {MEASURED_NAMES[element]}"
        return element_name(self._variable((view, element)), element)

    def _other_writes(self, writes: Sequence[Entry]) -> list[Found]:
        """Return the difference in the order of writes, although every variable ends up the same."""
        recorded = self._memory.recorded_writes
        for number in range(max(len(writes), len(recorded))):
            one = recorded[number] if number < len(recorded) else None
            other = writes[number] if number < len(writes) else None
            if one and other and one[:2] == other[:2] and self._is_same(one[2], other[2]):
                continue
            return [Found(Kind.WRITES, "writes", self._write_text(one), self._write_text(other))]
        return []

    def _other_messages(self) -> list[Found]:
        """Return the differences in the messages that a BASIC task sent to channels."""
        channels = self._memory.channels
        first: dict[int, Found] = {}
        for number, recorded, own in channels.other:
            counts = not self._alike(recorded, own)
            if counts or number not in first:
                texts = _message_text(recorded), _message_text(own)
                first.setdefault(number, Found(Kind.MESSAGE, number, *texts, counts))
        found = list(first.values())
        for file in (self._source.recorded or self._source.compiled).program.files:
            unsent = channels.unsent(file.number) if file.direction is Direction.OUTPUT else ()
            if unsent and file.number not in first:
                found.append(Found(Kind.MESSAGE, file.number, _message_text(unsent[1:] or unsent), "no message"))
        return found

    def _other_commands(self) -> list[Found]:
        """Return the differences in a loop's commands to its 57C406; with a tolerance they do not count (decision)."""
        counts = not self._tolerance
        return [Found(Kind.COMMAND, name, recorded, own, counts) for name, recorded, own in self._memory.drive.other()]

    def _alike(self, recorded: Sequence[Value], own: Sequence[Value]) -> bool:
        return len(recorded) == len(own) and all(map(self._is_same, recorded, own))

    def _is_same(self, recorded: Value, own: Value) -> bool:
        return same_bits(recorded, own) or within(recorded, own, self._tolerance)

    def _other_errors(self, scan: Scan, record: ScanRecord) -> list[Found]:
        """Return the difference in run-time errors; in an edited task lines do not count."""
        recorded = [(error.line, error.code) for error in scan.errors]
        own = list(record.errors)
        if self._source.edited:
            recorded, own = sorted((0, code) for _, code in recorded), sorted((0, code) for _, code in own)
        if recorded == own:
            return []
        return [Found(Kind.ERRORS, "errors", errors_text(recorded), errors_text(own))]

    def _write_text(self, entry: Entry | None) -> str:
        if entry is None:
            return "no write"
        return f"{element_name(self._variable(entry[:2]), entry[1])} = {source_text(entry[2])}"

    def _variable(self, key: Key) -> CommonVariable:
        return self._commons.rack[key[0]]


def _message_text(message: Sequence[Value]) -> str:
    return ", ".join(map(source_text, message))
