"""What `--headers` shows: fields, counts and codes, and no name of the plant."""

from __future__ import annotations

import shutil

from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import racks_in
from automax_ros.rackfile.old_plants.executive.headers import headers_of
from rackfile.old_plants.executive.disks import SAMPLE, WIND1

SECRETS = ("MILL", "WIND1", "WINDER", "MUSTER", "DOE", "LINE_REF", "LINE", "SECT1", "TENSION", "PAPER", "START_PB")


def shown(folder):
    return list(headers_of(racks_in(folder), None, Findings()))


def test_fields_counts_and_codes_are_shown():
    lines = shown(SAMPLE)
    at = next(number for number, line in enumerate(lines) if line.startswith("rack 1: $SWVAR.DBF"))
    assert "13 records, 1 deleted" in lines[at]
    row = next(line for line in lines[at:] if line.split()[:1] == ["VAR_TYPE"])
    assert row.split(None, 6) == ["VAR_TYPE", "N", "3", "type", "12", "5", "32 x6, 64 x3, 8 x1, 16 x1, 128 x1"]
    assert any(line.split()[:4] == ["NETWORK", "C", "1", "network"] and line.endswith("A x1") for line in lines)


def test_no_name_of_the_plant_is_shown():
    text = "\n".join(shown(SAMPLE))
    assert [word for word in SECRETS if word in text] == []


def test_keys_of_indexes_are_shown_and_damaged_tables_named(tmp_path):
    shutil.copytree(WIND1, tmp_path / "R")
    index = bytearray(600)
    index[24:44] = b"SLOT*65536+REGISTER\0"
    (tmp_path / "R" / "$SWVAR1.NDX").write_bytes(index)
    (tmp_path / "R" / "$SWVAR2.NDX").write_bytes(bytes(600))
    (tmp_path / "R" / "$CARD.DBF").write_bytes(b"?")
    lines = shown(tmp_path / "R")
    assert "rack 1: $SWVAR1.NDX: key SLOT*65536+REGISTER" in lines
    assert "rack 1: $SWVAR2.NDX: key is not text" in lines
    assert "rack 1: $CARD.DBF: cannot be read" in lines
