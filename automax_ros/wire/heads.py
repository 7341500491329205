"""The first fields of a rack's messages, read from their CDR bytes without decoding the rest.

A recorder of a live rack has to know where a message belongs, and stores its bytes as they came.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from automax_ros.wire.cdr import HEADER, CdrError

_SECOND = 1_000_000_000
_WRITE = struct.Struct("<4xiIQHBB4xQ")
_IMAGE = struct.Struct("<4xiIQQ")
_SCAN = struct.Struct("<4xiIB3xI")
_NUMBER = struct.Struct("<QII?")
_MAX_TASK = 64


class WriteHead(NamedTuple):
    """Where a CommonWrite or CommonImage stands: its stamp in ns, its run, its number in the write log."""

    stamp: int
    run_id: int
    sequence: int


class ScanHead(NamedTuple):
    """Where a Scan stands: its stamp in ns, its task, its number, and whether it holds all that was latched."""

    stamp: int
    task: str
    scan: int
    full: bool


def write_head(payload: bytes) -> WriteHead:
    """Return the head of a CommonWrite.

    Raises:
        CdrError: the bytes are none.
    """
    seconds, nanoseconds, run_id, _, _, _, sequence = _unpacked(_WRITE, payload, "CommonWrite")
    return WriteHead(seconds * _SECOND + nanoseconds, run_id, sequence)


def image_head(payload: bytes) -> WriteHead:
    """Return the head of a CommonImage.

    Raises:
        CdrError: the bytes are none.
    """
    seconds, nanoseconds, run_id, sequence = _unpacked(_IMAGE, payload, "CommonImage")
    return WriteHead(seconds * _SECOND + nanoseconds, run_id, sequence)


def scan_head(payload: bytes) -> ScanHead:
    """Return the head of a Scan.

    Raises:
        CdrError: the bytes are none.
    """
    seconds, nanoseconds, _, length = _unpacked(_SCAN, payload, "Scan")
    start = _SCAN.size
    if not 0 < length <= _MAX_TASK:
        raise CdrError(f"a Scan whose task has a name of {length} bytes")
    task = payload[start : start + length - 1]
    end = start + length
    # Numbers of eight bytes stand at multiples of eight, counted from behind the header.
    position = end + (len(HEADER) - end) % 8
    try:
        scan, _, _, full = _NUMBER.unpack_from(payload, position)
        return ScanHead(seconds * _SECOND + nanoseconds, task.decode("ascii"), scan, full)
    except (struct.error, UnicodeDecodeError) as error:
        raise CdrError(f"a Scan of {len(payload)} bytes: {error}") from error


def _unpacked(form: struct.Struct, payload: bytes, name: str) -> tuple[int, ...]:
    if payload[:4] != HEADER:
        raise CdrError(f"a {name} that starts with {payload[:4].hex(' ')}, not with 00 01 00 00 (little-endian CDR)")
    try:
        return form.unpack_from(payload)
    except struct.error as error:
        raise CdrError(f"a {name} of {len(payload)} bytes: {error}") from error
