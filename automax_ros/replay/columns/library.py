"""Machine code for replay by columns: ``columns.c``, built once and kept in the cache of native code.

Where it is not wanted, does not pay or cannot be built, a replay goes scan by scan, and is only slower.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from automax_ros.messages.cdr.cdr import MAX_TRAILING
from automax_ros.messages.cdr.parts import CODES, size_of
from automax_ros.messages.types.definitions import TIME, Field, message_types, short_name
from automax_ros.messages.types.messages import NAMES, CommonWrite, Scan
from automax_ros.recordings.mcap.chunk_table import MESSAGE_HEAD, MOST_MESSAGES, ChunkTable, definition_at
from automax_ros.recordings.mcap.unpacking import Buffer
from automax_ros.replay.columns.entries import Entries, Ints, ValueRules

MACROS = (Path(__file__).parent / "cdr_fields.h").read_text(encoding="utf-8")
"""The macros, which must precede the generated functions once."""
_TYPES = {"?": "uint8_t", "B": "uint8_t", "b": "int8_t", "H": "uint16_t", "h": "int16_t", "I": "uint32_t"}
_TYPES |= {"i": "int32_t", "Q": "uint64_t", "q": "int64_t"}


@dataclass(frozen=True)
class FieldsSource:
    """A C function ``function`` that finds the fields of a type.

    ``numbers`` are the names of single numbers and times (ns), ``lists`` those of texts and sequences, in their order;
    fields of a nested message have its name and a dot as prefix. No length is trusted: a message whose fields do not
    lie within its bytes is reported as one that does not fit, and so is one that only the scalar decoder can check.
    """

    function: str
    text: str
    numbers: tuple[str, ...]
    lists: tuple[str, ...]


def fields_source(type_name: str) -> FieldsSource:
    """Return the function of a type.

    Raises:
        TypeError: the type has fields that these functions cannot find.
    """
    numbers: list[str] = []
    lists: list[str] = []
    lines = list(_lines(type_name, "", numbers, lists))
    function = f"automax_find_{short_name(type_name).rpartition('/')[2]}"
    head = f"FIND({function},"
    return FieldsSource(function, "\n".join((head, *lines, ")")), tuple(numbers), tuple(lists))


def _lines(type_name: str, prefix: str, numbers: list[str], lists: list[str]) -> Iterator[str]:
    for field in message_types()[type_name].definition.fields:
        name = prefix + field.name
        if field.kind not in CODES and field.kind not in (TIME, "string") and not field.array:
            yield from _lines(field.kind, f"{name}.", numbers, lists)
        elif field.kind == "string" and field.array:
            yield "    TEXTS()"
        elif field.array or field.kind == "string":
            macro = "TEXT" if field.kind == "string" else "LIST"
            yield f"    {macro}({len(lists)}, {_item_bytes(field)})"
            lists.append(name)
        else:
            yield f"    {_number(field)} /* {name} */".replace("#", str(len(numbers)))
            numbers.append(name)


def _number(field: Field) -> str:
    if field.kind == TIME:
        return "TIME(#)"
    code = CODES[field.kind]
    if code not in _TYPES:
        raise TypeError(f"{field.name} is not a whole number")
    return f"NUMBER(#, {_TYPES[code]})"


def _item_bytes(field: Field) -> str:
    if field.kind == "string":
        return "1, 1"
    if field.kind in CODES:
        return f"{size_of(CODES[field.kind])}, {size_of(CODES[field.kind])}"
    members = message_types()[field.kind].definition.fields
    sizes = {size_of(CODES[member.kind]) for member in members if member.kind in CODES and not member.array}
    if len(sizes) != 1 or any(member.array or member.kind not in CODES for member in members):
        raise TypeError(f"the items of {field.name} are not numbers of one size")
    (size,) = sizes
    return f"{size}, {size * len(members)}"


Bytes = NDArray[np.uint8]

_MOST_DEFINITIONS = 1000
_MOST_FIELDS = 32
_LEAST_ENTRY = 4
"""Fewest bytes of an entry in a message."""
_ENTRY = np.dtype([("value", "<f8"), ("element", "<u4"), ("view", "<u2"), ("unused", "<u2")])
_TEXT = (Path(__file__).parent / "columns.c").read_text(encoding="utf-8")
_MALFORMED, _FITS, _HAS_TEXTS = range(3)


@dataclass(frozen=True)
class TakenKind:
    """The fields that are read from messages of a type, by name; ``pairs`` and ``text`` may be empty."""

    type_name: str
    numbers: tuple[str, ...]
    groups: tuple[str, ...]
    pairs: str = ""
    text: str = ""


SCANS = TakenKind(
    NAMES[Scan],
    ("stamp", "scan", "duration_ns", "full"),
    ("latched", "read", "written", "committed"),
    "errors",
    "task",
)
WRITES = TakenKind(NAMES[CommonWrite], ("sequence", "kind", "run_id", "writer"), ("values",))


@lru_cache(maxsize=2)
def _source(kind: TakenKind) -> FieldsSource:
    return fields_source(kind.type_name)


def library_text() -> str:
    """Return the C source of the library."""
    functions = [_source(kind).text for kind in (SCANS, WRITES)]
    return "\n".join((f"#define MAX_TRAILING {MAX_TRAILING}", MACROS, *functions, _TEXT))


class _Address(ctypes.c_void_p):
    """The address of an array. It keeps a reference to the array, so that the memory is not freed before the call."""

    array: NDArray[Any]


class _Texts(ctypes.Structure):
    """``automax_texts``."""

    _fields_ = [("letters", ctypes.c_void_p), ("ends", ctypes.c_void_p), ("count", ctypes.c_int64)]


class _Kind(ctypes.Structure):
    """``automax_kind``."""

    _fields_ = [
        ("find", ctypes.c_void_p),
        ("numbers", ctypes.c_int64),
        ("groups", ctypes.c_int64),
        ("number", ctypes.c_void_p),
        ("group", ctypes.c_void_p),
        ("pairs", ctypes.c_int64),
        ("text", ctypes.c_int64),
    ]


class _Rules(ctypes.Structure):
    """``automax_rules``."""

    _fields_ = [("count", ctypes.c_int64), *((name, ctypes.c_void_p) for name in ("elements", "least", "most", "real"))]


@dataclass(frozen=True)
class TakenMessages:
    """The fields read from messages: numbers by name (those of uint64 as the same bits), and their entries.

    ``named`` is the index of each message's text among the given ones, -1 for others. ``odd`` are those that are
    malformed, or have entries that the variables cannot have; ``with_texts`` have texts in a sequence. ``malformed``
    are those that do not fit, or that only the scalar decoder can check, ascending.
    """

    numbers: dict[str, Ints]
    named: Ints
    odd: NDArray[np.bool_]
    with_texts: NDArray[np.bool_]
    malformed: Ints
    lists: int
    begins: Ints
    counts: Ints
    entries: NDArray[np.void]


class ColumnLibrary:
    """The functions of ``columns.c``."""

    def __init__(self, path: Path) -> None:
        """Load the library.

        Raises:
            OSError: it cannot be loaded.
        """
        self._library = ctypes.CDLL(str(path))
        self._columns = np.empty((5, 0), np.int64)
        self._definitions = np.empty(_MOST_DEFINITIONS, np.int64)

    def table(self, data: Buffer, ends: Sequence[int]) -> ChunkTable | None:
        """Return the table of the messages of chunks, which have these ends; None if there is an unexpected record."""
        if not 0 <= min(ends) <= max(ends) == len(data):
            raise ValueError("chunks that do not end with their bytes")
        if self._columns.shape[1] < min(len(data) // MESSAGE_HEAD, MOST_MESSAGES):
            self._columns = np.empty((5, min(len(data) // MESSAGE_HEAD, MOST_MESSAGES)), np.int64)
        columns, definitions, defined = self._columns, self._definitions, ctypes.c_int64()
        room = columns.shape[1]
        found = self._count(
            "automax_records",
            *(_address(np.frombuffer(data, np.uint8), np.uint8), _address(np.array(ends, np.int64), np.int64)),
            *(ctypes.c_int64(len(ends)), ctypes.c_int64(room)),
            *(_address(columns, np.int64), ctypes.c_int64(_MOST_DEFINITIONS), _address(definitions, np.int64)),
            ctypes.byref(defined),
        )
        if found <= 0:
            return None
        numbers, places, lengths, log_times, stamps = columns[:, :found].copy()
        found_definitions = tuple(definition_at(data, place) for place in definitions[: defined.value].tolist())
        return ChunkTable(
            numbers, places, lengths, log_times.view(np.uint64), stamps.view(np.uint64), found_definitions
        )

    def taken(
        self, kind: TakenKind, data: Bytes, starts: Ints, lengths: Ints, rules: ValueRules, texts: Sequence[str] = ()
    ) -> TakenMessages:
        """Read messages of a kind, which begin at ``starts`` in ``data`` and have ``lengths`` bytes."""
        count, lists = len(starts), len(kind.groups) + 1
        room = int(lengths.sum()) // _LEAST_ENTRY
        fits, odd = np.empty(count, np.uint8), np.empty(count, np.uint8)
        numbers = np.empty((len(kind.numbers), count), np.int64)
        named, begins, counts = np.empty(count, np.int64), np.empty(count, np.int64), np.empty((count, lists), np.int64)
        entries = np.empty(room, _ENTRY)
        letters = np.frombuffer("".join(texts).encode() + b"\0", np.uint8)
        ends = np.cumsum([len(text.encode()) for text in texts], dtype=np.int64)
        of_kind = self._kind(kind)
        enough = self._count(
            "automax_take",
            ctypes.byref(of_kind[0]),
            ctypes.byref(_Texts(_address(letters, np.uint8), _address(ends, np.int64), len(texts))),
            ctypes.byref(_rules(rules)),
            *(_address(data, np.uint8), ctypes.c_int64(len(data))),
            *(_address(item, np.int64) for item in (starts, lengths)),
            *(ctypes.c_int64(count), ctypes.c_int64(room), _address(fits, np.uint8), _address(odd, np.uint8)),
            *(_address(item, np.int64) for item in (numbers, named, begins, counts)),
            _address(entries, _ENTRY),
        )
        assert enough
        return TakenMessages(
            dict(zip(kind.numbers, numbers, strict=True)),
            named,
            odd != 0,
            fits == _HAS_TEXTS,
            np.flatnonzero(fits == _MALFORMED),
            lists,
            begins,
            counts,
            entries,
        )

    def picked(self, taken: TakenMessages, rows: Ints) -> list[Entries]:
        """Return the entries of some messages, list by list; pairs are entries of two numbers with values of 0."""
        lists, count = taken.lists, len(rows)
        offsets = np.empty((lists, count + 1), np.int64)
        common = (
            ctypes.c_int64(lists),
            _address(rows, np.int64),
            ctypes.c_int64(count),
            _address(taken.counts, np.int64),
        )
        self._call("automax_offsets", *common, _address(offsets, np.int64))
        totals = offsets[:, -1].tolist()
        views, elements = ([np.empty(total, np.int64) for total in totals] for _ in range(2))
        values = [np.empty(total) for total in totals]
        if any(totals):
            held = _address(taken.begins, np.int64), _address(taken.entries, _ENTRY)
            self._call("automax_pick", *common, *held, *map(_table, (views, elements, values)))
        return [Entries(*columns) for columns in zip(offsets, views, elements, values, strict=True)]

    def latched(self, entries: Entries, positions: Ints, before: Sequence[int]) -> Ints:
        """Return a row for each latched view; ``before`` are the values before (``LatchedColumns.columns``)."""
        count, width = len(entries), len(before)
        now, since = np.array(before, np.int64), np.zeros(width, np.int64)
        columns = np.empty((width, count), np.int64)
        self._call(
            "automax_latched",
            *(ctypes.c_int64(count), *_columns_of(entries), _address(positions, np.int64)),
            *(ctypes.c_int64(len(positions)), ctypes.c_int64(width)),
            *(_address(item, np.int64) for item in (now, since, columns)),
        )
        return columns

    def same_commits(self, recorded: Entries, outputs: Sequence[Ints], latched: Sequence[Ints], views: Ints) -> int:
        """Return how many scans made the recorded commits; the columns are those of the written ``views``."""
        columns = [[np.ascontiguousarray(column, np.int64) for column in group] for group in (outputs, latched)]
        count = self._count(
            "automax_same_commits",
            *(ctypes.c_int64(len(recorded)), ctypes.c_int64(len(views))),
            *(_table(group) for group in columns),
            *(_address(views, np.int64), *_columns_of(recorded)),
        )
        return int(count)

    def _kind(self, kind: TakenKind) -> tuple[_Kind, tuple[Ints, Ints]]:
        """Return the argument for the fields to read, and the arrays that must outlive it."""
        source = _source(kind)
        number = np.array([source.numbers.index(name) for name in kind.numbers], np.int64)
        group = np.array([source.lists.index(f"{name}.variable") for name in kind.groups], np.int64)
        pairs, text = (source.lists.index(name) if name else -1 for name in (kind.pairs, kind.text))
        assert max(len(source.numbers), len(source.lists)) <= _MOST_FIELDS
        find = ctypes.cast(getattr(self._library, source.function), ctypes.c_void_p)
        addresses = _address(number, np.int64), _address(group, np.int64)
        return _Kind(find, len(number), len(group), *addresses, pairs, text), (number, group)

    def _call(self, name: str, *arguments: Any) -> None:
        function = getattr(self._library, name)
        function.restype = None
        function(*arguments)

    def _count(self, name: str, *arguments: Any) -> int:
        function = getattr(self._library, name)
        function.restype = ctypes.c_int64
        return int(function(*arguments))


def _columns_of(entries: Entries) -> tuple[ctypes.c_void_p, ...]:
    """Return the addresses of offsets, views and values."""
    whole = (_address(item, np.int64) for item in (entries.offsets, entries.views))
    return *whole, _address(entries.values, np.float64)


def _table(columns: Sequence[NDArray[Any]]) -> Any:
    return (ctypes.c_void_p * (len(columns) + 1))(*(column.ctypes.data for column in columns), None)


def _rules(rules: ValueRules) -> _Rules:
    whole, reals = _address(rules.elements, np.int64), (rules.least, rules.greatest)
    return _Rules(rules.count, whole, *(_address(item, np.float64) for item in reals), _address(rules.real, np.bool_))


def _address(array: NDArray[Any], kind: Any) -> ctypes.c_void_p:
    """Return the address of an array for C; the array lives at least as long as the address.

    TypeError if its type or layout is not the one that C expects.
    """
    if array.dtype != kind or not array.flags.c_contiguous:
        raise TypeError(f"{array.dtype} where {np.dtype(kind)} stands in one piece")
    address = _Address(array.ctypes.data)
    address.array = array
    return address
