"""Reports of recordings with changed bytes: a page or an error of ours, never anything else."""

from __future__ import annotations

import contextlib

import pytest
from cli.drive_bags import DriveBag
from cli.drive_racks import COMMONS, loop_task, rack_file
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings.recordings import without_checksums

from automax_ros.cli.output.figure import FigureLayout, figure_of
from automax_ros.cli.recordings.report import page
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.drive_report.drive_report import drive_report
from automax_ros.replay.scans.stored_rack import SourceRefused


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small recording of a drive."""
    folder = tmp_path_factory.mktemp("plain")
    with DriveBag(folder / "bag", rack_file(), COMMONS, {"LOOP.BLK": loop_task()}) as bag:
        for step in range(1, 12):
            bag.write(step * 0.1, RUN_B=step % 2, CUR_FB_I=step * 50, STATE_B=1, IOC_B=step % 3 == 0)
            bag.plant(step * 0.1 + 0.05, duration_s=0.1, current_rms_a=5.0, faults=("x",) if step % 4 else ())
            bag.operation(step * 0.1 + 0.06, "plant", "a")
            bag.error(step * 0.1 + 0.07, "LOOP", 200, 7110)
    return without_checksums(folder / "bag" / "scans_0.mcap", folder / "plain.mcap")


@settings(max_examples=75, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(changes=st.lists(st.tuples(st.integers(0, 1 << 20), st.integers(0, 255)), min_size=1, max_size=4))
def test_changed_bytes_give_a_page_or_an_error(
    plain: bytes, tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[int, int]]
) -> None:
    data = bytearray(plain)
    for place, value in changes:
        data[place % len(data)] = value
    file = tmp_path_factory.mktemp("changed") / "changed.mcap"
    file.write_bytes(data)
    with contextlib.suppress(BagError, SourceRefused):
        report = drive_report(file)
        text = page(report, "changed", {})
        assert "<script" not in text
        assert len(text) < 1_000_000
        if len(changes) == 1:
            for run, marks in report.drives:
                figure_of(report.traces(run, marks), FigureLayout("t"))
