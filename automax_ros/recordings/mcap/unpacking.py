"""Decompresses untrusted chunks: the size that they state is checked before memory is allocated."""

from __future__ import annotations

import contextlib
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import zstandard
from mcap.records import Chunk

from automax_ros.recordings.mcap.errors import BagError

MAX_RECORD_BYTES = 64 << 20
"""Longest record, longest decompressed chunk and greatest sum of all schemas and channels that is read, in bytes
(decision: a bound on memory for untrusted recordings)."""
MAX_RATIO = 1000
FREE_BYTES = 512 << 20
"""A file may unpack to ``MAX_RATIO`` times its size plus these bytes (decision): recordings come to 10 or 50 times."""
DAMAGED_HINT = "copy the file again from where it was recorded, or save what is sound by `automax bag repair`"

_CHUNK_FIELDS = struct.Struct("<QQQII")
"""Beginning of a chunk: first and last time, unpacked size and checksum, length of the compression's name."""

Buffer = bytes | memoryview
Room = Callable[[int], memoryview]
"""Returns a buffer of a given number of bytes."""


class Unpacker:
    """Decompresses the chunks of one file of ``stored_bytes`` bytes."""

    def __init__(self, path: Path, stored_bytes: int) -> None:
        self._path = path
        self._left = FREE_BYTES + MAX_RATIO * stored_bytes
        self._zstd = zstandard.ZstdDecompressor()

    def unpacked(self, chunk: Chunk, room: Room | None = None) -> Buffer:
        """Return the unpacked bytes of a chunk, in a buffer from ``room`` if given, called after the size was checked.

        Raises:
            BagError: damaged, beyond the limits, or of an unknown compression; the message names no place.
        """
        size = chunk.uncompressed_size
        self._admit(size)
        place = None if room is None else room(size)
        data: Buffer
        if place is not None and self._is_in(place, chunk):
            data = place
        else:
            try:
                data = self._whole(chunk.compression, chunk.data, size)
            except (zstandard.ZstdError, RuntimeError, EOFError) as error:  # lz4 raises RuntimeError
                raise self._damage_error(f"a chunk cannot be decompressed: {error}") from error
        if len(data) != size:
            raise self._damage_error(f"a chunk has {len(data)} bytes and should have {size}")
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise self._damage_error("the checksum of a chunk is wrong")
        if place is None or data is place:
            return data
        place[:] = data
        return place

    def beginning(self, content: bytes) -> tuple[bytes, str, int] | None:
        """Return what can be unpacked of a chunk whose record is cut, its compression and whole size; None if nothing.

        None too if it is beyond the limits, or whole with a wrong checksum.
        """
        if len(content) < _CHUNK_FIELDS.size:
            return None
        *_, size, crc, name_length = _CHUNK_FIELDS.unpack_from(content)
        start = _CHUNK_FIELDS.size + name_length + 8  # the length of the data
        if name_length > 4 or start > len(content):
            return None
        compression, data = content[_CHUNK_FIELDS.size :][:name_length].decode("latin-1"), content[start:]
        found = bytearray()
        with contextlib.suppress(BagError, zstandard.ZstdError, RuntimeError, EOFError):
            self._admit(size)
            if not compression:
                found += data[:size]
            elif compression == "lz4":
                found += lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)
            elif compression == "zstd":
                reader = zstandard.ZstdDecompressor(max_window_size=MAX_RECORD_BYTES).stream_reader(data)
                while len(found) < size and (part := reader.read(min(1 << 16, size - len(found)))):
                    found += part
        if not found or (len(found) == size and crc not in (0, zlib.crc32(found))):
            return None
        return bytes(found), compression, size

    def _admit(self, size: int) -> None:
        if size > MAX_RECORD_BYTES:
            raise BagError("AMX6814", self._path, f"a chunk of {size} bytes, at most {MAX_RECORD_BYTES} are read")
        self._left -= size
        if self._left < 0:
            raise BagError(
                "AMX6814", self._path, f"becomes more than {MAX_RATIO} times as large when it is decompressed"
            )

    def _whole(self, compression: str, data: bytes, size: int) -> bytes:
        if not compression:
            return data
        if compression == "lz4":
            unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
            return unpacked
        if compression != "zstd":
            raise BagError("AMX6811", self._path, f"is compressed with {compression[:40]!r}; zstd and lz4 can be read")
        # zstandard allocates the size that the frame states, so that must be checked too.
        stated = zstandard.get_frame_parameters(data).content_size
        if stated not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise self._damage_error(f"a chunk holds {stated} bytes and should hold {size}")
        return self._zstd.decompress(data, max_output_size=size) if size else b""

    def _is_in(self, place: memoryview, chunk: Chunk) -> bool:
        """Decompress a sound zstd frame that states its size into ``place``; return FALSE for anything else."""
        if chunk.compression != "zstd" or not len(place):
            return False
        with contextlib.suppress(zstandard.ZstdError):
            if zstandard.get_frame_parameters(chunk.data).content_size == len(place):
                with self._zstd.stream_reader(chunk.data) as reader:
                    # The second read reaches the end of the frame, and checks its checksum.
                    return reader.readinto(place) == len(place) and not reader.read(1)
        return False

    def _damage_error(self, message: str) -> BagError:
        return BagError("AMX6813", self._path, message, DAMAGED_HINT)
