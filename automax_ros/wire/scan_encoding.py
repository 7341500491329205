"""CDR of Scan and CommonWrite, the two messages that make most of a recording, in one ``struct`` call each.

The bytes are those of ``wire/cdr.py``, which also takes over what is rare: texts and errors. A message's shape (which
task, how many values) gives its packing; a rack has few shapes, so they are built once and kept.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.wire.cdr import HEADER, CdrError, encoder
from automax_ros.wire.messages import NAMES, NO_VALUES, CommonWrite, Scan

_CACHED_SHAPES = 4096
_HEADER_CODE = f"<{len(HEADER)}s"


class _Layout:
    """Builds the format of a struct, padding where CDR does; positions count from behind the header."""

    def __init__(self) -> None:
        self.text = _HEADER_CODE
        self._position = 0

    def add(self, code: str, count: int = 1) -> None:
        """Add so many numbers of one code."""
        size = struct.calcsize(f"<{code}")
        padding = -self._position % size
        self.text += f"{padding}x{count}{code}" if padding else f"{count}{code}"
        self._position += padding + count * size

    def add_bytes(self, count: int) -> None:
        """Add a text of so many bytes."""
        self.text += f"{count}s"
        self._position += count

    def add_zeros(self, counts: int) -> None:
        """Add lengths of empty sequences; they take no argument."""
        padding = -self._position % 4 + counts * 4
        self.text += f"{padding}x"
        self._position += padding

    def add_values(self, count: int) -> None:
        """Add a Values without texts: three lengths, each with its numbers."""
        if not count:
            self.add_zeros(4)
            return
        for code in "HId":
            self.add("I")
            self.add(code, count)
        self.add_zeros(1)


def scan_encoder() -> Callable[[Scan], bytes]:
    """Return a function that turns a Scan into bytes; it keeps what it has learned about shapes."""
    general = encoder(NAMES[Scan])
    packings: dict[tuple[object, ...], tuple[Callable[..., bytes], bytes]] = {}

    def encode(message: Scan) -> bytes:
        stamp, slot, task, scan, duration, skipped, full, latched, read, written, committed, errors = message
        if errors:
            return general(message)
        numbers: list[Any] = []
        counts = []
        for values in (latched, read, written, committed):
            if values is NO_VALUES:
                counts.append(0)
                continue
            variables, elements, entries, texts = values
            count = len(variables)
            if texts or len(elements) != count or len(entries) != count:
                return general(message)
            counts.append(count)
            if count:
                numbers += (count, *variables, count, *elements, count, *entries)
        shape = (task, *counts)
        found = packings.get(shape)
        if found is None:
            if len(packings) >= _CACHED_SHAPES:
                packings.clear()
            found = packings[shape] = _scan_packing(task, counts)
        pack, name = found
        seconds, nanoseconds = divmod(stamp, NS_PER_S)
        try:
            return pack(
                HEADER, seconds, nanoseconds, slot, len(name), name, scan, duration, skipped, full, *numbers
            )  # fmt: skip
        except struct.error as error:
            raise CdrError(f"{NAMES[Scan]}: {error}") from error

    return encode


def _scan_packing(task: str, counts: Sequence[int]) -> tuple[Callable[..., bytes], bytes]:
    """Return the packing of a shape and the task's name with the zero byte behind it."""
    name = task.encode() + b"\0"
    layout = _Layout()
    layout.add("i")
    layout.add("I")
    layout.add("B")
    layout.add("I")
    layout.add_bytes(len(name))
    layout.add("Q")
    layout.add("I", 2)
    layout.add("?")
    for count in counts:
        layout.add_values(count)
    layout.add_zeros(1)
    return struct.Struct(layout.text).pack, name


def write_encoder() -> Callable[[CommonWrite], bytes]:
    """Return a function that turns a CommonWrite into bytes; it keeps what it has learned about shapes."""
    general = encoder(NAMES[CommonWrite])
    packings: dict[int, Callable[..., bytes]] = {}

    def encode(message: CommonWrite) -> bytes:
        stamp, run_id, writer, slot, kind, sequence, values = message
        variables, elements, numbers, texts = values
        count = len(variables)
        if texts or not count or len(elements) != count or len(numbers) != count:
            return general(message)
        pack = packings.get(count)
        if pack is None:
            if len(packings) >= _CACHED_SHAPES:
                packings.clear()
            pack = packings[count] = _write_packing(count)
        seconds, nanoseconds = divmod(stamp, NS_PER_S)
        try:
            return pack(
                HEADER, seconds, nanoseconds, run_id, writer, slot, kind, sequence,
                count, *variables, count, *elements, count, *numbers,
            )  # fmt: skip
        except struct.error as error:
            raise CdrError(f"{NAMES[CommonWrite]}: {error}") from error

    return encode


def _write_packing(count: int) -> Callable[..., bytes]:
    layout = _Layout()
    for code in "iIQHBBQ":
        layout.add(code)
    layout.add_values(count)
    return struct.Struct(layout.text).pack
