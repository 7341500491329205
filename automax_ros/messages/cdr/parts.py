"""Helpers of the codec that ``messages/cdr/cdr.py`` generates: layouts of numbers, texts and sequences in CDR.

Numbers are aligned to multiples of their size, counted from the end of the header of four bytes. A sequence is its
length (uint32) and its items; no padding follows the length of an empty one. A string is its length including the
closing zero byte, its UTF-8 text and that byte.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

HEADER = b"\x00\x01\x00\x00"
"""The first bytes of a message: classic CDR (XCDR1), little-endian."""
CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "uint8": "B",
    "int8": "b",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
"""The code of each number in a struct format."""
COUNT = struct.Struct("<I")
COUNTS = tuple(struct.Struct(f"<{-position % 4}xI") for position in range(4))
"""A count for each position modulo 4 at which it can start."""
MOST_TOGETHER = 64
"""Sequences with more items are read one by one: there the gain is small, and the layouts would be many."""
MOST_LAYOUTS = 4096
"""Most layouts of a message that are kept: a rack needs few, untrusted messages could need many."""
MOST_HEAD_TEXT = 64
"""Longest text in a head, in bytes with its closing zero byte: a task's name has 8 characters (decision)."""

Together = Callable[[bytes, int], tuple[int, tuple[Any, ...], int]]


class CdrError(ValueError):
    """Bytes are not a message of the type, or a value does not fit its field."""


def size_of(code: str) -> int:
    """Return the size of a number in bytes, which is also its alignment."""
    return struct.calcsize(f"<{code}")


class CdrLayout:
    """Builds the format of a struct with CDR's padding; ``position`` counts from the beginning of the header."""

    def __init__(self, position: int) -> None:
        self.text = ""
        self._position = position - len(HEADER)

    def add(self, code: str, count: int = 1) -> None:
        """Add this many numbers of one code."""
        size = size_of(code)
        padding = -self._position % size
        self.text += f"{padding}x{count}{code}" if padding else f"{count}{code}"
        self._position += padding + count * size

    def add_text(self, size: int) -> None:
        """Add a string of this many bytes with its closing zero byte: two arguments, the size and the text."""
        self.add("I")
        self.text += f"{size}s"
        self._position += size

    def add_sequence(self, code: str, count: int) -> None:
        """Add a sequence of this many numbers; the arguments are its length and the numbers."""
        self.add("I")
        if count:
            self.add(code, count)

    def packing(self) -> struct.Struct:
        """Return the packing of what was added."""
        return struct.Struct(f"<{self.text}")


def number_layouts(codes: str) -> tuple[struct.Struct, ...]:
    """Return the packing of single numbers for each position modulo 8 at which they can start."""
    layouts = []
    for position in range(8):
        layout = CdrLayout(position)
        for code in codes:
            layout.add(code)
        layouts.append(layout.packing())
    return tuple(layouts)


class Packings(dict[tuple[int, ...], Callable[..., bytes]]):
    """Functions that pack numbers and texts, by their sizes; ``layout_of`` returns the format for the sizes."""

    def __init__(self, layout_of: Callable[[tuple[int, ...]], str]) -> None:
        super().__init__()
        self._layout_of = layout_of

    def __missing__(self, sizes: tuple[int, ...]) -> Callable[..., bytes]:
        if len(self) >= MOST_LAYOUTS:
            self.clear()
        self[sizes] = pack = struct.Struct(f"<{self._layout_of(sizes)}").pack
        return pack


def whole_packings(plan: Sequence[tuple[str, str]]) -> Packings:
    """Return the packings of a whole message, header included, by the sizes of its texts and sequences.

    ``plan`` has a part for each size: ``text``, or the codes of sequences that have the same length; and between them
    the codes of single numbers.
    """

    def layout_of(sizes: tuple[int, ...]) -> str:
        layout, following = CdrLayout(len(HEADER)), iter(sizes)
        for word, codes in plan:
            size = 0 if word == "numbers" else next(following)
            if word == "text":
                layout.add_text(size)
            for code in codes:
                if word == "numbers":
                    layout.add(code)
                else:
                    layout.add_sequence(code, size)
        return f"{len(HEADER)}s{layout.text}"

    return Packings(layout_of)


