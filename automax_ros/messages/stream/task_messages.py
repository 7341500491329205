"""One task's scans and states as messages, and as their bytes without making the messages.

A scan always repeats name, slot and variables of its task, so its bytes are those of a pattern with other numbers:
that takes a fifth of the codec's time. Rare content (texts, errors, full latches) is encoded by the codec.

``as_i16``, ``as_i32`` and ``as_i64`` return an unsigned number as the signed one of the same bits, the form in which
numbers are written into bytes one by one. They raise OverflowError if the number is negative, or has more bits.
"""

from __future__ import annotations

import struct
from collections.abc import Hashable, Sequence
from itertools import compress
from operator import ne
from typing import Final

from librt.strings import BytesWriter, write_i32_le, write_i64_le

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Latched, Value
from automax_ros.messages.cdr.cdr import CdrError, encoder
from automax_ros.messages.stream.templates import MessageTemplate, TemplateCache, prepared
from automax_ros.messages.types.messages import (
    HELD_MARK,
    NAMES,
    NO_VALUES,
    Scan,
    ScanError,
    TaskState,
    Values,
    as_values,
    values_of,
)
from automax_ros.runtime.scan.scan_record import ScanRecord
from automax_ros.runtime.tasks.task import Task

_PLAIN: Final = (1 << 62) - 1
"""Up to this number a comparison takes one step in compiled code."""


_new = tuple.__new__
"""Makes a message from a tuple of all its fields: the class itself takes three times as long, and a rack makes many."""
_MOST: Final = 0xFFFFFFFF
"""The greatest uint32."""
_HEAD = ("scan", "duration_ns", "skipped")
_VALUES = (("latched.value",), ("committed.value",))
_ENTRIES = (
    ("latched.variable",), ("latched.value",),
    ("read.variable",), ("read.element",), ("read.value",),
    ("written.variable",), ("written.element",), ("written.value",),
    ("committed.variable",), ("committed.value",),
)  # fmt: skip
"""The fields that vary if only the numbers of entries recur."""
_Columns = tuple[tuple[int, ...], tuple[int, ...], tuple[Value, ...]]
_NO_ENTRIES: _Columns = ((), (), ())


def as_i16(number: int) -> int:
    """Return the int16 with the bits of a uint16."""
    return number if 0 <= number < 1 << 15 else _wrap(number, 16)


def as_i32(number: int) -> int:
    """Return the int32 with the bits of a uint32."""
    return number if 0 <= number < 1 << 31 else _wrap(number, 32)


def as_i64(number: int) -> int:
    """Return the int64 with the bits of a uint64."""
    return number if 0 <= number <= _PLAIN else _wrap(number, 64)


def _wrap(number: int, bits: int) -> int:
    if not 0 <= number < 1 << bits:
        raise OverflowError(f"{number} does not fit an unsigned number of {bits} bits")
    return number - (1 << bits) if number >> (bits - 1) else number


