"""Lines for pictures: no peak is lost, whatever is left out; against a plain reading of the write log."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.messages.types.messages import Scan, ScanError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables import traces as traces_module
from automax_ros.recordings.tables.series import Window
from automax_ros.recordings.tables.traces import ErrorMark, thinned, traces
from recordings.independent import GOLDEN, steps_of
from recordings.recordings import MS, TABLE, image_of, record, sample_recording, write_of

POINTS = st.lists(st.tuples(st.integers(0, 300), st.integers(-50, 50)), min_size=1, max_size=200)


@settings(deadline=None, derandomize=True, max_examples=300)
@given(POINTS, st.integers(1, 12))
def test_extremes_first_and_last_of_each_column_survive(points: list[tuple[int, int]], columns: int) -> None:
    points = sorted(points, key=lambda point: point[0])
    times = np.array([time for time, _ in points], np.float64)
    values = np.array([value for _, value in points], np.float64)
    kept_times, kept_values = thinned(times, values, columns)
    kept = list(zip(kept_times.tolist(), kept_values.tolist(), strict=True))
    assert len(kept) <= max(4 * columns, 1)
    assert kept_times.tolist() == sorted(kept_times)
    assert set(kept) <= {(float(time), float(value)) for time, value in points}
    start, span = points[0][0], points[-1][0] - points[0][0]
    for column in range(columns):
        inside = [
            point
            for point in points
            if (min((point[0] - start) * columns // span, columns - 1) if span else 0) == column
        ]
        if inside:
            shown = [value for time, value in kept if inside[0][0] <= time <= inside[-1][0]]
            assert min(shown) <= min(value for _, value in inside)
            assert max(shown) >= max(value for _, value in inside)
            assert (float(inside[0][0]), float(inside[0][1])) in kept
            assert (float(inside[-1][0]), float(inside[-1][1])) in kept


def test_a_short_line_is_kept_as_it_is() -> None:
    times, values = np.arange(40.0), np.arange(40.0) % 3
    assert thinned(times, values, 10) == (times, values)


def test_lines_are_the_write_log() -> None:
    shown = traces(GOLDEN, ["LINE_REF%", "SPEED_FDBK%", "RUN@"])
    assert (shown.rack, shown.start_s, round(shown.end_s, 6), shown.errors) == ("PM1", 0.0, 10.0, ())
    for line in shown.lines:
        assert list(zip(line.times.tolist(), line.values.tolist(), strict=True)) == steps_of(
            GOLDEN, line.variable.label
        )
    assert [line.variable.unit for line in shown.lines] == ["counts", "counts", ""]


def test_a_zoom_begins_with_what_holds() -> None:
    (line,) = traces(GOLDEN, ["LINE_REF%"], Window(2 * 10**9, 3 * 10**9)).lines
    steps = steps_of(GOLDEN, "LINE_REF%")
    expected = [(2.0, [value for time, value in steps if time <= 2][-1])]
    expected += [(time, value) for time, value in steps if 2 < time <= 3]
    assert list(zip(line.times.tolist(), line.values.tolist(), strict=True)) == expected


def test_a_long_line_keeps_its_single_peak(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(traces_module, "MAX_POINTS", 256)
    monkeypatch.setattr(traces_module, "COLUMNS", 16)
    log = [("/a/variables", TABLE), ("/a/backplane/snapshot", image_of(0, 0, {(0, 0): 0}))]
    for index in range(1, 3001):
        value = 9999 if index == 1234 else -9999 if index == 2345 else index % 7
        log.append(("/a/backplane", write_of(index, index * MS, {(0, 0): value})))
    (line,) = traces(record(tmp_path / "bag", log), ["REF%"]).lines
    assert len(line.times) < 256
    assert line.times[line.values.argmax()] == 1.234
    assert line.times[line.values.argmin()] == 2.345
    assert (line.values.max(), line.values.min()) == (9999, -9999)
    assert (line.times[0], line.times[-1]) == (0, 3)


def test_errors_of_the_range_are_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = [("/a/variables", TABLE), ("/a/backplane/snapshot", image_of(0, 0, {(0, 0): 0}))]
    for index in range(1, 9):
        errors = [ScanError(10 * index, 7000 + index)] * (index % 3)
        log.append(("/a/scans", Scan(index * MS, 1, "T", index, errors=errors)))
        log.append(("/a/backplane", write_of(index, index * MS, {(0, 0): index})))
    bag = record(tmp_path / "bag", log)
    shown = traces(bag, ["REF%"], Window(2 * MS, 5 * MS))
    assert shown.errors == (
        ErrorMark(0.002, "T", 20, 7002),
        ErrorMark(0.002, "T", 20, 7002),
        ErrorMark(0.004, "T", 40, 7004),
        ErrorMark(0.005, "T", 50, 7005),
        ErrorMark(0.005, "T", 50, 7005),
    )
    monkeypatch.setattr(traces_module, "MAX_ERRORS", 2)
    few = traces(bag, ["REF%"])
    assert (len(few.errors), few.unmarked) == (2, 7)


def test_numbers_that_no_rack_writes_are_left_out(tmp_path: Path) -> None:
    odd = [1.0, float("nan"), float("inf"), 2.0]
    log = [
        ("/a/variables", TABLE),
        *(("/a/backplane", write_of(i + 1, i * MS, {(2, 0): v})) for i, v in enumerate(odd)),
    ]
    (line,) = traces(record(tmp_path / "bag", log), ["GAIN"]).lines
    assert line.values.tolist() == [1.0, 2.0]


def test_a_part_of_a_recording_begins_where_it_begins(tmp_path: Path) -> None:
    log = [("/a/variables", TABLE), ("/a/backplane/snapshot", image_of(5, 6000 * MS, {(0, 0): 3}))]
    log.append(("/a/backplane", write_of(6, 7000 * MS, {(0, 0): 4})))
    shown = traces(record(tmp_path / "bag", log), ["REF%", "GAIN"])
    assert (shown.start_s, shown.end_s) == (6.0, 7.0)
    assert shown.lines[1].times.tolist() == []


def test_what_cannot_be_drawn(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=0.1)
    for name, code in (("NOTE$", "AMX6828"), ("REV%", "AMX6821"), ("TABLE%", "AMX6821")):
        with pytest.raises(BagError) as caught:
            traces(bag, [name])
        assert caught.value.code == code
    with pytest.raises(BagError, match="AMX6825"):
        traces(bag, ["REF%"], Window(10**9))


def test_memory_does_not_grow_with_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(traces_module, "MAX_POINTS", 512)
    monkeypatch.setattr(traces_module, "COLUMNS", 64)
    peaks = []
    for name, seconds in (("warm", 1), ("short", 4), ("long", 16)):
        bag = sample_recording(tmp_path / name, seconds=seconds)
        tracemalloc.start()
        traces(bag, ["REF%", "RUN@"])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.2 * peaks[1]
