"""Counts of a recording in the units of its rack file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings.independent import GOLDEN
from recordings.recordings import sample_recording
from system.support import ROOT

from automax_ros.core.types import DataType
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.recordings.tables.traces import traces
from automax_ros.replay.scans.scales import recorded_scales, traces_in_units, values_in_unit

LINE = ROOT / "bags" / "paper_line"
NEWTONS = Scale((0, 4095), (0.0, 1000.0))


@given(st.lists(st.integers(-32768, 32767)))
def test_each_count_has_the_value_of_the_scale(counts: list[int]) -> None:
    scale = Scale((-4095, 4095), (10.0, -30.0))
    assert values_in_unit(np.array(counts, np.float64), scale).tolist() == [scale.value_of(count) for count in counts]


def test_what_is_no_number_stays() -> None:
    values = values_in_unit(np.array([np.nan, 4095.0, np.inf]), NEWTONS)
    assert np.array_equal(values, [np.nan, 1000.0, np.inf], equal_nan=True)


def test_scales_are_those_of_the_rack_file_inside(tmp_path: Path) -> None:
    assert recorded_scales(LINE) == {"TENSION_1%": NEWTONS, "TENSION_2%": NEWTONS}
    assert recorded_scales(GOLDEN) == {}
    assert recorded_scales(sample_recording(tmp_path / "faulty", seconds=0.1)) == {}  # its rack file has errors
    assert recorded_scales(tmp_path / "none") == {}


def test_a_transducer_agrees_with_its_web_within_a_count() -> None:
    """TENSION_1% is written every 5 ms, the web tells its tension every 10 ms: a count is 0.2442 N."""
    raw = traces(LINE, ["TENSION_1%", "W1/tension_n", "TENS_SP%"])
    shown = traces_in_units(raw, recorded_scales(LINE))
    counts, (transducer, web, setpoint) = raw.lines[0], shown.lines
    assert (transducer.variable.kind, transducer.variable.unit, web.variable.unit) == (DataType.REAL, "N", "N")
    assert transducer.values == pytest.approx(counts.values * 1000.0 / 4095.0)
    places = np.searchsorted(transducer.times, web.times + 1e-9, "right") - 1
    assert np.abs(transducer.values[places] - web.values).max() < 1000.0 / 4095.0
    assert setpoint is raw.lines[2]  # a unit, and no scale
