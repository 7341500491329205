"""Messages decoded only as far as a reader needs them: scans for their errors, writes for some of the variables."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection
from functools import cache
from typing import Any, NamedTuple

from automax_ros.messages.cdr.cdr import decoder, encode, head_reader
from automax_ros.messages.types.messages import NAMES, NO_VALUES, CommonWrite, Scan

_COUNT = struct.Struct("<I")
_NO_ERRORS = bytes(_COUNT.size)
_MOST_NUMBERS = 64
"""Most variables of a write that are looked at before it is decoded."""


class _ScanHead(NamedTuple):
    stamp: int
    slot: int
    task: str
    scan: int


class _WriteHead(NamedTuple):
    stamp: int
    run_id: int
    writer: int
    slot: int
    kind: int
    sequence: int


def decode_errors(data: bytes) -> Any:
    """Return a Scan; one without errors has only stamp, slot, task and number.

    Its list of errors is its last field, and no error has the number 0.

    Raises:
        CdrError: the bytes are not a Scan, as far as they are read.
    """
    if data[-_COUNT.size :] == _NO_ERRORS:
        return Scan(*_scan_head()(data))
    return decoder(NAMES[Scan])(data)


def decode_writes_of(
    wanted: Collection[int], variables: Collection[int], writers: Collection[int]
) -> Callable[[bytes], Any]:
    """Return the function that decodes a CommonWrite: its values only if one is of a variable in ``wanted``.

    Those of ``writers``, and those of a variable that is not in ``variables``, are decoded too. The function raises
    CdrError.
    """
    needed, known, always = frozenset(wanted), frozenset(variables), frozenset(writers)
    whole, head = decoder(NAMES[CommonWrite]), head_reader(NAMES[CommonWrite], _WriteHead)
    start = len(encode(CommonWrite(0, 0, 0, 0, 0, 0, NO_VALUES))) - len(NO_VALUES) * _COUNT.size
    numbers = [struct.Struct(f"<{count}H") for count in range(_MOST_NUMBERS)]

    def decode_write(data: bytes) -> Any:
        try:
            (count,) = _COUNT.unpack_from(data, start)
            found = numbers[count].unpack_from(data, start + _COUNT.size)
        except (struct.error, IndexError):
            return whole(data)
        if not needed.isdisjoint(found) or not known.issuperset(found):
            return whole(data)
        stamp, run_id, writer, slot, kind, sequence = head(data)
        if writer in always:
            return whole(data)
        return CommonWrite(stamp, run_id, writer, slot, kind, sequence, NO_VALUES)

    return decode_write


@cache
def _scan_head() -> Callable[[bytes], Any]:
    return head_reader(NAMES[Scan], _ScanHead)
