"""Writes dBASE III tables and racks of an Executive for tests, without the package's own reader."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

SAMPLE = Path(__file__).parents[3] / "docs" / "stages" / "import" / "floppy"
"""A library with the system MILL and the rack WIND1, as the docs have it."""
WIND1 = SAMPLE / "AMXLIB" / "MILL" / "WIND1"
Fields = Sequence[tuple[str, str, int]]
"""Name, kind and length of each field."""
GONE = "deleted"
"""The key of a record that is marked as deleted."""

CARD: Fields = [
    ("MAST_SLOT", "N", 2), ("REM_DROP", "N", 2), ("SLOT", "N", 2), ("CARD_PART", "N", 3), ("NETWORK", "C", 1),
    ("NET_DEPTH", "N", 2), ("NET_DROP", "N", 2), ("DESC", "C", 40), ("WIRE_NOTE1", "N", 3), ("WIRE_NOTE2", "N", 3),
]  # fmt: skip
TASKS: Fields = [
    ("NAME", "C", 8), ("TYPE", "C", 3), ("SLOT", "N", 2), ("PRIORITY", "N", 2), ("DESC", "C", 40),
    ("CRITICAL", "L", 1), ("UTILITY", "L", 1),
]  # fmt: skip
SWVAR: Fields = [
    ("NAME", "C", 16), ("VAR_TYPE", "N", 3), ("CARD_TYPE", "N", 3), ("DEF_TYPE", "N", 1), ("MAST_SLOT", "N", 2),
    ("REM_DROP", "N", 2), ("SLOT", "N", 2), ("REGISTER", "N", 5), ("BIT", "N", 2), ("DIM1", "N", 5), ("DESC", "C", 40),
]  # fmt: skip
INTEGER, BOOLEAN, STRING = 32, 64, 128
SCAN = "10 COMMON {}\n20 CALL SCAN_LOOP(TICKS=4)\n30 END\n"


def table(fields: Fields, rows: Sequence[Mapping[str, object]], code_page: str = "cp437") -> bytes:
    """Return a table: texts stand left, numbers right, what is None or missing is blank."""
    width = 1 + sum(length for *_, length in fields)
    head = struct.pack("<B3BIHH20x", 3, 96, 3, 14, len(rows), 33 + 32 * len(fields), width)
    for name, kind, length in fields:
        head += struct.pack("<11sc4xBB14x", name.encode(), kind.encode(), length, 0)
    body = b""
    for row in rows:
        body += b"*" if row.get(GONE) else b" "
        for name, kind, length in fields:
            value = row.get(name)
            text = "" if value is None else "TF"[not value] if kind == "L" else str(value)
            raw = text.encode(code_page)
            body += raw.rjust(length) if kind == "N" else raw.ljust(length)
    return head + b"\r" + body + b"\x1a"


def processor(slot: int = 1, part: int = 2, **more: object) -> dict[str, object]:
    """The record of a Processor with a tick of 5.5 ms."""
    return {"MAST_SLOT": slot, "SLOT": slot, "CARD_PART": part, "WIRE_NOTE1": 21, "WIRE_NOTE2": 124, **more}


def card(slot: int, part: int, **more: object) -> dict[str, object]:
    return {"MAST_SLOT": slot, "SLOT": slot, "REM_DROP": 0, "CARD_PART": part, **more}


def task(name: str, slot: int = 1, priority: object = 5, kind: str = "BLK", **more: object) -> dict[str, object]:
    return {"NAME": name, "TYPE": kind, "SLOT": slot, "PRIORITY": priority, **more}


def memory(name: str, kind: int = INTEGER, kept: bool = False, **more: object) -> dict[str, object]:
    return {"NAME": name, "VAR_TYPE": kind, "DEF_TYPE": 3 if kept else 2, **more}


def point(name: str, slot: int, register: int, bit: int | None = None, **more: object) -> dict[str, object]:
    kind = INTEGER if bit is None else BOOLEAN
    places = {"MAST_SLOT": slot, "SLOT": slot, "REGISTER": register, "BIT": -1 if bit is None else bit}
    return {"NAME": name, "VAR_TYPE": kind, "DEF_TYPE": 0, **places, **more}


def rack(
    folder: Path,
    cards: Sequence[Mapping[str, object]] = (),
    tasks: Sequence[Mapping[str, object]] = (),
    variables: Sequence[Mapping[str, object]] = (),
    files: Mapping[str, str | bytes] | None = None,
) -> Path:
    """Write a rack's folder: three tables, and files with the ends of lines and of the file that DOS writes."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "$CARD.DBF").write_bytes(table(CARD, cards))
    (folder / "$TASKS.DBF").write_bytes(table(TASKS, tasks))
    (folder / "$SWVAR.DBF").write_bytes(table(SWVAR, variables))
    for name, text in (files or {}).items():
        data = text if isinstance(text, bytes) else text.replace("\n", "\r\n").encode("cp437") + b"\x1a"
        (folder / name).write_bytes(data)
    return folder
