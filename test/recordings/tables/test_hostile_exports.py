"""Information, tables and pictures of recordings with changed bytes: an answer or a BagError, never anything else.

The files have no checksums and no compression, so that each change reaches the code that reads them.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.cli.output.figure import FigureLayout, figure_of
from automax_ros.cli.recordings.bag_info import as_data, lines_of
from automax_ros.recordings.info.info import bag_info, task_facts
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables import series
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.export_npz import write_npz
from automax_ros.recordings.tables.scan_table import ScanTable
from automax_ros.recordings.tables.series import Window
from automax_ros.recordings.tables.traces import traces
from recordings.recordings import sample_recording, without_checksums


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small recording without checksums and compression."""
    folder = tmp_path_factory.mktemp("plain")
    bag = sample_recording(folder / "bag", seconds=0.06)
    return without_checksums(bag / "scans_0.mcap", folder / "plain.mcap")


def use(file: Path, folder: Path) -> None:
    """Do everything with a recording; what it refuses is fine."""
    with contextlib.suppress(BagError):
        info = bag_info(file, check=True)
        lines_of(as_data(info, task_facts(info), checked=True))
    with contextlib.suppress(BagError):
        write_csv(CommonTable(file), folder / "out.csv")
    with contextlib.suppress(BagError):
        write_npz(
            file, CommonTable(file, ["REF%", "GAIN", "RUN@"], Window(10_000_000, None, 1_000_000)), folder / "o.npz"
        )
    with contextlib.suppress(BagError):
        write_csv(ScanTable(file, "SPEED", Window(0, 40_000_000)), folder / "out.csv")
    with contextlib.suppress(BagError):
        figure_of(traces(file, ["REF%", "RUN@"]), FigureLayout("t"))


@settings(
    deadline=None, derandomize=True, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    changes=st.lists(
        st.tuples(st.floats(0, 1, exclude_max=True), st.sampled_from([0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF])),
        min_size=1,
        max_size=4,
    )
)
def test_changed_bytes(
    plain: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changes: list[tuple[float, int]]
) -> None:
    monkeypatch.setattr(series, "MAX_GRID_ROWS", 1000)
    data = bytearray(plain)
    for place, value in changes:
        data[int(place * len(data))] = value
    file = tmp_path / "changed.mcap"
    file.write_bytes(data)
    use(file, tmp_path)


def test_the_unchanged_recording_is_sound(plain: bytes, tmp_path: Path) -> None:
    file = tmp_path / "plain.mcap"
    file.write_bytes(plain)
    info = bag_info(file, check=True)
    assert (info.problems, info.scans) == ([], 10)
    write_csv(CommonTable(file), tmp_path / "out.csv")
    figure_of(traces(file, ["REF%", "RUN@"]), FigureLayout("t"))
