"""The picture of a sweep: which form it has, and that it shows the table's numbers."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweep.helpers import plan_of, rack_in

from automax_ros.cli.racks import sweep_output
from automax_ros.core.user_error import UsageError
from automax_ros.sweep.points import grid, read_varied, sample
from automax_ros.sweep.run import Plan, Row, RunOutcome


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Draw rows of two measures, the sum of the values and none, and give the figure; None where none is drawn."""
    figures: list[Any] = []
    monkeypatch.setattr(sweep_output, "save", lambda figure, _: figures.append(figure))
    rack = rack_in(tmp_path)

    def call(texts: list[str], count: int = 0, measures: str = "rms(ERR%) max(ERR%)") -> tuple[Any, list[Row], Plan]:
        varied = [read_varied(rack, text) for text in texts]
        plan = plan_of(rack, texts, measures)
        points = sample(varied, count, 1) if count else grid(varied)
        sums = [sum(value for value in point if not isinstance(value, str)) for point in points]
        rows = [
            Row(number, point, RunOutcome((one, None)))
            for number, (point, one) in enumerate(zip(points, sums, strict=True), 1)
        ]
        sweep_output.draw(plan, rows, rows[:1], tmp_path / "picture.png")
        return (figures[-1] if figures else None), rows, plan

    return call


def test_lines_for_one_quantity_in_the_order_of_its_values(drawn):
    figure, rows, _ = drawn(["REF%=5,1,3", "SLOW=2"])
    first, second = figure.axes
    (x, y), (best_x, best_y) = (line.get_data() for line in first.lines)
    assert list(x) == [1, 3, 5]
    assert list(y) == [3, 5, 7]
    assert ([*best_x], [*best_y]) == ([5], [7])
    assert all(map(math.isnan, second.lines[0].get_ydata()))
    assert (first.get_xlabel(), first.get_ylabel()) == ("REF%", "rms(ERR%)")
    assert len(rows) == 3


def test_a_map_for_two(drawn):
    figure, _, _ = drawn(["REF%=10,0", "LOOP.STEPS=1,2,4"])
    map_ = figure.axes[0].collections[0]
    np.testing.assert_array_equal(map_.get_array(), [[1, 11], [2, 12], [4, 14]])
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == ("REF%", "LOOP.STEPS")
    assert figure.axes[0].get_title() == "rms(ERR%)"


def test_points_for_a_sample_and_for_more(drawn):
    figure, rows, _ = drawn(["REF%=0:900", "SLOW=1:5"], count=12)
    assert len(figure.axes) == 4
    x, y = figure.axes[1].lines[0].get_data()
    assert list(x) == [row.point[1] for row in rows]
    assert list(y) == [sum(row.point) for row in rows]
    figure, _, _ = drawn(["REF%=0,1", "SLOW=1,2", "LOOP.STEPS=3,4"])
    assert len(figure.axes) == 6


def test_texts_stand_at_their_places(drawn):
    figure, _, _ = drawn(["NOTE$=stop,go,$x$", "REF%=3,4"])
    axis = figure.axes[0]
    assert [text.get_text() for text in axis.get_xticklabels()] == [r"\$x\$", "go", "stop"]
    np.testing.assert_array_equal(axis.get_xticks(), [0, 1, 2])
    figure, _, _ = drawn(["NOTE$=" + ",".join(f"n{number:03d}" for number in range(100))])
    assert len(figure.axes[0].get_xticklabels()) == 20


def test_nothing_where_nothing_varies(drawn):
    assert drawn(["REF%=1"])[0] is None


def test_without_matplotlib_it_is_said(drawn, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(UsageError, match="a picture needs matplotlib"):
        drawn(["REF%=1,2"])


def test_long_labels_are_folded_not_cut(drawn):
    """Each is as long as its axis at most: a saved picture shows it whole."""
    for texts, count in (
        (["REF%=5,1,3"], 0),
        (["REF%=10,0", "LOOP.STEPS=1,2,4"], 0),
        (["REF%=0:100", "LOOP.STEPS=1:9"], 6),
    ):
        figure, _, plan = drawn(
            texts, count, measures="abs_max(ERR%, from=0.0125, to=0.1987654) rms(ERR%, from=0.0125, to=0.198765)"
        )
        figure.canvas.draw()
        width, height = figure.canvas.get_width_height()
        renderer = figure.canvas.get_renderer()
        for axis in figure.axes:
            named = (axis.xaxis.label, axis.yaxis.label, axis.title)
            for text in (item for item in named if item.get_text()):
                box = text.get_window_extent(renderer)
                assert -1 <= box.x0 <= box.x1 <= width + 1, text.get_text()
                assert -1 <= box.y0 <= box.y1 <= height + 1, text.get_text()
        found = {" ".join(text.split()) for axis in figure.axes for text in (axis.get_ylabel(), axis.get_title())}
        assert {measure.label for measure in plan.measures} <= found
