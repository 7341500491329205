"""NumPy files against the CSV table and against a plain reading of the write log; windows, grids, scans."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rack.helpers import config_at

from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import Scan, Values
from automax_ros.rack.rack import Rack
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables import export_npz, series
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.export_npz import write_npz
from automax_ros.recordings.tables.scan_table import ScanTable
from automax_ros.recordings.tables.series import Window
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from recordings.independent import GOLDEN, ROOT, decoded, nanoseconds, steps_of
from recordings.recordings import MS, TABLE, image_of, record, write_of

VARIABLES, BACKPLANE, SNAPSHOT, SCANS = (
    "/line1/variables",
    "/line1/backplane",
    "/line1/backplane/snapshot",
    "/line1/scans",
)


def npz(bag: Path, folder: Path, table: Any) -> dict[str, Any]:
    rows = write_npz(bag, table, folder / "out.npz")
    with np.load(folder / "out.npz", allow_pickle=False) as file:
        arrays = dict(file)
    assert {len(column) for name, column in arrays.items() if name not in {"names", "units"}} == {rows}
    return arrays


def read_csv(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return {name: [row[index] for row in rows] for index, name in enumerate(header)}


def test_rows_are_those_of_the_csv_table(tmp_path: Path) -> None:
    arrays = npz(GOLDEN, tmp_path, CommonTable(GOLDEN))
    write_csv(CommonTable(GOLDEN), tmp_path / "out.csv")
    table = read_csv(tmp_path / "out.csv")
    assert list(arrays["names"]) == list(table)
    assert len(arrays["time_s"]) > 900
    for name, cells in table.items():
        assert arrays[name].astype(np.float64).tolist() == [float(cell) for cell in cells], name


def test_columns_have_the_types_of_their_variables(tmp_path: Path) -> None:
    log = [(VARIABLES, TABLE), (SNAPSHOT, image_of(0, 0, {(i, 0): 1 for i in range(4)} | {(5, 2): -32768}))]
    bag = record(tmp_path / "bag", log)
    arrays = npz(bag, tmp_path, CommonTable(bag, ["REF%", "COUNT!", "GAIN", "RUN@", "TABLE%(0,2)"]))
    types = {name: column.dtype for name, column in arrays.items() if name not in {"names", "units"}}
    whole = np.dtype(np.int32)
    assert types == {
        "time_s": np.float64,
        "REF%": whole,
        "COUNT!": whole,
        "GAIN": np.float64,
        "RUN@": np.bool_,
        "TABLE%(0,2)": whole,
    }
    assert arrays["TABLE%(0,2)"].tolist() == [-32768]
    units = dict(zip(arrays["names"].tolist(), arrays["units"].tolist(), strict=True))
    assert (units["time_s"], units["GAIN"], units["REF%"]) == ("s", "1/s", "")


def test_what_is_not_told_is_nan(tmp_path: Path) -> None:
    log = [(VARIABLES, TABLE), (BACKPLANE, write_of(1, MS, {(0, 0): 5})), (BACKPLANE, write_of(2, 2 * MS, {(3, 0): 1}))]
    bag = record(tmp_path / "bag", log)
    arrays = npz(bag, tmp_path, CommonTable(bag))
    assert arrays["REF%"].dtype == np.int32
    assert arrays["RUN@"].dtype == arrays["GAIN"].dtype == np.float64
    np.testing.assert_array_equal(arrays["RUN@"], [np.nan, 1.0])
    np.testing.assert_array_equal(arrays["COUNT!"], [np.nan, np.nan])


def test_the_same_recording_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_npz(GOLDEN, CommonTable(GOLDEN, ["LINE_REF%"]), tmp_path / f"{name}.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def refused(folder: Path, bag: Path, table: Any) -> str:
    with pytest.raises(BagError) as caught:
        write_npz(bag, table, folder / "out.npz")
    return caught.value.code


def test_texts_and_numbers_out_of_range_are_refused(tmp_path: Path) -> None:
    log = [(VARIABLES, TABLE), (BACKPLANE, write_of(1, MS, {(0, 0): 1e300}))]
    bag = record(tmp_path / "bag", log)
    assert refused(tmp_path, bag, CommonTable(bag, ["NOTE$"])) == "AMX6828"
    assert refused(tmp_path, bag, CommonTable(bag, ["REF%"])) == "AMX6813"
    other = record(tmp_path / "other", [(VARIABLES, TABLE), (BACKPLANE, write_of(1, MS, {(0, 0): float("nan")}))])
    assert refused(tmp_path, other, CommonTable(other, ["REF%"])) == "AMX6813"


def test_columns_beyond_the_limit_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_npz, "MAX_BYTES", 8 * 910 + 4 * 910)
    assert len(npz(GOLDEN, tmp_path, CommonTable(GOLDEN, ["LINE_REF%"]))["time_s"]) <= 910
    assert refused(tmp_path, GOLDEN, CommonTable(GOLDEN)) == "AMX6826"


def test_an_output_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="AMX6824"):
        write_npz(GOLDEN, CommonTable(GOLDEN, ["RUN@"]), tmp_path)


LOGS = st.lists(
    st.tuples(st.integers(0, 3), st.sampled_from([0, 3]), st.integers(0, 1)), min_size=1, max_size=12
)  # ms after the write before, variable, value


def recorded_log(folder: Path, log: list[tuple[int, int, int]]) -> tuple[Path, dict[int, list[tuple[int, int]]]]:
    """A recording that begins with an image of zeros; and the writes to each variable as (ms, value)."""
    messages: list[tuple[str, Any]] = [(VARIABLES, TABLE), (SNAPSHOT, image_of(0, 0, {(0, 0): 0, (3, 0): 0}))]
    writes: dict[int, list[tuple[int, int]]] = {0: [(0, 0)], 3: [(0, 0)]}
    now = 0
    for number, (wait, variable, value) in enumerate(log, 1):
        now += wait
        messages.append((BACKPLANE, write_of(number, now * MS, {(variable, 0): value})))
        writes[variable].append((now, value))
    return record(folder, messages), writes


def held(writes: list[tuple[int, int]], time_ms: float) -> int:
    return [value for written, value in writes if written <= time_ms][-1]


@settings(deadline=None, derandomize=True, max_examples=60)
@given(LOGS, st.integers(1, 5), st.integers(0, 6))
def test_a_grid_holds_the_value_before(
    tmp_path_factory: pytest.TempPathFactory, log: list[tuple[int, int, int]], step: int, start: int
) -> None:
    folder = tmp_path_factory.mktemp("grid")
    bag, writes = recorded_log(folder / "bag", log)
    last = sum(wait for wait, _, _ in log)
    start = min(start, last)
    window = Window(start * MS, None, step * MS)
    write_csv(CommonTable(bag, ["REF%", "RUN@"], window), folder / "out.csv")
    table = read_csv(folder / "out.csv")
    times = [start + index * step for index in range((last - start) // step + 1)]
    assert [float(cell) for cell in table["time_s"]] == [time / 1000 for time in times]
    assert [int(cell) for cell in table["REF%"]] == [held(writes[0], time) for time in times]
    assert [int(cell) for cell in table["RUN@"]] == [held(writes[3], time) for time in times]


@settings(deadline=None, derandomize=True, max_examples=60)
@given(LOGS, st.integers(0, 8), st.integers(0, 8))
def test_a_window_begins_with_what_holds(
    tmp_path_factory: pytest.TempPathFactory, log: list[tuple[int, int, int]], start: int, length: int
) -> None:
    folder = tmp_path_factory.mktemp("window")
    bag, writes = recorded_log(folder / "bag", log)
    start = min(start, sum(wait for wait, _, _ in log))
    end = start + length
    write_csv(CommonTable(bag, ["REF%", "RUN@"], Window(start * MS, end * MS)), folder / "out.csv")
    table = read_csv(folder / "out.csv")
    rows = list(zip(*(table[name] for name in ("time_s", "REF%", "RUN@")), strict=True))
    instants = [start, *sorted({time for key in writes for time, _ in writes[key] if start < time <= end})]
    expected = [(f"{time / 1000:g}", str(held(writes[0], time)), str(held(writes[3], time))) for time in instants]
    changed = [row for index, row in enumerate(expected) if not index or row[1:] != expected[index - 1][1:]]
    assert rows == changed


def test_the_window_of_a_real_run(tmp_path: Path) -> None:
    arrays = npz(GOLDEN, tmp_path, CommonTable(GOLDEN, ["LINE_REF%"], Window(5 * 10**9, 6 * 10**9)))
    steps = steps_of(GOLDEN, "LINE_REF%")
    before = [value for time, value in steps if time <= 5][-1]
    expected = [(5.0, before), *((time, value) for time, value in steps if 5 < time <= 6)]
    assert list(zip(arrays["time_s"].tolist(), arrays["LINE_REF%"].tolist(), strict=True)) == expected


def test_a_grid_goes_on_to_the_end_of_the_run(tmp_path: Path) -> None:
    """Scans go on though nothing is written any more."""
    log = [(VARIABLES, TABLE), (SNAPSHOT, image_of(0, 0, {(0, 0): 8})), (SCANS, Scan(5 * MS, 1, "T", 1))]
    write_csv(CommonTable(record(tmp_path / "bag", log), ["REF%"], Window(step_ns=2 * MS)), tmp_path / "out.csv")
    assert read_csv(tmp_path / "out.csv") == {"time_s": ["0", "0.002", "0.004"], "REF%": ["8", "8", "8"]}


def test_a_split_recording_gives_the_same_tables(tmp_path: Path) -> None:
    config = config_at(ROOT / "config" / "section_drive" / "rack.yaml")
    for name, split_ns in (("whole", 0), ("split", 700 * MS)):
        rack = Rack(config)
        stream = RackStream(rack, rack.fingerprint)
        recorder = Recorder(rack, stream, tmp_path / name, RecordingOptions(split_ns=split_ns))
        stream.begin()
        rack.start()
        rack.run(2.0)
        stream.end()
        recorder.close()
    assert len(list((tmp_path / "split").glob("*.mcap"))) == 3
    whole, split = bag_info(tmp_path / "whole", check=True), bag_info(tmp_path / "split", check=True)
    assert (split.tasks, split.problems, split.attachments) == (whole.tasks, [], whole.attachments)
    for number, make in enumerate((CommonTable, lambda bag: ScanTable(bag, "SPEED"))):
        tables = []
        for name in ("whole", "split"):
            write_csv(make(tmp_path / name), tmp_path / f"{name}{number}.csv")
            tables.append((tmp_path / f"{name}{number}.csv").read_text())
        assert tables[0] == tables[1]
        assert len(tables[0].splitlines()) > 150


def test_a_window_behind_the_end_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"AMX6825[\s\S]*ends at 10 s"):
        write_csv(CommonTable(GOLDEN, None, Window(11 * 10**9)), tmp_path / "out.csv")


def test_a_grid_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "MAX_GRID_ROWS", 100)
    write_csv(CommonTable(GOLDEN, ["RUN@"], Window(step_ns=10**9)), tmp_path / "out.csv")
    with pytest.raises(
        BagError, match="AMX6826: would make a table of 1001 rows on that grid, at most 100".replace(": ", r"\]: ")
    ):
        CommonTable(GOLDEN, ["RUN@"], Window(step_ns=10 * MS))
    table = CommonTable(GOLDEN, ["RUN@"], Window(10**9, 10**9 + 99 * 10 * MS, 10 * MS))
    assert write_csv(table, tmp_path / "out.csv") == 100
    with pytest.raises(BagError, match="101 rows"):
        CommonTable(GOLDEN, ["RUN@"], Window(10**9, 2 * 10**9, 10 * MS))
    with pytest.raises(BagError, match="101 rows"):
        CommonTable(GOLDEN, ["RUN@"], Window(9 * 10**9, 10**18, 10 * MS))


def test_scans_are_those_that_another_reader_decodes(tmp_path: Path) -> None:
    arrays = npz(GOLDEN, tmp_path, ScanTable(GOLDEN, "speed"))
    file = GOLDEN / "scans_0.mcap"
    names = {item.id: item.name for item in next(decoded(file, "/pm1/variables")).variables}
    scans = [scan for scan in decoded(file, "/pm1/scans") if scan.task == "SPEED" and scan.scan]
    assert arrays["scan"].tolist() == [scan.scan for scan in scans] == list(range(1, 911))
    assert arrays["time_s"].tolist() == [nanoseconds(scan.stamp) / 1e9 for scan in scans]
    latched: dict[str, float] = {}
    committed: dict[str, float] = {}
    for row, scan in enumerate(scans):
        for values, known in ((scan.latched, latched), (scan.committed, committed)):
            known.update(zip((names[number] for number in values.variable), values.value, strict=True))
        for prefix, known in (("in", latched), ("out", committed)):
            assert {name: arrays[f"{prefix}.{name}"][row] for name in known} == known
    assert {name for name in arrays["names"] if name.startswith("in.")} == {f"in.{name}" for name in latched}
    assert {name for name in arrays["names"] if name.startswith("out.")} == {f"out.{name}" for name in committed}
    assert len(latched) == 13


def scan_log(*scans: Scan) -> list[tuple[str, Any]]:
    return [(VARIABLES, TABLE), *((SCANS, scan) for scan in scans)]


def ref(value: int) -> Values:
    return Values((0,), (0,), (value,))


def test_what_missing_scans_leave_unknown(tmp_path: Path) -> None:
    log = scan_log(
        Scan(0, 1, "T", 0),
        Scan(1 * MS, 1, "T", 1, full=True, latched=ref(1), committed=ref(10)),
        Scan(2 * MS, 1, "T", 2),
        Scan(2 * MS, 1, "OTHER", 1, full=True, latched=Values((3,), (0,), (1,))),
        Scan(9 * MS, 1, "T", 9, duration_ns=77, skipped=2),
        Scan(10 * MS, 1, "T", 10, full=True, latched=ref(5), errors=((30, 7001), (40, 7002))),
    )
    bag = record(tmp_path / "bag", log)
    write_csv(ScanTable(bag, "T"), tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text().splitlines() == [
        "time_s,scan,duration_ns,skipped,errors,error_line,error_code,in.REF%,out.REF%",
        "0.001,1,0,0,0,0,0,1,10",
        "0.002,2,0,0,0,0,0,1,10",
        "0.009,9,77,2,0,0,0,,10",
        "0.01,10,0,0,2,30,7001,5,10",
    ]
    np.testing.assert_array_equal(npz(bag, tmp_path, ScanTable(bag, "T"))["in.REF%"], [1, 1, np.nan, 5])


@pytest.mark.parametrize(
    ("task", "window", "code"),
    [("SPED", Window(), "AMX6827"), ("T", Window(), "AMX6827"), ("SPEED", Window(11 * 10**9), "AMX6825")],
)
def test_scans_that_are_not_there(tmp_path: Path, task: str, window: Window, code: str) -> None:
    with pytest.raises(BagError) as caught:
        write_csv(ScanTable(GOLDEN, task, window), tmp_path / "out.csv")
    assert caught.value.code == code
    if task == "SPED":
        assert caught.value.hint == "did you mean SPEED?"


@pytest.mark.parametrize("values", [Values((99,), (0,), (1,)), Values((0,), (1,), (1,)), Values((0, 0), (0,), (1,))])
def test_scans_that_no_rack_records(tmp_path: Path, values: Values) -> None:
    bag = record(tmp_path / "bag", scan_log(Scan(MS, 1, "T", 1, full=True, latched=values)))
    with pytest.raises(BagError, match="AMX6813"):
        write_csv(ScanTable(bag, "T"), tmp_path / "out.csv")
