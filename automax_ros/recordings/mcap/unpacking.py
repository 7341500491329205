"""Decompresses untrusted chunks: the size that they state is checked before memory is allocated."""

from __future__ import annotations

import contextlib
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

Buffer = bytes | memoryview
Room = Callable[[int], memoryview]
"""Returns a buffer of a given number of bytes."""


class Unpacker:
    """Decompresses the chunks of one file of ``stored_bytes`` bytes."""

    def __init__(self, path: Path, stored_bytes: int) -> None:
        self._path = path
        self._left = FREE_BYTES + MAX_RATIO * stored_bytes
        self._zstd = zstandard.ZstdDecompressor()

    def unpacked(self, chunk: Chunk) -> bytes:
        """Return the unpacked bytes of a chunk.

        Raises:
            BagError: damaged, beyond the limits, or of an unknown compression; the message names no place.
        """
        self._admit(chunk.uncompressed_size)
        data = self._decompressed(chunk)
        self._check(chunk, data)
        return data

    def unpacked_in(self, chunk: Chunk, room: Room) -> memoryview:
        """Return the unpacked bytes of a chunk, in a buffer from ``room``, which is called after its size was checked.

        Raises:
            BagError: as ``unpacked`` does.
        """
        self._admit(chunk.uncompressed_size)
        place = room(chunk.uncompressed_size)
        if self._is_in(place, chunk):
            self._check(chunk, place)
        else:
            data = self._decompressed(chunk)
            self._check(chunk, data)
            place[:] = data
        return place

    def _decompressed(self, chunk: Chunk) -> bytes:
        try:
            return self._whole(chunk.compression, chunk.data, chunk.uncompressed_size)
        except (zstandard.ZstdError, RuntimeError, EOFError) as error:  # lz4 raises RuntimeError
            raise self._damaged(f"a chunk cannot be decompressed: {error}") from error

    def _check(self, chunk: Chunk, data: Buffer) -> None:
        size = chunk.uncompressed_size
        if len(data) != size:
            raise self._damaged(f"a chunk has {len(data)} bytes and should have {size}")
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise self._damaged("the checksum of a chunk is wrong")

    def beginning(self, compression: str, data: bytes, size: int) -> bytes:
        """Return as much of a chunk of ``size`` bytes as can be unpacked from the beginning of its compressed data.

        Raises:
            BagError: beyond the limits.
        """
        self._admit(size)
        if not compression:
            return data[:size]
        found = bytearray()
        with contextlib.suppress(zstandard.ZstdError, RuntimeError, EOFError):
            if compression == "lz4":
                found += lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)
            elif compression == "zstd":
                reader = zstandard.ZstdDecompressor(max_window_size=MAX_RECORD_BYTES).stream_reader(data)
                while len(found) < size and (part := reader.read(min(1 << 16, size - len(found)))):
                    found += part
        return bytes(found)

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
            raise self._damaged(f"a chunk holds {stated} bytes and should hold {size}")
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

    def _damaged(self, message: str) -> BagError:
        return BagError("AMX6813", self._path, message, DAMAGED_HINT)
