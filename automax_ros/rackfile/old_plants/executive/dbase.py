"""Reads dBASE III tables: a small reader of our own, since libraries lose rows of damaged files silently.

A header has 32 bytes (03h, day of the last change, number of records, length of the header and of a record), 32 bytes
for each field, 0Dh; records have a fixed length, a blank in front or ``*`` where they are deleted; 1Ah ends the file.
What disks of thirty years do to it is told, and every record that is there whole is kept:

* the number of records is what the header says and what the file holds, whichever is more (decision);
* a record whose flag is neither a blank nor ``*`` is kept, 1Ah in the middle included (decision);
* a wrong length of header or records is replaced by that of the fields if the number of records then agrees (decision).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from automax_ros.core.text import count_of, printable
from automax_ros.core.user_error import UserError
from automax_ros.rackfile.old_plants.executive.findings import Findings, records_text

MAX_TABLE_BYTES = 8_000_000
"""Largest table that is read (decision: a bound on untrusted files; 20,000 variables of 400 bytes)."""
MAX_FIELDS = 128
"""Most fields of a dBASE III table."""
MAX_RECORDS = 65_536
"""Most records that are read (decision: a bound on untrusted files)."""
CODE_PAGES = ("cp437", "cp850", "cp852", "cp865", "cp866", "cp1250", "cp1251", "cp1252", "latin-1")
"""Code pages that may be chosen."""
DEFAULT_CODE_PAGE = "cp437"
"""Code page of texts: dBASE III marks none (decision: that of an American DOS)."""
_MARKED = {0x01: "cp437", 0x02: "cp850", 0x03: "cp1252", 0x57: "cp1252", 0x64: "cp852", 0x65: "cp866", 0x66: "cp865",
           0xC8: "cp1250", 0xC9: "cp1251"}  # fmt: skip
"""Code pages by the mark in byte 29, which dBASE IV writes."""
_HEADER, _FIELD = 32, 32
_VERSIONS = (0x03, 0x83)
"""The first byte without and with texts of any length in a file apart."""
_KINDS = {"C": "CHARACTER", "N": "NUMERIC", "L": "BOOLEAN", "D": "DATE", "M": "MEMO", "F": "FLOAT"}
_BLANK, _DELETED, _END, _LAST_FIELD = 0x20, 0x2A, 0x1A, 0x0D
_NAME = re.compile(rb"[A-Z][A-Z0-9_]{0,9}\Z")
_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)\Z")
_WIDEST = 19
"""Most characters of a number in dBASE III."""

Value = str | int | float | bool | None
"""A value of a record: None where the field is blank or cannot be read."""


class DbaseFault(UserError):
    """A file cannot be read as a dBASE III table (AMX6789)."""

    def __init__(self, message: str, file: str, hint: str | None = None) -> None:
        super().__init__(message, hint, code="AMX6789", place=file)


@dataclass(frozen=True)
class Column:
    """A field of a table: its kind is a letter (C, N, L, D, M, F), ``start`` its place in a record, from 0."""

    name: str
    kind: str
    length: int
    decimals: int
    start: int

    def __str__(self) -> str:
        return f"{self.name} {self.kind}({self.length}{f',{self.decimals}' if self.decimals else ''})"


@dataclass(frozen=True)
class Row:
    """A record as it lies in the file, with its flag: ``number`` counts from 1, deleted records included."""

    number: int
    data: bytes

    @property
    def deleted(self) -> bool:
        """Whether the record is marked as deleted."""
        return self.data[0] == _DELETED


@dataclass(frozen=True)
class DbaseTable:
    """A table: ``changed`` is the day of its last change as year, month and day, as the header has them.

    ``marked``: the file or the user says which code page its texts have.
    """

    file: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    code_page: str
    marked: bool
    record_length: int
    header_length: int
    changed: tuple[int, int, int]

    @property
    def present(self) -> list[Row]:
        """The records that are not deleted."""
        return [row for row in self.rows if not row.deleted]

    def value(self, row: Row, column: Column) -> tuple[Value, str]:
        """Return the value of a field and, if it cannot be read as its kind, what stands there."""
        raw = row.data[column.start : column.start + column.length]
        if column.kind in "NF":
            return _number(raw)
        if column.kind == "L":
            return _flag(raw)
        return raw.decode(self.code_page, errors="replace").rstrip(" \0"), ""


def read_dbase(data: bytes, file: str, findings: Findings, code_page: str | None = None) -> DbaseTable:
    """Return the table in a file's bytes; ``file`` names it in findings, which tell every damage of a table.

    Raises:
        DbaseFault: AMX6789, the header is not that of a table, is cut, or contradicts itself.
    """
    if len(data) > MAX_TABLE_BYTES:
        raise DbaseFault(f"the table has more than {MAX_TABLE_BYTES} bytes", file)
    if len(data) <= _HEADER:
        message = f"the file has {count_of(len(data), 'byte')}: the header of a dBASE table alone has more"
        raise DbaseFault(message, file, "copy it from the disk again, or from the backup")
    first = "" if data[0] in _VERSIONS else f"the first byte is {data[0]:02X}h, not the 03h of dBASE III"
    damage = Findings()
    try:
        table = _Reader(data, file, damage).table(code_page)
    except DbaseFault as fault:
        raise DbaseFault(f"{first}; {fault.message}" if first else fault.message, file, fault.hint) from fault
    if first:
        findings.add("AMX6790", f"{first}: read all the same", file)
    findings.extend(damage)
    return table


class _Reader:
    def __init__(self, data: bytes, file: str, findings: Findings) -> None:
        self._data, self._file, self._findings = data, file, findings
        self._count, self._header, self._length = struct.unpack_from("<IHH", data, 4)

    def table(self, code_page: str | None) -> DbaseTable:
        columns, after = self._columns()
        width = 1 + sum(column.length for column in columns)
        start = self._start(after, width)
        rows = tuple(self._rows(start, width))
        self._tell_flags(rows)
        mark = _MARKED.get(self._data[29])
        year, month, day = self._data[1:4]
        return DbaseTable(
            self._file,
            tuple(columns),
            rows,
            code_page or mark or DEFAULT_CODE_PAGE,
            mark is not None or code_page is not None,
            width,
            start,
            (1900 + year, month, day),
        )

    def _tell(self, message: str, record: int | None = None, *, lost: bool = False) -> None:
        self._findings.add("AMX6789" if lost else "AMX6790", message, self._file, record)

    def _columns(self) -> tuple[list[Column], int]:
        """Return the fields, and the place after the byte that ends them."""
        columns: list[Column] = []
        place, start = _HEADER, 1
        while True:
            if place >= len(self._data):
                raise DbaseFault("the header is cut: its list of fields does not end", self._file, _AGAIN)
            if self._data[place] == _LAST_FIELD:
                break
            if columns and self._header in (place + 1, place + 2):
                self._tell(f"the list of fields ends in {self._data[place]:02X}h, not 0Dh: its length ends it")
                break
            if len(columns) == MAX_FIELDS:
                raise DbaseFault(f"the header has more than {MAX_FIELDS} fields", self._file, _AGAIN)
            if place + _FIELD > len(self._data):
                raise DbaseFault("the header is cut in its list of fields", self._file, _AGAIN)
            columns.append(self._column(place, len(columns) + 1, start, {column.name for column in columns}))
            start += columns[-1].length
            place += _FIELD
        if not columns:
            raise DbaseFault("the header has no fields", self._file, _AGAIN)
        return columns, place + 1

    def _column(self, place: int, number: int, start: int, taken: set[str]) -> Column:
        raw = self._data[place : place + 11].partition(b"\0")[0].rstrip(b" ").upper()
        name, kind = raw.decode("ascii", errors="replace"), chr(self._data[place + 11])
        if not _NAME.match(raw) or name in taken:
            why = "has that name too" if name in taken else f"has the name {printable(name)!r}, which is none"
            name = f"FIELD_{number}"
            self._tell(f"field {number} {why}: it is called {name} here")
        if kind not in _KINDS:
            self._tell(f"field {name} is of the kind {printable(kind)!r}, which dBASE III does not have: read as text")
            kind = "C"
        length, decimals = self._data[place + 16], self._data[place + 17]
        if not length:
            raise DbaseFault(f"field {name} has the length 0", self._file, _AGAIN)
        if kind == "N" and length > _WIDEST:
            self._tell(f"field {name} has {length} digits; dBASE III has at most {_WIDEST}")
        return Column(name, kind, length, decimals, start)

    def _agrees(self, start: int, width: int) -> bool:
        """Return whether as many records as the header says end where the file, or its end mark, does."""
        end = start + self._count * width
        return self._count > 0 and end <= len(self._data) and self._data[end : end + 1] in (b"", bytes([_END]))

    def _start(self, after: int, width: int) -> int:
        """Return where the records begin."""
        sound = self._header in (after, after + 1) or (
            after < self._header <= len(self._data) and self._agrees(self._header, width)
        )
        start = self._header if sound else after
        if self._length == width and sound:
            return start
        what = f"the header says {self._length} bytes per record and {self._header} of its own; its fields make "
        what += f"{width} and {after}"
        if not self._agrees(start, width):
            raise DbaseFault(what, self._file, _AGAIN)
        self._tell(f"{what}: with these, the number of records agrees")
        return start

    def _rows(self, start: int, width: int) -> Iterator[Row]:
        data, place, number, cut = self._data, start, 0, 0
        while place < len(data):
            rest = len(data) - place
            if data[place] == _END and (number >= self._count or not data[place:].strip(b"\x1a\0")):
                break
            if rest < width:
                if data[place:].strip(b"\x1a\0 "):
                    message = f"the file ends in the middle of a record, after {rest} of {width} bytes: it is left out"
                    self._tell(message, number + 1, lost=True)
                    cut = 1
                break
            if number >= self._count and data[place] not in (_BLANK, _DELETED):
                break
            if number >= MAX_RECORDS:
                self._tell(f"the table has more than {MAX_RECORDS} records: the others are not read", lost=True)
                return
            number += 1
            yield Row(number, data[place : place + width])
            place += width
        self._tell_end(place, number, cut)

    def _tell_end(self, place: int, number: int, cut: int) -> None:
        """Tell what is missing after ``number`` records and a ``cut`` one, and what follows."""
        tail = self._data[place:]
        left = len(tail.strip(b"\x1a\0 ")) if number >= self._count else 0
        if number + cut < self._count:
            missing = self._count - number - cut
            message = f"the header says {self._count} records, the file holds {number}"
            message += " and a part of one" if cut else ""
            ended = tail[:1] == bytes([_END])
            message += ": is its number wrong?" if ended else f": {missing} {'is' if missing == 1 else 'are'} missing"
            self._tell(message, lost=not ended)
        elif number > self._count:
            self._tell(f"the header says {self._count} records, the file holds {number}: all are read")
        if left and not cut:
            self._tell(f"{count_of(left, 'byte')} follow the last record: they are not read", lost=True)
        elif not tail:
            self._tell("the mark 1Ah at the end of the file is missing")

    def _tell_flags(self, rows: tuple[Row, ...]) -> None:
        odd = [row for row in rows if row.data[0] not in (_BLANK, _DELETED)]
        if odd:
            flags = ", ".join(sorted({f"{row.data[0]:02X}h" for row in odd})[:3])
            numbers = records_text(row.number for row in odd)
            self._tell(f"{numbers}: the flag in front is {flags}, neither a blank nor `*`: kept", odd[0].number)


_AGAIN = "the file is damaged or is not a dBASE table: copy it from the disk again, or from the backup"


def _number(raw: bytes) -> tuple[Value, str]:
    text = raw.decode("latin-1").strip(" ")
    if not text:
        return None, ""
    if not _NUMBER.match(text):
        return None, text
    value = float(text) if "." in text else int(text)
    return (int(value) if value == int(value) else value), ""


def _flag(raw: bytes) -> tuple[Value, str]:
    text = raw.decode("latin-1").strip(" ?").upper()
    if not text:
        return None, ""
    return (text in "TY", "") if text in ("T", "Y", "F", "N") else (None, text)
