"""The write log of common memory as messages, and as their bytes without making the messages."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.messages.cdr.cdr import CdrError, encoder
from automax_ros.messages.stream.templates import TemplateCache, prepared
from automax_ros.messages.types.messages import NAMES, CommonWrite, values_of
from automax_ros.runtime.memory.views import WriteGroup

_VALUES = (("values.variable",), ("values.element",), ("values.value",))


class WriteMessages:
    """Makes the CommonWrites of one run and numbers them; ``sequence`` is the number of the last.

    ``slots`` has the slot of each writer by its id.
    """

    def __init__(self, slots: Mapping[int, int]) -> None:
        self.sequence = 0
        self._slots = slots
        self._patterns = TemplateCache()
        self._encode = encoder(NAMES[CommonWrite])

    def message(
        self, stamp: int, run_id: int, writer: int, kind: WriteKind, entries: Iterable[tuple[int, int, Value]]
    ) -> CommonWrite:
        """Return the next message: (view, element, value) that one writer has written at one instant."""
        self.sequence += 1
        values = values_of(tuple(entries))
        return CommonWrite(stamp, run_id, writer, self._slots[writer], int(kind), self.sequence, values)

    def packed(self, groups: Sequence[WriteGroup], epoch_ns: int, run_id: int) -> list[tuple[int, bytes]]:
        """Return stamp and bytes of the messages of a part of the write log; neighbours of one key are in one message.

        ``epoch_ns`` is added to rack time to give stamps.

        Raises:
            CdrError: a value does not fit its field.
        """
        if len(groups) == 1:
            group = groups[0]
            stamp = epoch_ns + group.time_ns
            return [(stamp, self._encode_one(group, stamp, run_id))]
        found = []
        for part in _neighbours(groups):
            stamp = epoch_ns + part[0].time_ns
            payload = self._encode_one(part[0], stamp, run_id) if len(part) == 1 else self._several(part, stamp, run_id)
            found.append((stamp, payload))
        return found

    def _encode_one(self, group: WriteGroup, stamp: int, run_id: int) -> bytes:
        views, values = zip(*group.changes, strict=True)
        key = (group.writer, group.kind, group.element, views, run_id)
        pattern = self._patterns.known.get(key)
        if pattern is None:
            message = self.message(stamp, run_id, group.writer, group.kind, _triples(group))
            if not message.values.text:
                self._patterns.learn(key, lambda: prepared(message, ("stamp",), ("sequence",), ("values.value",)))
            return self._encode(message)
        self.sequence += 1
        seconds, rest = stamp // NS_PER_S, stamp % NS_PER_S
        first, second, third, last = pattern.constants
        try:
            return pattern.pack(first, seconds, rest, second, self.sequence, third, *values, last)
        except struct.error as error:
            raise CdrError(f"a write to common memory: {error}") from error

    def _several(self, groups: Sequence[WriteGroup], stamp: int, run_id: int) -> bytes:
        """Return the bytes of several groups of one key, by the pattern for their number of values.

        The variables vary, too: a drive's loop writes another record of DIAG_DATA at each scan.
        """
        views: list[int] = []
        elements: list[int] = []
        values: list[Value] = []
        for group in groups:
            for view, value in group.changes:
                views.append(view)
                elements.append(group.element)
                values.append(value)
        first = groups[0]
        key = (first.writer, first.kind, len(views), run_id)
        pattern = self._patterns.known.get(key)
        if pattern is not None:
            seconds, rest = stamp // NS_PER_S, stamp % NS_PER_S
            constants, number = pattern.constants, self.sequence + 1
            try:
                payload = pattern.pack(
                    constants[0],
                    seconds,
                    rest,
                    constants[1],
                    number,
                    constants[2],
                    *views,
                    constants[3],
                    *elements,
                    constants[4],
                    *values,
                    constants[5],
                )
            except struct.error:
                pattern = None  # a text, or a value that does not fit: the codec decides
            else:
                self.sequence = number
                return payload
        entries = zip(views, elements, values, strict=True)
        message = self.message(stamp, run_id, first.writer, first.kind, entries)
        if not message.values.text:
            self._patterns.learn(key, lambda: prepared(message, ("stamp",), ("sequence",), *_VALUES))
        return self._encode(message)


def _neighbours(groups: Sequence[WriteGroup]) -> Iterator[Sequence[WriteGroup]]:
    begin, first = 0, groups[0]
    for place, group in enumerate(groups):
        if group.time_ns != first.time_ns or group.writer != first.writer or group.kind is not first.kind:
            yield groups[begin:place]
            begin, first = place, group
    yield groups[begin:]


def _triples(group: WriteGroup) -> Iterable[tuple[int, int, Value]]:
    element = group.element
    return ((view, element, value) for view, value in group.changes)
