"""`automax export`: a thin caller of the bags' export."""

from contextlib import contextmanager

import numpy as np
import pytest
from recordings.recordings import sample_recording

from automax_ros.recordings.tables.export import CommonTable, write_csv
from cli.support import columns_of


@pytest.fixture
def bag(automax):
    return sample_recording(automax.folder / "bag", seconds=0.2).name


def test_export_writes_what_the_library_does(automax, bag):
    assert automax("export", bag, "--output", "OUT.csv") == (0, "", "")
    write_csv(CommonTable(automax.folder / "bag"), automax.folder / "BY_HAND.csv")
    assert (automax.folder / "OUT.csv").read_text() == (automax.folder / "BY_HAND.csv").read_text()


def test_watch_chooses_the_columns(automax, bag):
    assert automax("export", bag, "--output", "OUT.csv", "--watch", "run@,TABLE%(1,2)", "--watch", "REF%").code == 0
    assert list(columns_of((automax.folder / "OUT.csv").read_text())) == ["time_s", "RUN@", "TABLE%(1,2)", "REF%"]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["none", "--output", "OUT.csv"], "AMX6810"),
        (["bag", "--output", "OUT.csv", "--watch", "REV%"], "AMX6821"),
        (["bag", "--output", "none/OUT.csv"], "AMX6824"),
    ],
)
def test_what_cannot_be_exported_is_2(automax, bag, arguments, code):
    result = automax("export", *arguments)
    assert (result.code, result.out) == (2, "")
    assert f"error[{code}]" in result.err
    assert "Traceback" not in result.err


def test_numpy_by_suffix(automax, bag):
    assert automax("export", bag, "-o", "OUT.npz", "--watch", "REF%,RUN@") == (0, "", "")
    automax("export", bag, "-o", "OUT.csv", "--watch", "REF%,RUN@")
    table = columns_of((automax.folder / "OUT.csv").read_text())
    with np.load(automax.folder / "OUT.npz") as arrays:
        assert list(arrays["names"]) == ["time_s", "REF%", "RUN@"] == list(table)
        assert arrays["REF%"].tolist() == [int(cell) for cell in table["REF%"]]


def test_range_and_grid(automax, bag):
    assert automax("export", bag, "-o", "OUT.csv", "--watch", "REF%", "--from", "0.05", "--to", "0.07").code == 0
    table = columns_of((automax.folder / "OUT.csv").read_text())
    assert table == {"time_s": ["0.05", "0.055", "0.0605", "0.066"], "REF%": ["8", "9", "10", "11"]}
    assert automax("export", bag, "-o", "OUT.csv", "--watch", "REF%", "--every", "0.05", "--to", "1").code == 0
    table = columns_of((automax.folder / "OUT.csv").read_text())
    assert table == {"time_s": ["0", "0.05", "0.1", "0.15"], "REF%": ["0", "8", "17", "26"]}


def test_scans_of_a_task(automax, bag):
    assert automax("export", bag, "-o", "OUT.csv", "--scans", "speed", "--to", "0.05") == (0, "", "")
    table = columns_of((automax.folder / "OUT.csv").read_text())
    assert table["scan"] == [str(number) for number in range(1, 10)]
    assert table["out.REF%"] == [str(number) for number in range(9)]
    assert table["error_line"] == ["1030" if index % 7 == 0 else "0" for index in range(9)]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--scans", "SPED"], "did you mean SPEED?"),
        (["--scans", "SPEED", "--watch", "REF%"], "without --watch and --every"),
        (["--scans", "SPEED", "--every", "1"], "without --watch and --every"),
        (["--watch", ",,,"], "--watch names no variable"),
        (["--every", "1e-9"], "would make a table of"),
        (["--every", "0"], "--every: 0 s is too short: give more"),
        (["--every", "1e-12"], "--every: 1e-12 s is too short: give more"),
        (["--every", "-1"], "--every: -1 s is negative"),
        (["--from", "2", "--to", "1"], "--to lies before --from"),
        (["--from", "1"], "error[AMX6825]"),
        (["--every", "1e-9"], "error[AMX6826]"),
        (["--watch", "NOTE$", "-o", "OUT.npz"], "error[AMX6828]"),
        (["-o", "OUT.parquet"], "name it OUT.csv or OUT.npz"),
        (["-o", "OUT.txt"], "name it OUT.csv or OUT.npz"),
        (["-o", "OUT"], "name it OUT.csv or OUT.npz"),
    ],
)
def test_wrong_use_is_2(automax, bag, monkeypatch, arguments, text):
    monkeypatch.setattr("automax_ros.recordings.tables.series.MAX_GRID_ROWS", 1000)
    result = automax("export", bag, "-o", "OUT.csv", *arguments)
    assert (result.code, result.out) == (2, "")
    assert text in result.err
    assert "Traceback" not in result.err


def test_progress_is_shown_where_it_lasts(automax, bag, monkeypatch):
    shares = []

    @contextmanager
    def shown(title):
        yield lambda share: shares.append((title, share))

    monkeypatch.setattr("automax_ros.cli.recordings.export.share_shown", shown)
    assert automax("export", bag, "-o", "OUT.csv").code == 0
    assert shares
    assert all(title == "export" and 0 <= share <= 1 for title, share in shares)


def test_output_has_to_be_named(automax, bag):
    assert automax("export", bag).code == 2


def test_terminal_is_told_the_rows(automax, bag, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    result = automax("export", bag, "--output", "OUT.csv", "--watch", "REF%")
    rows = len((automax.folder / "OUT.csv").read_text().splitlines()) - 1
    assert result.err == f"OUT.csv: {rows} rows\n"


@pytest.mark.parametrize("own", ["metadata.yaml", "scans_0.mcap"])
def test_recording_is_never_written_over(automax, bag, own):
    before = {file.name: file.read_bytes() for file in (automax.folder / bag).iterdir()}
    assert own in before
    result = automax("export", bag, "--output", f"{bag}/{own}")
    assert result.code == 2
    assert "belongs to the recording itself" in result.err
    assert {file.name: file.read_bytes() for file in (automax.folder / bag).iterdir()} == before