class TaskMessages:
    """Makes the messages of one task as it is installed. A stamp is in ns."""

    def __init__(self, task: Task) -> None:
        layout = task.layout
        self.compiled = task.compiled
        self._task = task
        self._views = tuple(task.memory.view(name) for name in task.compiled.latched)
        self._layout_hash, self._source_hash = layout.hash, task.compiled.program.source_hash
        self._fields = [field.name for field in layout.fields]
        self._sizes = [field.size for field in layout.fields]
        self._latched: Latched | None = None
        self._scans, self._scans_by_length = TemplateCache(), TemplateCache()
        self._quiet: MessageTemplate | None = None
        self._alike_states: MessageTemplate | None = None
        self._encode_scan, self._encode_state = encoder(NAMES[Scan]), encoder(NAMES[TaskState])

    def scan(self, record: ScanRecord, stamp: int, *, full: bool) -> Scan:
        """Return the message of a scan; unless ``full``, only with what has changed in the latch since the last one."""
        latched, before = record.latched, self._latched
        self._latched = latched if record.scan else None
        if full or before is None or not record.scan:
            views = self._views
            changed = as_values(views, (0,) * len(views), latched) if latched else NO_VALUES
            return self._scan(record, stamp, changed, full=True)
        differs = () if latched == before else tuple(map(ne, latched, before))
        return self._scan(record, stamp, _changed_values(self._views, latched, differs), full=False)

    def scan_bytes(self, record: ScanRecord, stamp: int, *, full: bool) -> bytes:
        """Return the bytes of the same message.

        Raises:
            CdrError: a value does not fit its field.
        """
        before, latched = self._latched, record.latched
        if full or before is None or not record.scan or record.has_errors:
            return self._encode_scan(self.scan(record, stamp, full=full))
        self._latched = latched
        if record.has_accesses:
            return self._in_length(record, stamp, before)
        if latched != before or record.has_commits:
            return self._in_pattern(record, stamp, before)
        quiet = self._quiet
        if quiet is None:
            message = self._scan(record, stamp, NO_VALUES, full=False)
            self._quiet = quiet = prepared(message, ("stamp",), _HEAD)
        # Most scans end here: they are written number by number, which is faster than one packing in compiled code.
        first, second, third = quiet.constants
        data = BytesWriter()
        try:
            data.write(first)
            write_i32_le(data, stamp // NS_PER_S)
            write_i32_le(data, stamp % NS_PER_S)
            data.write(second)
            write_i64_le(data, as_i64(record.scan))
            write_i32_le(data, as_i32(_fitting(record.duration_ns)))
            write_i32_le(data, as_i32(_fitting(record.skipped)))
            data.write(third)
        except (ValueError, OverflowError) as error:
            raise CdrError(f"scan of task {self._task.name}: {error}") from error
        return data.getvalue()

    def state(self, stamp: int) -> TaskState:
        """Return the message of the task's present state."""
        values = self._task.snapshot()
        marks = [HELD_MARK + name for name in sorted(self._task.compiled.held)]
        return TaskState(
            stamp,
            self._task.slot,
            self._task.name,
            self._task.scan_number,
            self._layout_hash,
            self._source_hash,
            [*marks, *self._fields] if marks else self._fields,
            [*([0] * len(marks)), *self._sizes] if marks else self._sizes,
            [0.0 if isinstance(value, str) else float(value) for value in values],
            [value for value in values if isinstance(value, str)],
        )

    def state_bytes(self, stamp: int) -> bytes:
        """Return the bytes of the same message.

        Raises:
            CdrError: a value does not fit its field.
        """
        values = self._task.snapshot()
        if self._task.compiled.held or str in map(type, values):
            return self._encode_state(self.state(stamp))
        alike = self._alike_states
        if alike is None:
            self._alike_states = alike = prepared(self.state(stamp), ("stamp",), ("scan",), ("value",))
        seconds, rest = stamp // NS_PER_S, stamp % NS_PER_S
        first, second, third, last = alike.constants
        try:
            return alike.pack(first, seconds, rest, second, self._task.scan_number, third, *values, last)
        except struct.error as error:
            raise CdrError(f"state of task {self._task.name}: {error}") from error

    def _in_pattern(self, record: ScanRecord, stamp: int, before: Latched) -> bytes:
        """Return the bytes of a scan that has latched and committed the same variables as earlier ones."""
        latched, commits = record.latched, record.commits
        differs: tuple[bool, ...] = () if latched == before else tuple(map(ne, latched, before))
        views, values = zip(*commits, strict=True) if commits else ((), ())
        key = (differs, views)
        pattern = self._scans.known.get(key)
        if pattern is None:
            return self._learnt(key, self._scans, _VALUES, record, stamp, differs)
        seconds, rest = stamp // NS_PER_S, stamp % NS_PER_S
        constants = pattern.constants
        duration, skipped = _fitting(record.duration_ns), _fitting(record.skipped)
        try:
            return pattern.pack(
                constants[0],
                seconds,
                rest,
                constants[1],
                record.scan,
                duration,
                skipped,
                constants[2],
                *compress(latched, differs),
                constants[3],
                *values,
                constants[4],
            )
        except struct.error as error:
            raise CdrError(f"scan of task {self._task.name}: {error}") from error

    def _in_length(self, record: ScanRecord, stamp: int, before: Latched) -> bytes:
        """Return the bytes of a scan that read or wrote actual memory: as many values as earlier ones."""
        latched = record.latched
        differs: tuple[bool, ...] = () if latched == before else tuple(map(ne, latched, before))
        changed_views, changed = tuple(compress(self._views, differs)), tuple(compress(latched, differs))
        read_views, read_elements, read = _columns(record.reads)
        written_views, written_elements, written = _columns(record.writes)
        views, values = zip(*record.commits, strict=True) if record.commits else ((), ())
        key = (len(changed), len(read), len(written), len(values))
        pattern = self._scans_by_length.known.get(key)
        if pattern is None:
            return self._learnt(key, self._scans_by_length, _ENTRIES, record, stamp, differs)
        seconds, rest = stamp // NS_PER_S, stamp % NS_PER_S
        constants = pattern.constants
        duration, skipped = _fitting(record.duration_ns), _fitting(record.skipped)
        try:
            return pattern.pack(
                constants[0],
                seconds,
                rest,
                constants[1],
                record.scan,
                duration,
                skipped,
                constants[2],
                *changed_views,
                constants[3],
                *changed,
                constants[4],
                *read_views,
                constants[5],
                *read_elements,
                constants[6],
                *read,
                constants[7],
                *written_views,
                constants[8],
                *written_elements,
                constants[9],
                *written,
                constants[10],
                *views,
                constants[11],
                *values,
                constants[12],
            )
        except struct.error:
            # A text, which is stored elsewhere, or a value that does not fit: the codec decides.
            return self._encode_scan(
                self._scan(record, stamp, _changed_values(self._views, latched, differs), full=False)
            )

    def _learnt(
        self,
        key: Hashable,
        patterns: TemplateCache,
        groups: Sequence[Sequence[str]],
        record: ScanRecord,
        stamp: int,
        differs: Sequence[bool],
    ) -> bytes:
        message = self._scan(record, stamp, _changed_values(self._views, record.latched, differs), full=False)
        if not (message.latched.text or message.read.text or message.written.text or message.committed.text):
            patterns.learn(key, lambda: prepared(message, ("stamp",), _HEAD, *groups))
        return self._encode_scan(message)

    def _scan(self, record: ScanRecord, stamp: int, changed: Values, *, full: bool) -> Scan:
        committed = NO_VALUES
        if record.commits:
            variables, values = zip(*record.commits, strict=True)
            committed = as_values(variables, (0,) * len(variables), values)
        fields = (
            stamp,
            self._task.slot,
            self._task.name,
            record.scan,
            _fitting(record.duration_ns),
            _fitting(record.skipped),
            full,
            changed,
            values_of(record.reads),
            values_of(record.writes),
            committed,
            [ScanError(line, code) for line, code in record.errors] if record.errors else (),
        )
        return _new(Scan, fields)


def _fitting(number: int) -> int:
    return number if number <= _MOST else _MOST


def _columns(entries: Sequence[tuple[int, int, Value]]) -> _Columns:
    if not entries:
        return _NO_ENTRIES
    views, elements, values = zip(*entries, strict=True)
    return views, elements, values


def _changed_values(views: Sequence[int], latched: Latched, differs: Sequence[bool]) -> Values:
    if not differs:
        return NO_VALUES
    return as_values(tuple(compress(views, differs)), (0,) * sum(differs), tuple(compress(latched, differs)))
