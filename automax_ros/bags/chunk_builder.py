"""The open chunk of a recording: records, and where its messages stand.

Messages are framed here, since they are most of the work of a recording: 0.3 us for each against 4.2 us of
``mcap.writer.Writer.add_message``, where a recorded scan of the example takes 14 us in all.
"""

from __future__ import annotations

import struct
from typing import Final

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import McapRecord

RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of every record."""
MESSAGE_FIELDS = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time: what a message begins with."""
_pack_message: Final = struct.Struct("<BQHIQQ").pack
_FIELDS: Final = MESSAGE_FIELDS.size
_FRAME: Final = _FIELDS + RECORD_HEAD.size
_MESSAGE_CODE: Final = int(Opcode.MESSAGE)
"""A plain number: packing a member of an enumeration takes longer than all the rest."""


class ChunkBuilder:
    """The records of an open chunk: ``size`` bytes. Its index tells for each channel where the messages stand.

    ``first_time`` and ``last_time`` are the earliest and the latest log time; -1 without a message.
    """

    __slots__ = ("_parts", "first_time", "index", "last_time", "size")

    def __init__(self, index: dict[int, list[int]] | None = None) -> None:
        """Begin without records; with an ``index``, as one that has the index of a chunk elsewhere."""
        self._parts: list[bytes] = []
        self.size = 0
        self.index: dict[int, list[int]] = {} if index is None else index
        """Log time and place of each message, one after the other, by the number of the channel."""
        times = [time for entries in self.index.values() for time in entries[::2]] or [-1]
        self.first_time, self.last_time = min(times), max(times)

    @property
    def data(self) -> bytes:
        """All records."""
        return b"".join(self._parts)

    def add_record(self, record: McapRecord) -> None:
        """Add a schema or a channel."""
        data = record_bytes(record)
        self._parts.append(data)
        self.size += len(data)

    def add_message(self, channel: int, sequence: int, log_time: int, publish_time: int, payload: bytes) -> None:
        """Add a message."""
        length, place = len(payload), self.size
        if not self.index:
            self.first_time = self.last_time = log_time
        elif log_time > self.last_time:
            self.last_time = log_time
        elif log_time < self.first_time:
            self.first_time = log_time
        entries = self.index.get(channel)
        if entries is None:
            self.index[channel] = [log_time, place]
        else:
            entries.append(log_time)
            entries.append(place)
        append = self._parts.append
        append(_pack_message(_MESSAGE_CODE, length + _FIELDS, channel, sequence, log_time, publish_time))
        append(payload)
        self.size = place + length + _FRAME


def record_bytes(record: McapRecord) -> bytes:
    """Return a record of the package mcap as bytes."""
    builder = RecordBuilder()
    record.write(builder)
    return taken_bytes(builder)


def taken_bytes(builder: RecordBuilder) -> bytes:
    """Return the bytes of a builder, which is empty then."""
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
