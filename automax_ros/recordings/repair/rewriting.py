"""Writes the sound parts of a damaged mcap file to a new file: whole chunks unchanged, with index and summary."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Sequence, Set
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Attachment, Metadata

import automax_ros
from automax_ros.core.kinds import WriteKind
from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.recordings.mcap.chunk_table import MESSAGE, WholeChunk, chunk_records
from automax_ros.recordings.mcap.mcap_file import McapFile
from automax_ros.recordings.mcap.mcap_output import MESSAGE_FIELDS, RECORD_HEAD, ChunkBuilder, McapOutput
from automax_ros.recordings.mcap.metadata import BagMetadata, yaml_text
from automax_ros.recordings.repair.contents import SCAN, WRITE, FileContents, FileSequence, Provenance
from automax_ros.recordings.write.data_file import DataFile

_LOOSE_BYTES = 1 << 20
"""Size of the chunks in which messages from outside of chunks are collected."""
_OWN = "automax_msgs/msg/"


class Found(NamedTuple):
    """A message of a damaged file; times in nanoseconds."""

    channel: int
    sequence: int
    log_time: int
    stamp: int
    payload: bytes


def with_definitions(path: Path) -> McapFile:
    """Read a damaged file, and return it with the schemas and channels from anywhere in it.

    Raises:
        BagError: it cannot be read or is beyond the limits.
    """
    file = McapFile(path, salvage=True)
    for piece in file.pieces():
        if isinstance(piece, WholeChunk):
            data = bytes(piece.data)
            with contextlib.suppress(ValueError):
                for opcode, start, end in chunk_records(data):
                    if opcode != MESSAGE:
                        file.define(opcode, data[start:end])
    return file


class RepairWriter:
    """Rewrites one file: call ``write``, and ``close`` in any case; then the counts describe the result."""

    def __init__(
        self, target: Path, source: Path, provenance: Provenance, sequence: FileSequence | None = None
    ) -> None:
        """Create the file. ``sequence`` checks the order of its messages, None if they may have any order.

        Raises:
            BagError: the damaged file ``source`` cannot be read or is beyond the limits.
        """
        self.contents = FileContents(target.name)
        self._sequence = sequence
        self._definitions = definitions = with_definitions(source)
        self.contents.schemas, self.contents.channels = definitions.schemas, definitions.channels
        self.dropped_messages = 0
        self.dropped_scans = 0
        self._defined: set[tuple[type, int]] = set()
        self._source = McapFile(source, salvage=True)
        self.damage = self._source.damage
        self._provenance = provenance
        self._loose = ChunkBuilder()
        self._file = DataFile(target)
        compressions = definitions.compressions
        self._output = McapOutput(
            self._file,
            library=f"automax_ros {automax_ros.__version__}",
            compression=next(iter(compressions)) if len(compressions) == 1 else "zstd",
        )
        self._output.schemas, self._output.channels = definitions.schemas, definitions.channels

    def write(self) -> None:
        """Write everything sound, then index and summary.

        Raises:
            BagError: the damaged file cannot be read or is beyond the limits.
            OSError: the disk cannot be written.
        """
        waiting: WholeChunk | None = None
        for piece in self._source.pieces():
            if isinstance(piece, WholeChunk):
                if waiting is not None:
                    self._put_chunk(waiting, last=False)
                waiting = piece
            else:
                self._put(piece)
        if waiting is not None:
            self._put_chunk(waiting, last=not self.damage.finished)
        self._end_loose()
        own = BagMetadata([self.contents.summary()]).information()
        self._output.add_metadata(Metadata(name="rosbag2", metadata={"serialized_metadata": yaml_text(own)}))
        self._output.finish()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _put(self, piece: Attachment | Metadata | bytes) -> None:
        if isinstance(piece, Attachment):
            self._provenance.take(piece)
            self._output.add_attachment(piece)
        elif isinstance(piece, Metadata):
            self._provenance.take(piece)
            if piece.name != "rosbag2":
                self._output.add_metadata(piece)
        else:
            self._add(self._choose([_make_found(piece)]))
            if self._loose.size > _LOOSE_BYTES:
                self._end_loose()

    def _put_chunk(self, piece: WholeChunk, *, last: bool) -> None:
        """Write a chunk: unchanged if all of it is sound, else only its sound messages."""
        data = bytes(piece.data)
        found: list[Found] = []
        index: dict[int, list[int]] = {}
        inner: set[tuple[type, int]] = set()
        end, whole = 0, piece.packed is not None
        with contextlib.suppress(ValueError):
            for opcode, start, end in chunk_records(data):
                content = data[start:end]
                if opcode != MESSAGE:
                    record = self._definitions.definition(opcode, content)
                    whole = whole and record is not None
                    inner |= {(type(record), record.id)} if record is not None else set()
                elif len(content) >= MESSAGE_FIELDS.size:
                    message = _make_found(content)
                    found.append(message)
                    index.setdefault(message.channel, []).extend((message.log_time, start - RECORD_HEAD.size))
                else:
                    whole = False
        keep = kept(found, self.contents.type_of, cut=piece.cut) if last or piece.cut else len(found)
        self._drop(found[keep:])
        chosen = self._choose(found[:keep])
        if piece.packed is None or not whole or len(chosen) < len(found) or end < len(data):
            self._end_loose()
            self._add(chosen)
            self._end_loose()
        elif found:
            self._define(index, inner)
            self._output.add_packed_chunk(piece.packed, ChunkBuilder(index))
            self._count(found)

    def _choose(self, messages: Sequence[Found]) -> list[Found]:
        """Return the messages that can be decoded and follow each other; count the others as dropped."""
        places = [self._is_usable(message) for message in messages]
        self._drop([message for message, usable in zip(messages, places, strict=True) if not usable])
        return [message for message, usable in zip(messages, places, strict=True) if usable]

    def _add(self, messages: Sequence[Found]) -> None:
        self._define({message.channel for message in messages})
        for message in messages:
            self._loose.add_message(message.channel, message.sequence, message.log_time, message.stamp, message.payload)
        self._count(messages)

    def _is_usable(self, message: Found) -> bool:
        """Whether the channel of a message is defined, and its schema if it has one, and the message is in order."""
        contents, channel, payload = self.contents, message.channel, message.payload
        known = contents.channels.get(channel)
        if known is None or (known.schema_id and known.schema_id not in contents.schemas):
            return False
        if contents.fault(channel, payload):
            return False
        sequence = self._sequence
        return sequence is None or not sequence.fault(message.log_time, contents.type_of(channel), payload)

    def _define(self, channels: Iterable[int], inner: Set[tuple[type, int]] = frozenset()) -> None:
        """Write the definitions of channels that were not written yet; ``inner`` are in the chunk itself."""
        for number in sorted(channels):
            channel = self.contents.channels[number]
            schema = self.contents.schemas.get(channel.schema_id)
            for record in (schema, channel):
                if record is not None and (type(record), record.id) not in self._defined | inner:
                    self._output.add_definition(record)
                    self._defined.add((type(record), record.id))
        self._defined |= inner

    def _count(self, messages: Sequence[Found]) -> None:
        for message in messages:
            self.contents.count(message.channel, message.log_time, message.stamp, message.payload)

    def _drop(self, messages: Sequence[Found]) -> None:
        self.dropped_messages += len(messages)
        self.dropped_scans += sum(self.contents.type_of(message.channel) == SCAN for message in messages)

    def _end_loose(self) -> None:
        self._output.add_chunk(self._loose)
        self._loose = ChunkBuilder()


def kept(messages: Sequence[Found], type_of: Callable[[int], str], *, cut: bool) -> int:
    """Return how many of a file's last messages to keep, so that they end with a whole instant.

    If a chunk was ``cut``, the last instant may be incomplete and is dropped. If the last scan is not followed by its
    writes, everything from that scan on is dropped. Only our own messages have instants; all others are kept.
    """
    count = len(messages)
    own = any(type_of(message.channel).startswith(_OWN) for message in messages)
    if cut and own and count:
        stamp = messages[-1].stamp
        while count and messages[count - 1].stamp == stamp:
            count -= 1
    last = next((place for place in reversed(range(count)) if type_of(messages[place].channel) == SCAN), None)
    if last is not None and _lacks_writes(messages[last:count], type_of):
        return last
    return count


def _lacks_writes(messages: Sequence[Found], type_of: Callable[[int], str]) -> bool:
    """Whether the last scan of a file is followed only by writes, and these are fewer than it made."""
    try:
        scan: Any = decode(SCAN, messages[0].payload)
        missing = len(scan.written.variable) + len(scan.committed.variable)
        for message in messages[1:]:
            if type_of(message.channel) != WRITE:
                return False  # a message after the scan's writes: they are complete; a force may have dropped some
            write: Any = decode(WRITE, message.payload)
            if write.kind in (WriteKind.COMMIT, WriteKind.BASIC):
                missing -= len(write.values.variable)
    except CdrError:
        return True
    return missing > 0


def _make_found(content: bytes) -> Found:
    channel, sequence, log_time, stamp = MESSAGE_FIELDS.unpack_from(content)
    return Found(channel, sequence, log_time, stamp, content[MESSAGE_FIELDS.size :])
