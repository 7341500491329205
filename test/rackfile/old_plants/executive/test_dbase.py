"""The reader of dBASE III: whole tables as the library `dbf` reads them, damaged ones without losing a row silently."""

from __future__ import annotations

import contextlib

import dbf
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.rackfile.old_plants.executive import dbase
from automax_ros.rackfile.old_plants.executive.dbase import MAX_TABLE_BYTES, DbaseFault, read_dbase
from automax_ros.rackfile.old_plants.executive.findings import Findings
from rackfile.old_plants.executive.disks import GONE, WIND1, table

FIELDS = [("NAME", "C", 8), ("REG", "N", 5), ("ON", "L", 1)]
ROWS = [{"NAME": f"ROW{number}", "REG": number, "ON": bool(number % 2), GONE: number == 4} for number in range(1, 10)]
WHOLE = table(FIELDS, ROWS)
HEADER, WIDTH = 33 + 3 * 32, 15


def read(data, code_page=None):
    findings = Findings()
    found = read_dbase(bytes(data), "$T.DBF", findings, code_page)
    return found, [(item.code, item.message) for item in findings.items]


def names(found):
    return [found.value(row, found.columns[0])[0] for row in found.rows]


ALL = [f"ROW{number}" for number in range(1, 10)]


def test_a_whole_table_has_its_rows_and_nothing_to_tell():
    found, told = read(WHOLE)
    assert (names(found), told) == (ALL, [])
    assert [row.number for row in found.rows if row.deleted] == [4]
    assert [str(column) for column in found.columns] == ["NAME C(8)", "REG N(5)", "ON L(1)"]
    assert [found.value(found.rows[0], column) for column in found.columns] == [("ROW1", ""), (1, ""), (True, "")]
    assert (found.changed, found.code_page) == ((1996, 3, 14), "cp437")


def changed(place, *values):
    data = bytearray(WHOLE)
    data[place : place + len(values)] = bytes(values)
    return data


# Damage: bytes, number of records that are read, the code that is told, words of the message.
DAMAGED = {
    "cut in a record": (WHOLE[: HEADER + 6 * WIDTH + 7], 6, "AMX6789", "in the middle of a record, after 7 of 15"),
    "cut between records": (WHOLE[: HEADER + 6 * WIDTH], 6, "AMX6789", "the file holds 6: 3 are missing"),
    "count too high": (changed(4, 12), 9, "AMX6790", "says 12 records, the file holds 9: is its number wrong?"),
    "count too low": (changed(4, 6), 9, "AMX6790", "says 6 records, the file holds 9: all are read"),
    "count of 0": (changed(4, 0), 9, "AMX6790", "says 0 records, the file holds 9"),
    "flag 00h": (changed(HEADER + 2 * WIDTH, 0), 9, "AMX6790", "record 3: the flag in front is 00h"),
    "1Ah in the middle": (changed(HEADER + 2 * WIDTH, 0x1A), 9, "AMX6790", "record 3: the flag in front is 1Ah"),
    "record length 0": (changed(10, 0, 0), 9, "AMX6790", "the header says 0 bytes per record"),
    "record length wrong": (changed(10, 99), 9, "AMX6790", "says 99 bytes per record"),
    "header length too large": (changed(8, 0xFF, 0xFF), 9, "AMX6790", "and 65535 of its own"),
    "header length too small": (changed(8, 1, 0), 9, "AMX6790", "and 1 of its own"),
    "another first byte": (changed(0, 0x13), 9, "AMX6790", "the first byte is 13h"),
    "end of fields lost": (changed(HEADER - 1, 0x20), 9, "AMX6790", "the list of fields ends in 20h"),
    "name of a field": (changed(32, 0xC4), 9, "AMX6790", "field 1 has the name"),
    "kind of a field": (changed(32 + 11, ord("X")), 9, "AMX6790", "field NAME is of the kind 'X'"),
    "no end mark": (WHOLE[:-1], 9, "AMX6790", "the mark 1Ah at the end of the file is missing"),
    "rubbish at the end": (WHOLE + b"\x00RUBBISH", 9, "AMX6789", "7 bytes follow the last record"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damage_is_told_and_every_whole_record_is_read(name):
    data, rows, code, message = DAMAGED[name]
    found, told = read(data)
    assert names(found) == ALL[:rows]
    assert [(told_code, message in text) for told_code, text in told if told_code == code and message in text] == [
        (code, True)
    ], told


def test_padding_of_a_disk_after_the_end_mark_is_nothing():
    found, told = read(WHOLE + bytes(300))
    assert (names(found), told) == (ALL, [])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file has 0 bytes"),
        (WHOLE[:20], "the file has 20 bytes"),
        (WHOLE[:70], "the header is cut in its list of fields"),
        (WHOLE[:64], "the header is cut: its list of fields does not end"),
        (changed(32, 0x0D), "the header has no fields"),
        (changed(32 + 16, 0), "field NAME has the length 0"),
        (changed(32 + 16, 9), "the header says 15 bytes per record and 129 of its own; its fields make 16 and 129"),
        (b"\x03" * (MAX_TABLE_BYTES + 1), "more than 8000000 bytes"),
        (b"\x03" + b"A" * 9000, "more than 128 fields"),
    ],
)  # fmt: skip
def test_a_header_that_cannot_be_that_of_a_table_is_refused(data, message):
    with pytest.raises(DbaseFault) as caught:
        read(data)
    assert (caught.value.code, message in caught.value.message) == ("AMX6789", True), caught.value.message


