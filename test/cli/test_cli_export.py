"""`automax export`: a thin caller of the bags' export."""

import pytest
from bags.recordings import sample_recording

from automax_ros.bags.export import export_csv

from .support import columns_of


@pytest.fixture
def bag(automax):
    return sample_recording(automax.folder / "bag", seconds=0.2).name


def test_export_writes_what_the_library_does(automax, bag):
    assert automax("export", bag, "--output", "OUT.csv") == (0, "", "")
    export_csv(automax.folder / "bag", automax.folder / "BY_HAND.csv")
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