def sequence_packings(codes: str) -> Packings:
    """Return the packings of neighbouring sequences of numbers, by the position modulo 8 and the length of each."""

    def layout_of(place: tuple[int, ...]) -> str:
        layout = CdrLayout(place[0])
        for code, count in zip(codes, place[1:], strict=True):
            layout.add_sequence(code, count)
        return layout.text

    return Packings(layout_of)


def put_count(out: bytearray, count: int) -> None:
    """Append the length of a sequence."""
    out += COUNTS[len(out) & 3].pack(count)


def put_text(out: bytearray, value: str) -> None:
    """Append a string."""
    text = value.encode()
    out += COUNTS[len(out) & 3].pack(len(text) + 1) + text + b"\0"


def put_texts(out: bytearray, values: Sequence[str]) -> None:
    """Append a sequence of strings."""
    put_count(out, len(values))
    for value in values:
        put_text(out, value)


def read_count(data: bytes, position: int, smallest: int) -> tuple[int, int]:
    """Read the length of a sequence with items of at least ``smallest`` bytes each; refuse one that does not fit."""
    position += -position & 3
    (count,) = COUNT.unpack_from(data, position)
    position += 4
    if count * smallest > len(data) - position:
        raise CdrError(f"a sequence of {count} items in the last {len(data) - position} bytes")
    return count, position


def read_text(data: bytes, position: int) -> tuple[str, int]:
    """Read a string."""
    start = (position + 3 & -4) + COUNT.size
    (length,) = COUNT.unpack_from(data, start - COUNT.size)
    end = start + length
    if end > len(data):
        raise CdrError(f"a sequence of {length} items in the last {len(data) - start} bytes")
    if not length:
        return "", end
    if data[end - 1]:
        raise CdrError("a string without its closing zero byte")
    return data[start : end - 1].decode(), end


def read_head_text(data: bytes, position: int) -> tuple[str, int]:
    """Read a string in the head of a message that any program may have sent: short, and ASCII."""
    length, position = read_count(data, position, 0)
    if not 0 < length <= MOST_HEAD_TEXT:
        raise CdrError(f"a name of {length} bytes")
    return data[position : position + length - 1].decode("ascii"), position + length


def read_texts(data: bytes, position: int) -> tuple[tuple[str, ...], int]:
    """Read a sequence of strings."""
    count, position = read_count(data, position, COUNT.size)
    texts = []
    for _ in range(count):
        text, position = read_text(data, position)
        texts.append(text)
    return tuple(texts), position


def read_numbers(data: bytes, position: int, code: str, size: int) -> tuple[tuple[Any, ...], int]:
    """Read a sequence of numbers."""
    count, position = read_count(data, position, size)
    if not count:
        return (), position
    position += (len(HEADER) - position) % size
    return struct.unpack_from(f"<{count}{code}", data, position), position + count * size


def read_items(
    data: bytes, position: int, read: Callable[[bytes, int], tuple[Any, int]], smallest: int
) -> tuple[tuple[Any, ...], int]:
    """Read a sequence of messages, each of at least ``smallest`` bytes."""
    count, position = read_count(data, position, smallest)
    items = []
    for _ in range(count):
        item, position = read(data, position)
        items.append(item)
    return tuple(items), position


def together(codes: str) -> Together:
    """Return a function that reads sequences of equal length in one step, such as Values: most of a recording's work.

    It returns the length, all numbers (each sequence after its length) and the position after them; length 0 if they
    are empty, long, of different lengths or cut off: then they must be read one by one.
    """
    layouts: dict[int, struct.Struct] = {}

    def build(count: int, position: int) -> struct.Struct:
        layout = CdrLayout(position)
        for code in codes:
            layout.add_sequence(code, count)
        layouts[count << 3 | position] = made = layout.packing()
        return made

    def read(data: bytes, position: int) -> tuple[int, tuple[Any, ...], int]:
        (count,) = COUNT.unpack_from(data, position + (-position & 3))
        if not 0 < count <= MOST_TOGETHER:
            return 0, (), position
        layout = layouts.get(count << 3 | position & 7) or build(count, position & 7)
        end = position + layout.size
        if end > len(data):
            return 0, (), position
        numbers = layout.unpack_from(data, position)
        for place in range(count + 1, len(numbers), count + 1):
            if numbers[place] != count:
                return 0, (), position
        return count, numbers, end

    return read
