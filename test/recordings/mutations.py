"""Hostile recordings: a small sound one, changed in ways that chance and malice think of. Seeded: each run the same."""

from __future__ import annotations

import io
import random
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk

from automax_ros.recordings.mcap.chunk_table import MESSAGE, ChunkTable, chunk_records, definition_at
from automax_ros.recordings.mcap.mcap_output import MESSAGE_FIELDS, RECORD_HEAD
from automax_ros.recordings.mcap.unpacking import Buffer

HEAD = struct.Struct("<BQ")
MAGIC_BYTES = 8
BOMB_BYTES = 1 << 30
HUGE = (0, 1, 0x7F, 0xFFFF, 1 << 31, (1 << 32) - 1, 1 << 40, (1 << 63) - 1, (1 << 64) - 1)


def record_places(data: bytes, start: int = MAGIC_BYTES) -> list[tuple[int, int, int]]:
    """Opcode, begin and end of each record of a sound file, or of a chunk's data."""
    places = []
    while start + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, start)
        end = start + HEAD.size + length
        if end > len(data):
            break
        places.append((opcode, start, end))
        start = end
    return places


def chunk_places(data: bytes) -> list[tuple[int, int]]:
    return [(begin, end) for opcode, begin, end in record_places(data) if opcode == Opcode.CHUNK]


def flip_bits(data: bytearray, chance: random.Random) -> bytearray:
    for _ in range(chance.choice((1, 1, 3, 20))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return data


def truncate(data: bytearray, chance: random.Random) -> bytearray:
    return data[: chance.randrange(len(data))]


def cut_out(data: bytearray, chance: random.Random) -> bytearray:
    begin = chance.randrange(len(data))
    del data[begin : begin + chance.choice((1, 10, 1000))]
    return data


def repeat(data: bytearray, chance: random.Random) -> bytearray:
    begin = chance.randrange(len(data))
    part = data[begin : begin + chance.choice((1, 10, 5000))]
    data[begin:begin] = part * chance.choice((1, 3))
    return data


def insert_noise(data: bytearray, chance: random.Random) -> bytearray:
    begin = chance.randrange(len(data))
    data[begin:begin] = chance.randbytes(chance.choice((1, 9, 300)))
    return data


def swap_chunks(data: bytearray, chance: random.Random) -> bytearray:
    (begin, end), (later, last) = sorted(chance.sample(chunk_places(bytes(data)), 2))
    return data[:begin] + data[later:last] + data[end:later] + data[begin:end] + data[last:]


def lie_about_length(data: bytearray, chance: random.Random) -> bytearray:
    _, begin, end = chance.choice(record_places(bytes(data)))
    lie = chance.choice((*HUGE, end - begin - HEAD.size + chance.randrange(-9, 9)))
    data[begin + 1 : begin + HEAD.size] = struct.pack("<Q", max(0, lie))
    return data


def lie_inside_record(data: bytearray, chance: random.Random) -> bytearray:
    """Overwrite four or eight bytes of a record's fields: counts, sizes, times, offsets."""
    _, begin, end = chance.choice(record_places(bytes(data)))
    place = min(begin + HEAD.size + chance.randrange(48), end - 1)
    number = struct.pack("<Q", chance.choice(HUGE))[: chance.choice((4, 8))]
    data[place : place + len(number)] = number
    return data


def within_chunk(
    change: Callable[[bytearray, random.Random], bytearray],
) -> Callable[[bytearray, random.Random], bytearray]:
    """Change what a chunk holds and compress it again, with a right checksum or none."""

    def changed(data: bytearray, chance: random.Random) -> bytearray:
        begin, end = chance.choice(chunk_places(bytes(data)))
        chunk = Chunk.read(ReadDataStream(io.BytesIO(bytes(data[begin + HEAD.size : end]))))
        inner = bytes(change(bytearray(zstandard.decompress(chunk.data)), chance))
        return data[:begin] + packed(inner, chance) + data[end:]

    return changed


def change_message(data: bytearray, chance: random.Random) -> bytearray:
    """Overwrite part of a message in a chunk's data: lengths of sequences and texts, numbers, padding."""
    messages = [place for place in record_places(bytes(data), 0) if place[0] == Opcode.MESSAGE]
    if not messages:
        return data
    for _ in range(chance.choice((1, 5))):
        _, begin, end = chance.choice(messages)
        place = chance.randrange(begin + HEAD.size, end)
        data[place : place + 4] = struct.pack("<I", chance.choice(HUGE) & 0xFFFFFFFF)[: end - place]
    return data


def change_definition(data: bytearray, chance: random.Random) -> bytearray:
    places = [place for place in record_places(bytes(data), 0) if place[0] != Opcode.MESSAGE]
    if places:
        _, begin, end = chance.choice(places)
        for _ in range(chance.choice((1, 10))):
            data[chance.randrange(begin, end)] = chance.randrange(256)
    return data


def many_tiny_messages(_: bytearray, chance: random.Random) -> bytearray:
    return bytearray(HEAD.pack(Opcode.MESSAGE, 22) + struct.pack("<HIQQ", chance.randrange(9), 1, 1, 1)) * 60_000


def packed(inner: bytes, chance: random.Random, size: int | None = None) -> bytes:
    compression = chance.choice(("zstd", "lz4", ""))
    compress = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}[compression]
    return chunk_record(
        compression, compress(inner), len(inner) if size is None else size, chance.choice((0, zlib.crc32(inner)))
    )


