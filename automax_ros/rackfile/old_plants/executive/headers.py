"""Says what the headers of an Executive's tables hold, and how many values: no text of the plant is in it.

Names of racks, variables and tasks, descriptions and people stay out, so that the result can be given away. Numbers are
codes, slots and registers: of these the values are shown with how often they occur. An index (.NDX) has the expression
of its key as text in its first block of 512 bytes, which names fields.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from automax_ros.core.text import count_of, printable, table
from automax_ros.rackfile.old_plants.executive.dbase import Column, DbaseTable
from automax_ros.rackfile.old_plants.executive.disks import read_file
from automax_ros.rackfile.old_plants.executive.fields import TABLES, columns_of
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import TABLE_SUFFIX, DiskFolder, RackPlace
from automax_ros.rackfile.reading.files import FileFault, read_bytes

_MOST_VALUES = 12
_LETTERS = 1
"""Longest texts whose values are shown: letters of networks and drives name nothing."""
_INDEX = ".NDX"
_INDEX_BLOCK, _KEY_AT = 512, 24
_MOST_INDEX_BYTES = 20_000_000
_KEY = re.compile(rb"[ -~]{1,220}")


def headers_of(places: Sequence[RackPlace], code_page: str | None, findings: Findings) -> Iterator[str]:
    """Yield the lines about the tables of some racks and their systems; racks and systems have numbers, no names."""
    systems: dict[Path, DiskFolder] = {place.system.path: place.system for place in places if place.system is not None}
    for number, folder in enumerate(systems.values(), 1):
        yield from _folder(f"system {number}", folder, code_page, findings)
    for number, place in enumerate(places, 1):
        yield from _folder(f"rack {number}", place.rack, code_page, findings)


def _folder(title: str, folder: DiskFolder, code_page: str | None, findings: Findings) -> Iterator[str]:
    for name, path in folder.files.items():
        if not name.startswith("$"):
            continue
        if name.endswith(TABLE_SUFFIX):
            known = name.removeprefix("$").removesuffix(TABLE_SUFFIX)
            found = read_file(known, path, code_page, findings)
            yield ""
            yield from [f"{title}: {printable(name)}: cannot be read"] if found is None else _table(title, known, found)
        elif name.endswith(_INDEX):
            yield f"{title}: {printable(name)}: key {_key_of(path)}"


def _table(title: str, name: str, found: DbaseTable) -> Iterator[str]:
    deleted = len(found.rows) - len(found.present)
    records = f"{count_of(len(found.rows), 'record')}, {deleted} deleted"
    sizes = f"header of {found.header_length} bytes, {found.record_length} per record"
    day = "-".join(f"{part:02}" for part in found.changed)
    yield f"{title}: {found.file}: {records}, {sizes}, changed {day}, code page {found.code_page}"
    keys: dict[str, str] = {}
    if name in TABLES:
        keys = {column.name: key for key, column in columns_of(found, name, (), Findings()).items()}
    rows = [("  field", "kind", "length", "read as", "filled", "different", "values")]
    for column in found.columns:
        size = f"{column.length},{column.decimals}" if column.decimals else str(column.length)
        rows.append(
            (f"  {printable(column.name)}", column.kind, size, keys.get(column.name, "-"), *_values(found, column))
        )
    yield from table(rows, right=(2, 4, 5))


def _values(found: DbaseTable, column: Column) -> tuple[str, str, str]:
    """Return how many values there are, how many different ones, and those that name nothing."""
    texts = Counter(str(value) for row in found.present if (value := found.value(row, column)[0]) not in (None, ""))
    wrong = sum(bool(found.value(row, column)[1]) for row in found.present)
    shown = ""
    if column.kind in "NFL" or all(len(text) <= _LETTERS for text in texts):
        listed = sorted(texts.items(), key=lambda item: (-item[1], len(item[0]), item[0]))
        shown = ", ".join(f"{text} x{count}" for text, count in listed[:_MOST_VALUES])
        shown += ", ..." if len(listed) > _MOST_VALUES else ""
    else:
        longest = max(map(len, texts), default=0)
        shown = f"texts of at most {longest}"
    if wrong:
        shown += f"; {wrong} not readable"
    return str(texts.total()), str(len(texts)), printable(shown)


def _key_of(path: Path) -> str:
    try:
        block = read_bytes(path, _MOST_INDEX_BYTES)[:_INDEX_BLOCK]
    except FileFault as fault:
        return f"cannot be read: {fault}"
    match = _KEY.match(block[_KEY_AT:].lstrip(b"\0"))
    return match[0].decode("ascii").strip() if match else "is not text"