@pytest.mark.parametrize(
    ("text", "value"),
    [("    7", 7), ("   -1", -1), (" 7.50", 7.5), ("7.000", 7), ("     ", None), ("   .5", 0.5)],
)
def test_numbers(text, value):
    found, _ = read(WHOLE.replace(b"    1T", text.encode() + b"T"))
    assert found.value(found.rows[0], found.columns[1]) == (value, "")


@pytest.mark.parametrize("text", ["*****", "\0\0\0\0\0", "   x7", "1 2  ", "1e400", "\u0663".ljust(5)])
def test_what_is_no_number_is_none_and_shown(text):
    raw = text.encode("utf-8")[:5].ljust(5)
    found, _ = read(WHOLE.replace(b"    1T", raw + b"T"))
    value, shown = found.value(found.rows[0], found.columns[1])
    assert value is None
    assert shown


@pytest.mark.parametrize(
    ("mark", "code_page", "text"),
    [
        (0, None, "\u00e4"),
        (0x01, None, "\u00e4"),
        (0x03, None, "\u201e"),
        (0, "cp1252", "\u201e"),
        (0x03, "cp437", "\u00e4"),
    ],
)
def test_code_pages(mark, code_page, text):
    data = bytearray(WHOLE.replace(b"ROW1", b"ROW\x84"))
    data[29] = mark
    found, _ = read(data, code_page)
    assert names(found)[0] == f"ROW{text}"
    assert found.marked == (mark != 0 or code_page is not None)


TABLES = sorted(WIND1.glob("$*.DBF")) + sorted(WIND1.parent.glob("$*.DBF"))


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.name)
def test_the_sample_is_read_as_the_library_dbf_reads_it(path):
    found, told = read(path.read_bytes())
    assert told == []
    other = dbf.Table(str(path), codepage="cp437")
    with other.open(mode=dbf.READ_ONLY):
        assert [name.upper() for name in other.field_names] == [column.name for column in found.columns]
        assert [dbf.is_deleted(row) for row in other] == [row.deleted for row in found.rows]
        for row, mine in zip(other, found.rows, strict=True):
            values = [value.rstrip() if isinstance(value, str) else value for value in row]
            assert [found.value(mine, column)[0] for column in found.columns] == values


TEXTS = st.text(alphabet="ABCXYZ_019 -+.,\u00e4\u00dc\u00b0", max_size=8).map(str.rstrip)
RECORDS = st.fixed_dictionaries(
    {"NAME": TEXTS, "REG": st.none() | st.integers(-9999, 99999), "ON": st.none() | st.booleans(), GONE: st.booleans()}
)


@given(st.lists(RECORDS, max_size=12))
@settings(max_examples=40, deadline=None, derandomize=True, database=None)
def test_any_table_is_read_as_the_library_dbf_reads_it(tmp_path_factory, rows):
    data = table(FIELDS, rows)
    path = tmp_path_factory.mktemp("dbf") / "any.dbf"
    path.write_bytes(data)
    found, told = read(data)
    assert told == []
    other = dbf.Table(str(path), codepage="cp437")
    with other.open(mode=dbf.READ_ONLY):
        expected = [(row.name.rstrip(), row.reg, row.on, dbf.is_deleted(row)) for row in other]
    mine = [(*(found.value(row, column)[0] for column in found.columns), row.deleted) for row in found.rows]
    assert mine == expected


@given(st.data())
@settings(max_examples=300, deadline=None, derandomize=True, database=None)
def test_whatever_is_damaged_only_the_typed_error_is_raised(data):
    """Of any bytes: a table, or AMX6789; and a table's rows are never more bytes than the file has."""
    raw = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(raw) - 1))
        raw[place] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(raw)))
    kept = bytes(raw[:cut]) if data.draw(st.booleans()) else bytes(raw)
    try:
        found, _ = read(kept)
    except DbaseFault:
        return
    assert sum(len(row.data) for row in found.rows) <= len(kept)
    for row in found.rows:
        for column in found.columns:
            found.value(row, column)


@given(st.binary(max_size=600))
@settings(max_examples=200, deadline=None, derandomize=True, database=None)
def test_any_bytes_are_a_table_or_the_typed_error(data):
    with contextlib.suppress(DbaseFault):
        read(data)


@given(st.integers(HEADER, len(WHOLE)))
def test_a_file_that_is_cut_anywhere_loses_no_record_silently(cut):
    found, told = read(WHOLE[:cut])
    whole = (cut - HEADER) // WIDTH
    assert names(found) == ALL[: min(whole, 9)]
    if whole < 9:
        assert "AMX6789" in {code for code, _ in told}


def test_very_many_records_with_another_flag_are_told_at_once(monkeypatch):
    """As many pairs of records as would take hours are not compared."""
    count = 1_000_000
    monkeypatch.setattr(dbase, "MAX_RECORDS", count)
    data = bytearray(table([("N", "N", 1)], [{}]))
    data[4:8] = count.to_bytes(4, "little")
    found, told = read(data[:65] + b"\7 " * count + b"\x1a")
    assert len(found.rows) == count
    message = "records 1, 2, 3, 4, 5 and 999995 more: the flag in front is 07h, neither a blank nor `*`: kept"
    assert told == [("AMX6790", message)]


@pytest.mark.parametrize(("most", "rows", "told_of"), [(9, 9, []), (8, 8, ["AMX6789"])])
def test_as_many_records_as_are_read_are_not_too_many(monkeypatch, most, rows, told_of):
    monkeypatch.setattr(dbase, "MAX_RECORDS", most)
    found, told = read(WHOLE)
    assert (len(found.rows), [code for code, _ in told]) == (rows, told_of)