def chunk_record(compression: str, data: bytes, size: int, crc: int = 0) -> bytes:
    builder = RecordBuilder()
    Chunk(
        compression=compression,
        data=data,
        message_start_time=0,
        message_end_time=1,
        uncompressed_crc=crc,
        uncompressed_size=size,
    ).write(builder)
    return bytes(builder.end())


def bomb(data: bytearray, chance: random.Random) -> bytearray:
    """Put chunks in that become very large: honest about it, lying, or in many pieces."""
    begin, _ = chance.choice(chunk_places(bytes(data)))
    kind = chance.randrange(4)
    if kind == 0:
        compressor = zstandard.ZstdCompressor().compressobj(size=BOMB_BYTES)
        block = bytes(1 << 24)
        frame = b"".join(compressor.compress(block) for _ in range(BOMB_BYTES >> 24)) + compressor.flush()
        new = chunk_record("zstd", frame, chance.choice((BOMB_BYTES, 1000, 60 << 20)))
    elif kind == 1:
        new = chunk_record("lz4", lz4.frame.compress(bytes(1 << 28)), chance.choice((1 << 28, 1000)))
    elif kind == 2:
        new = chunk_record("zstd", zstandard.compress(bytes(60 << 20)), 60 << 20) * 50
    else:
        new = chunk_record("", b"\x05", (1 << 64) - 1)
    data[begin:begin] = new
    return data


CHANGES: tuple[Callable[[bytearray, random.Random], bytearray], ...] = (
    flip_bits,
    truncate,
    cut_out,
    repeat,
    insert_noise,
    swap_chunks,
    lie_about_length,
    lie_inside_record,
    within_chunk(flip_bits),
    within_chunk(truncate),
    within_chunk(change_message),
    within_chunk(change_message),
    within_chunk(change_definition),
    within_chunk(many_tiny_messages),
    bomb,
)
YAML_CHANGES = (flip_bits, truncate, cut_out, repeat, insert_noise)
YAML_BOMBS = (
    b"a: &a [" + b"x, " * 100 + b"]\nb: [" + b"*a, " * 100 + b"]\n",
    b"[" * 100_000,
    b"? " * 50_000,
    b"x: " + b"9" * 1_000_000,
    b"- !!python/object/apply:os.system [exit]\n",
    b"\xff\xfe\x00",
    b"",
)


def mutants(bag: Path, count: int, seed: int) -> Iterator[tuple[str, bytes, bytes]]:
    """Return this many changed recordings: what was done, the data file, metadata.yaml."""
    data = (bag / "scans_0.mcap").read_bytes()
    text = (bag / "metadata.yaml").read_bytes()
    yield from ((f"yaml bomb {number}", data, new) for number, new in enumerate(YAML_BOMBS))
    for number in range(count - len(YAML_BOMBS)):
        chance = random.Random(f"{seed}/{number}")
        if number % 12 == 11:
            change = chance.choice(YAML_CHANGES)
            yield f"{number} {change.__name__} yaml", data, bytes(change(bytearray(text), chance))
        else:
            change = CHANGES[number % len(CHANGES)]
            yield f"{number} {change.__name__}", bytes(change(bytearray(data), chance)), text


def table_of(data: Buffer, ends: Sequence[int]) -> ChunkTable | None:
    """The table of the messages of unpacked chunks, found record by record; None with a record of another kind."""
    found: list[tuple[int, int, int, int, int]] = []
    definitions = []
    try:
        for begin, end in pairwise((0, *ends)):
            for opcode, start, stop in chunk_records(data[begin:end]):
                place = begin + start - RECORD_HEAD.size
                if opcode == MESSAGE:
                    channel, _, log_time, stamp = MESSAGE_FIELDS.unpack_from(data, begin + start)
                    found.append((channel, place, stop - start - MESSAGE_FIELDS.size, log_time, stamp))
                else:
                    definitions.append(definition_at(data, place))
    except (ValueError, struct.error):
        return None
    if not found:
        return None
    columns = zip(*found, strict=True)
    kinds = (np.int64, np.int64, np.int64, np.uint64, np.uint64)
    return ChunkTable(*map(np.array, columns, kinds), tuple(definitions))
