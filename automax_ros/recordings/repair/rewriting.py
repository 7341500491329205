"""Writes what is sound in a damaged mcap file as a new file, whole chunks as they are, with index and summary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

import automax_ros
from automax_ros.core.kinds import WriteKind
from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.recordings.mcap.chunk_builder import MESSAGE_FIELDS, RECORD_HEAD, ChunkBuilder
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_output import McapOutput
from automax_ros.recordings.mcap.metadata import BagMetadata, yaml_text
from automax_ros.recordings.mcap.unpacking import MAX_RECORD_BYTES
from automax_ros.recordings.repair.contents import SCAN, WRITE, FileContents, FileSequence, Provenance
from automax_ros.recordings.repair.salvage import DamagedFileReader, SoundChunk, SoundPiece, parsed, records
from automax_ros.recordings.write.data_file import DataFile

_LOOSE_BYTES = 1 << 20
"""Messages that stood outside of chunks are gathered in chunks of this size."""
_OWN = "automax_msgs/msg/"


class Found(NamedTuple):
    """A message of a damaged file; times in nanoseconds."""

    channel: int
    sequence: int
    log_time: int
    stamp: int
    payload: bytes


class Definitions:
    """The schemas and channels that stand anywhere in a file; the first of a number counts."""

    def __init__(self, path: Path) -> None:
        """Read the whole file.

        Raises:
            BagError: it cannot be read or is beyond the limits.
        """
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.compression = ""
        self._bytes = 0
        self._path = path
        compressions = set()
        for piece in DamagedFileReader(path).pieces():
            if isinstance(piece, (Schema, Channel)):
                self._take(piece)
            elif isinstance(piece, SoundChunk):
                compressions.add(piece.packed.compression if piece.packed else piece.compression)
                for record in definitions_in(piece.data):
                    self._take(record)
        self.compression = compressions.pop() if len(compressions) == 1 else "zstd"

    def usable(self, channel: int) -> bool:
        """Whether messages of a channel can be understood."""
        known = self.channels.get(channel)
        return known is not None and (known.schema_id == 0 or known.schema_id in self.schemas)

    def _take(self, record: Schema | Channel) -> None:
        if isinstance(record, Schema):
            if record.id and record.id not in self.schemas:
                self.schemas[record.id] = record
                self._bytes += len(record.data) + len(record.name)
        elif record.id not in self.channels:
            self.channels[record.id] = record
            self._bytes += len(record.topic) + sum(map(len, record.metadata.values()))
        if self._bytes > MAX_RECORD_BYTES:
            raise BagError("AMX6814", self._path, f"schemas and channels of more than {MAX_RECORD_BYTES} bytes")


class RepairWriter:
    """One file being written again. ``write`` does it, ``close`` in any case; then the counts tell how it went."""

    def __init__(
        self,
        target: Path,
        salvage: DamagedFileReader,
        definitions: Definitions,
        provenance: Provenance,
        sequence: FileSequence | None = None,
    ) -> None:
        """Create the file. ``sequence`` is what its messages have to follow, None where they may have any order."""
        self.contents = FileContents(target.name)
        self._sequence = sequence
        self.contents.schemas, self.contents.channels = definitions.schemas, definitions.channels
        self.dropped_messages = 0
        self.dropped_scans = 0
        self._definitions = definitions
        self._defined: set[tuple[type, int]] = set()
        self._salvage = salvage
        self._provenance = provenance
        self._loose = ChunkBuilder()
        self._file = DataFile(target)
        self._output = McapOutput(
            self._file, library=f"automax_ros {automax_ros.__version__}", compression=definitions.compression
        )
        self._output.schemas, self._output.channels = definitions.schemas, definitions.channels

    def write(self) -> None:
        """Write everything sound, then index and summary.

        Raises:
            BagError: the damaged file cannot be read or is beyond the limits.
            OSError: the disk refuses.
        """
        waiting: SoundChunk | None = None
        for piece in self._salvage.pieces():
            if isinstance(piece, SoundChunk):
                if waiting is not None:
                    self._put_chunk(waiting, last=False)
                waiting = piece
            else:
                self._put(piece)
        if waiting is not None:
            self._put_chunk(waiting, last=not self._salvage.finished)
        self._end_loose()
        own = BagMetadata([self.contents.summary()]).information()
        self._output.add_metadata(Metadata(name="rosbag2", metadata={"serialized_metadata": yaml_text(own)}))
        self._output.finish()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _put(self, piece: SoundPiece) -> None:
        if isinstance(piece, Attachment):
            self._provenance.take(piece)
            self._output.add_attachment(piece)
        elif isinstance(piece, Metadata):
            self._provenance.take(piece)
            if piece.name != "rosbag2":
                self._output.add_metadata(piece)
        elif isinstance(piece, bytes):
            self._add(self._chosen([_found(piece)]), self._loose)
            if self._loose.size > _LOOSE_BYTES:
                self._end_loose()

    def _put_chunk(self, piece: SoundChunk, *, last: bool) -> None:
        """Write a chunk: as it stands if all of it is sound, else what is left of it."""
        found: list[Found] = []
        index: dict[int, list[int]] = {}
        end = others = 0
        for opcode, start, end in records(piece.data):
            others += 1
            if opcode == Opcode.MESSAGE and end - start >= MESSAGE_FIELDS.size:
                message = _found(piece.data[start:end])
                others -= 1
                found.append(message)
                index.setdefault(message.channel, []).extend((message.log_time, start - RECORD_HEAD.size))
        keep = kept(found, self.contents.type_of, cut=piece.cut) if last or piece.cut else len(found)
        self._drop(found[keep:])
        chosen = self._chosen(found[:keep])
        definitions = definitions_in(piece.data)  # a record that cannot be parsed is not among them
        whole = len(chosen) == len(found) and end == len(piece.data) and others == len(definitions)
        if piece.packed is None or not whole:
            self._end_loose()
            self._add(chosen, self._loose)
            self._end_loose()
            return
        builder = ChunkBuilder(index)
        if found:
            inner = frozenset((type(record), record.id) for record in definitions)
            self._define(index, inner)
            self._output.add_packed_chunk(piece.packed, builder)
            self._count(found)

    def _chosen(self, messages: Sequence[Found]) -> list[Found]:
        """Return the messages that can be understood and follow each other; the others are dropped."""
        places = [self._is_usable(message) for message in messages]
        self._drop([message for message, usable in zip(messages, places, strict=True) if not usable])
        return [message for message, usable in zip(messages, places, strict=True) if usable]

    def _add(self, messages: Sequence[Found], chunk: ChunkBuilder) -> None:
        self._define({message.channel for message in messages})
        for message in messages:
            chunk.add_message(message.channel, message.sequence, message.log_time, message.stamp, message.payload)
        self._count(messages)

    def _is_usable(self, message: Found) -> bool:
        contents, channel, payload = self.contents, message.channel, message.payload
        if not self._definitions.usable(channel) or contents.fault(channel, payload):
            return False
        sequence = self._sequence
        return sequence is None or not sequence.fault(message.log_time, contents.type_of(channel), payload)

    def _define(self, channels: Iterable[int], inner: frozenset[tuple[type, int]] = frozenset()) -> None:
        """Write the definitions of channels that no record has told of yet; ``inner`` stand in the chunk itself."""
        for number in sorted(channels):
            channel = self._definitions.channels[number]
            schema = self._definitions.schemas.get(channel.schema_id)
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
    """Return how many of a file's last messages belong to whole instants.

    Where a chunk was ``cut`` the last instant may lack something, so it goes. Where the last scan's writes do not
    follow it, everything from that scan on goes. Only our own messages have instants; of others all are kept.
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
    """Whether a scan at the end of a file wrote more than the writes that follow it, and nothing else does."""
    try:
        scan: Any = decode(SCAN, messages[0].payload)
        missing = len(scan.written.variable) + len(scan.committed.variable)
        for message in messages[1:]:
            if type_of(message.channel) != WRITE:
                return False  # what follows a scan's writes is there, so they are whole; a force may have dropped some
            write: Any = decode(WRITE, message.payload)
            if write.kind in (WriteKind.COMMIT, WriteKind.BASIC):
                missing -= len(write.values.variable)
    except CdrError:
        return True
    return missing > 0


def _found(content: bytes) -> Found:
    channel, sequence, log_time, stamp = MESSAGE_FIELDS.unpack_from(content)
    return Found(channel, sequence, log_time, stamp, content[MESSAGE_FIELDS.size :])


def definitions_in(data: bytes) -> list[Schema | Channel]:
    """Return the schemas and channels in a chunk's data that can be parsed."""
    found: list[Schema | Channel] = []
    for opcode, start, end in records(data):
        record = None
        if opcode == Opcode.SCHEMA:
            record = parsed(Schema.read, data[start:end])
        elif opcode == Opcode.CHANNEL:
            record = parsed(Channel.read, data[start:end])
        if record is not None:
            found.append(record)
    return found
