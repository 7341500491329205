"""Decodes many CDR messages of one type at once: those of the same sizes form a matrix, with fields as its columns.

The bounds are those of the scalar decoder in ``messages/cdr/cdr.py``. Messages that do not fit, have texts in a
sequence, or sizes that few others share, are reported as odd: the scalar decoder must decode them, and its errors
count.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import MAX_TRAILING
from automax_ros.messages.cdr.parts import CODES, HEADER, size_of
from automax_ros.messages.types.definitions import TIME, message_types

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Array = NDArray[Any]

FEWEST = 8
"""Least number of messages of the same sizes that a matrix is made for (decision: 100 us against 4 to 10 us each)."""
MOST_ITEMS = 64
"""Longest sequence of messages that is read as columns."""
_COUNT = np.dtype("<u4")
_BYTE = np.dtype(np.uint8)


@dataclass(frozen=True)
class MessageColumns:
    """Messages of the same sizes: ``rows`` are their numbers, ascending.

    ``fields`` has a column for each number or time (ns), a matrix with one row per message for a sequence, and the
    matrix of its bytes for a text. The fields of a nested message have its name and a dot as prefix.
    """

    rows: Ints
    fields: Mapping[str, Array]


@dataclass(frozen=True)
class _Matrix:
    """Messages of the same sizes, read up to ``position``."""

    rows: Ints
    bytes: Bytes
    position: int
    fields: dict[str, Array]

    @property
    def length(self) -> int:
        return int(self.bytes.shape[1])

    def aligned(self, size: int) -> int:
        return self.position + (len(HEADER) - self.position) % size

    def column(self, position: int, kind: np.dtype[Any], count: int = 1) -> Array | None:
        end = position + kind.itemsize * count
        return self.bytes[:, position:end].view(kind) if end <= self.length else None

    def then(self, position: int, name: str = "", field: Array | None = None) -> _Matrix:
        fields = self.fields if field is None else {**self.fields, name: field}
        return _Matrix(self.rows, self.bytes, position, fields)

    def only(self, chosen: Array) -> _Matrix:
        fields = {name: field[chosen] for name, field in self.fields.items()}
        return _Matrix(self.rows[chosen], self.bytes[chosen], self.position, fields)

    def by_count(self) -> Iterator[tuple[int, _Matrix]]:
        """Read the length of a text or sequence; yield a matrix for each length, but none for a length that is rare."""
        start = self.aligned(_COUNT.itemsize)
        counts = self.column(start, _COUNT)
        if counts is None:
            return
        flat = counts[:, 0]
        following = self.then(start + _COUNT.itemsize)
        if (flat == flat[0]).all():
            yield int(flat[0]), following
            return
        for rows in _alike(flat):
            if len(rows) >= FEWEST:
                yield int(flat[rows[0]]), following.only(rows)


_Read = Callable[[_Matrix], Iterator[_Matrix]]


def decode_columns(type_name: str, data: Bytes, starts: Ints, lengths: Ints) -> tuple[list[MessageColumns], Ints]:
    """Decode messages of a type, which begin at ``starts`` of ``data`` and have ``lengths`` bytes.

    Returns the columns of those that fit, and the numbers of odd messages, ascending.
    """
    found: list[MessageColumns] = []
    odd = np.ones(len(starts), bool)
    readers = _readers(type_name)
    for rows in _alike(lengths):
        length = int(lengths[rows[0]])
        if len(rows) < FEWEST or length < len(HEADER):
            continue
        for matrix in _read_all(_Matrix(rows, _gathered(data, starts[rows], length), 0, {}), readers):
            if matrix.length - matrix.position <= MAX_TRAILING:
                found.append(MessageColumns(matrix.rows, matrix.fields))
                odd[matrix.rows] = False
    return found, np.flatnonzero(odd)


def _alike(keys: Array) -> Iterator[Ints]:
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    yield from (part for part in np.split(order, np.flatnonzero(ordered[1:] != ordered[:-1]) + 1) if len(part))


def _gathered(data: Bytes, starts: Ints, length: int) -> Bytes:
    places = np.ndarray((len(data) - length + 1,), dtype=f"V{length}", buffer=data, strides=(1,))
    found: Bytes = places[starts].view(_BYTE).reshape(len(starts), length)
    return found


def _read_all(matrix: _Matrix, readers: Sequence[_Read]) -> Iterator[_Matrix]:
    if not readers:
        yield matrix
        return
    for following in readers[0](matrix):
        yield from _read_all(following, readers[1:])


@functools.cache
def _readers(type_name: str) -> tuple[_Read, ...]:
    return (_read_header, *_field_readers(type_name, ""))


def _field_readers(type_name: str, prefix: str) -> Iterator[_Read]:
    for field in message_types()[type_name].definition.fields:
        name = prefix + field.name
        if field.kind == TIME:
            yield functools.partial(_read_time, name)
        elif field.kind in CODES:
            kind = np.dtype("u1" if field.kind == "bool" else f"<{CODES[field.kind]}")
            yield functools.partial(_read_numbers if field.array else _read_number, name, kind)
        elif field.kind == "string":
            yield _read_no_texts if field.array else functools.partial(_read_text, name)
        elif field.array:
            yield functools.partial(_read_items, name, _members(field.kind))
        else:
            yield from _field_readers(field.kind, f"{name}.")


@functools.cache
def _members(type_name: str) -> tuple[tuple[str, str], ...]:
    """Return names and codes of the fields of a message in a sequence: all of them single numbers."""
    fields = message_types()[type_name].definition.fields
    if any(field.array or field.kind not in CODES for field in fields):
        raise TypeError(f"no columns for sequences of {type_name}")
    return tuple((field.name, CODES[field.kind]) for field in fields)


def _read_header(matrix: _Matrix) -> Iterator[_Matrix]:
    fits = (matrix.bytes[:, : len(HEADER)] == np.frombuffer(HEADER, np.uint8)).all(axis=1)
    yield from _fitting(matrix.then(len(HEADER)), fits)


def _read_number(name: str, kind: np.dtype[Any], matrix: _Matrix) -> Iterator[_Matrix]:
    start = matrix.aligned(kind.itemsize)
    column = matrix.column(start, kind)
    if column is not None:
        yield matrix.then(start + kind.itemsize, name, column[:, 0])


def _read_time(name: str, matrix: _Matrix) -> Iterator[_Matrix]:
    start = matrix.aligned(4)
    seconds, rest = matrix.column(start, np.dtype("<i4")), matrix.column(start + 4, _COUNT)
    if seconds is not None and rest is not None:
        stamps = seconds[:, 0].astype(np.int64) * NS_PER_S + rest[:, 0].astype(np.int64)
        yield from _fitting(matrix.then(start + 8, name, stamps), rest[:, 0] < NS_PER_S)


def _read_text(name: str, matrix: _Matrix) -> Iterator[_Matrix]:
    for count, following in matrix.by_count():
        end = following.position + count
        if end > following.length:
            continue
        text = following.bytes[:, following.position : max(end - 1, following.position)]
        fits = np.asarray((text < 0x80).all(axis=1))
        if count:
            fits &= following.bytes[:, end - 1] == 0
        yield from _fitting(following.then(end, name, text), fits)


def _read_no_texts(matrix: _Matrix) -> Iterator[_Matrix]:
    for count, following in matrix.by_count():
        if not count:
            yield following


def _read_numbers(name: str, kind: np.dtype[Any], matrix: _Matrix) -> Iterator[_Matrix]:
    for count, following in matrix.by_count():
        start = following.aligned(kind.itemsize) if count else following.position
        numbers = following.column(start, kind, count) if count else np.zeros((len(following.rows), 0), kind)
        if numbers is not None:
            yield following.then(start + count * kind.itemsize, name, numbers)


def _read_items(name: str, members: tuple[tuple[str, str], ...], matrix: _Matrix) -> Iterator[_Matrix]:
    for count, following in matrix.by_count():
        made = None if count > MOST_ITEMS else _items(name, members, count, following)
        if made is not None:
            yield made


def _items(name: str, members: tuple[tuple[str, str], ...], count: int, matrix: _Matrix) -> _Matrix | None:
    """Read a sequence of messages; return None if the bytes end before."""
    columns: dict[str, list[Array]] = {member: [] for member, _ in members}
    for _ in range(count):
        for member, code in members:
            start = matrix.aligned(size_of(code))
            column = matrix.column(start, np.dtype(f"<{code}"))
            if column is None:
                return None
            columns[member].append(column)
            matrix = matrix.then(start + size_of(code))
    for member, code in members:
        none = np.zeros((len(matrix.rows), 0), f"<{code}")
        matrix = matrix.then(matrix.position, f"{name}.{member}", np.hstack([none, *columns[member]]))
    return matrix


def _fitting(matrix: _Matrix, fits: Array) -> Iterator[_Matrix]:
    if fits.all():
        yield matrix
    elif fits.any():
        yield matrix.only(fits)
