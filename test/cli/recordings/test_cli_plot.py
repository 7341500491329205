"""`automax plot`: what is handed to matplotlib, and files that are pictures."""

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from recordings.independent import GOLDEN, steps_of
from recordings.recordings import MS, TABLE, image_of, record, sample_recording, write_of
from system.support import ROOT

from automax_ros.cli.output.figure import FigureLayout, figure_of, save
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import Scan, ScanError
from automax_ros.recordings.read.common_log import Watched
from automax_ros.recordings.tables.traces import ErrorMark, Line, Traces, traces

MAGIC = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture
def bag(automax):
    return sample_recording(automax.folder / "bag", seconds=0.2).name


def lines_of(figure):
    """The lines of variables by name: their corners."""
    found = {}
    for axis in figure.axes:
        for line in axis.get_lines():
            if line.get_gid():
                assert line.get_gid() not in found
                found[line.get_gid()] = line
    return found


def corners(line):
    return list(zip(*(np.asarray(part).tolist() for part in line.get_data()), strict=True))


def test_a_recording_is_read_without_loading_what_runs_a_rack():
    """It would take as long as the picture itself."""
    program = "import sys, automax_ros.recordings.tables.traces; print('automax_ros.rack.rack' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "False\n"


def test_lines_are_the_write_log_and_hold_to_the_end():
    shown = traces(GOLDEN, ["LINE_REF%", "CUR_REF%", "SPEED_FPM%"])
    drawn = lines_of(figure_of(shown, FigureLayout("t")))
    for name, line in drawn.items():
        steps = steps_of(GOLDEN, name)
        assert corners(line)[: len(steps)] == steps
        assert corners(line)[len(steps) :] in ([], [(shown.end_s, steps[-1][1])])
        assert line.get_drawstyle() == "steps-post"
    assert list(drawn) == ["LINE_REF%", "CUR_REF%", "SPEED_FPM%"]


def test_a_line_that_lies_under_another_is_seen_through_its_gaps():
    drawn = lines_of(figure_of(traces(GOLDEN, ["SECT_REF%", "SPEED_FDBK%"]), FigureLayout("t")))
    under, over = drawn["SECT_REF%"], drawn["SPEED_FDBK%"]
    assert (under.get_linestyle(), over.get_linestyle()) == ("-", "--")
    assert under.get_linewidth() > over.get_linewidth()
    assert under.get_color() != over.get_color()


def test_variables_of_one_unit_share_a_lane():
    shown = traces(GOLDEN, ["LINE_REF%", "SPEED_FPM%", "RUN@", "CUR_REF%", "READY@"])
    figure = figure_of(shown, FigureLayout("t"))
    labels = [
        (axis.get_ylabel(), [line.get_gid() for line in axis.get_lines() if line.get_gid()]) for axis in figure.axes
    ]
    assert labels == [("counts", ["LINE_REF%", "CUR_REF%"]), ("fpm", ["SPEED_FPM%"]), ("", ["RUN@", "READY@"])]
    legends = [[text.get_text().strip() for text in axis.get_legend().get_texts()] for axis in figure.axes[:2]]
    assert legends == [["LINE_REF%", "CUR_REF%"], ["SPEED_FPM%"]]
    assert [label.get_text() for label in figure.axes[2].get_yticklabels()] == ["RUN@", "READY@"]
    separate = figure_of(shown, FigureLayout("t", separate=True))
    assert [axis.get_ylabel() for axis in separate.axes] == ["counts", "fpm", "counts", ""]


def test_a_common_with_a_scale_is_drawn_in_its_unit(automax, monkeypatch):
    """Counts of a transducer share the lane of the web's tension in N, and cover it."""
    figures = []
    monkeypatch.setattr("automax_ros.cli.recordings.plot.save", lambda figure, _: figures.append(figure))
    line = ROOT / "bags" / "paper_line"
    assert automax("plot", line, "TENSION_1%", "W1/tension_n", "-o", "OUT.png").code == 0
    (axis,) = figures[0].axes
    assert axis.get_ylabel() == "N"
    transducer, web = (drawn.get_ydata() for drawn in lines_of(figures[0]).values())
    assert max(transducer) == pytest.approx(max(web), abs=1000 / 4095)


def test_legends_stand_beside_the_data_and_nothing_is_cut_off():
    names = ["LINE_REF%", "SECT_REF%", "SPEED_FDBK%", "CUR_REF%", "ARM_CUR%", "TACH_LOSS@", "FAULT_RESET_PB@"]
    figure = figure_of(traces(GOLDEN, names), FigureLayout("t", 900))
    figure.draw_without_rendering()
    axis = figure.axes[0]
    legend = axis.get_legend().get_window_extent()
    assert legend.x0 >= axis.get_window_extent().x1
    assert legend.x1 <= figure.bbox.x1
    extents = [label.get_window_extent() for label in figure.axes[1].get_yticklabels()]
    assert all(extent.x0 >= 0 for extent in extents)
    assert not any(one.overlaps(other) for one, other in pairwise(extents))


def test_booleans_are_rows_of_logic(automax):
    log = [("/a/variables", TABLE), ("/a/backplane/snapshot", image_of(0, 0, {(3, 0): 0}))]
    log += [("/a/backplane", write_of(i, i * 10 * MS, {(3, 0): i % 2})) for i in range(1, 6)]
    shown = traces(record(automax.folder / "b", log), ["RUN@"])
    (line,) = lines_of(figure_of(shown, FigureLayout("t"))).values()
    low = line.get_ydata()[0]
    assert [(round(time, 6), y > low) for time, y in corners(line)] == [
        (0.0, False),
        (0.01, True),
        (0.02, False),
        (0.03, True),
        (0.04, False),
        (0.05, True),
    ]


def test_errors_are_ticks_with_their_code(automax):
    log = [("/a/variables", TABLE), ("/a/backplane/snapshot", image_of(0, 0, {(0, 0): 0}))]
    for index in range(1, 101):
        errors = [ScanError(100, 7001)] if index == 20 else [ScanError(200, 7010)] if index in {60, 61} else []
        task = "SLOW" if index == 20 else "FAST"
        log.append(("/a/scans", Scan(index * MS, 1, task, index, errors=errors)))
        log.append(("/a/backplane", write_of(index, index * MS, {(0, 0): index})))
    bag = record(automax.folder / "b", log)
    figure = figure_of(traces(bag, ["REF%"]), FigureLayout("t"))
    axis = figure.axes[-1]
    ticks = {line.get_gid(): list(line.get_xdata()) for line in axis.get_lines() if line.get_gid()}
    assert ticks == {"SLOW": [0.02], "FAST": [0.06, 0.061]}
    assert [label.get_text() for label in axis.get_yticklabels()] == ["errors of SLOW", "errors of FAST"]
    assert [text.get_text() for text in axis.texts] == ["7001", "7010"]  # the third stands too near for a text
    through = sorted(line.get_xdata()[0] for line in figure.axes[0].get_lines() if not line.get_gid())
    assert through == [0.02, 0.06, 0.061]


def test_a_line_of_millions_is_drawn_with_its_peak():
    times = np.arange(2_000_000) / 1000
    values = np.sin(times)
    values[1_234_567] = 50.0
    line = Line(Watched("GAIN", 0, 0, DataType.REAL), times, values)
    (drawn,) = lines_of(figure_of(Traces("R", 0.0, 2000.0, (line,), (), 0), FigureLayout("t", 1000))).values()
    assert len(drawn.get_xdata()) <= 4001
    assert (1234.567, 50.0) in corners(drawn)


@pytest.mark.parametrize("name", ["_HIDDEN", "A$B", "x^{2}$y$", "\u4e2d\x1b[31m", "\\frac"])
def test_odd_texts_are_drawn_as_they_stand(automax, name):
    line = Line(Watched(name, 0, 0, DataType.REAL, name), np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    logic = Line(Watched(name, 0, 0, DataType.BOOLEAN), np.array([0.0]), np.array([1.0]))
    marks = (ErrorMark(0.5, name, 1, 7001),)
    figure = figure_of(Traces("R", 0.0, 1.0, (line, logic), marks, 3), FigureLayout(name))
    save(figure, automax.folder / "odd.svg")
    assert figure.axes[0].get_legend().get_texts()[0].get_text().strip()


@pytest.mark.parametrize("suffix", MAGIC)
def test_pictures_of_all_formats(automax, bag, suffix):
    assert automax("plot", bag, "REF%,RUN@", "TABLE%(1,2)", "-o", f"OUT{suffix}") == (0, "", "")
    data = (automax.folder / f"OUT{suffix}").read_bytes()
    assert data.startswith(MAGIC[suffix])
    assert len(data) > 3000
    assert automax("plot", bag, "REF%,RUN@", "TABLE%(1,2)", "-o", f"AGAIN{suffix}").code == 0
    assert (automax.folder / f"AGAIN{suffix}").read_bytes() == data


def test_size_is_that_of_the_picture(automax, bag):
    assert automax("plot", bag, "REF%", "-o", "OUT.png", "--size", "640x360").code == 0
    data = (automax.folder / "OUT.png").read_bytes()
    assert (int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")) == (640, 360)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["none", "REF%", "-o", "OUT.png"], "AMX6810"),
        (["bag", "REFF%", "-o", "OUT.png"], "did you mean REF%?"),
        (["bag", "NOTE$", "-o", "OUT.png"], "AMX6828"),
        (["bag", "REF%", "-o", "OUT.png", "--from", "5"], "AMX6825"),
        (["bag", "REF%", "-o", "OUT.png", "--from", "0.1", "--to", "0.05"], "--to lies before --from"),
        (["bag", "REF%", "-o", "OUT.png", "--from", "soon"], "--from: time in seconds 'soon' is not a number"),
        (["bag", "REF%", "-o", "OUT.png", "--to", "nan"], "--to: time in seconds 'nan' is not a number"),
        (["bag", "REF%", "-o", "OUT.png", "--size", "1600"], "'1600' is not a size"),
        (["bag", "REF%", "-o", "OUT.png", "--size", "99999x2"], "is not a size"),
        (["bag", "REF%", "-o", "OUT.jpeg"], "names no format of pictures"),
        (["bag", "REF%", "-o", "none/OUT.png"], "none/OUT.png cannot be written"),
        (["bag", ",", "-o", "OUT.png"], "name a variable"),
        (["bag", "-o", "OUT.png"], "required: VAR"),
    ],
)
def test_what_cannot_be_drawn_is_2(automax, bag, arguments, text):
    result = automax("plot", *arguments)
    assert (result.code, result.out) == (2, "")
    assert text in result.err
    assert "Traceback" not in result.err
    assert not (automax.folder / "OUT.png").exists()


def test_a_picture_that_breaks_off_leaves_the_one_before(automax, bag, monkeypatch):
    figure = pytest.importorskip("matplotlib.figure")

    def broken(self, place, **_):
        with open(place, "w") as file:
            file.write("half")
        raise OSError(28, "No space left on device")

    automax.write("OUT.png", "the one before")
    monkeypatch.setattr(figure.Figure, "savefig", broken)
    result = automax("plot", bag, "REF%", "-o", "OUT.png")
    assert (result.code, "OUT.png cannot be written: No space left" in result.err) == (2, True)
    assert sorted(path.name for path in automax.folder.iterdir()) == ["OUT.png", "bag"]
    assert (automax.folder / "OUT.png").read_text() == "the one before"


def test_a_truncated_recording_is_2(automax, bag):
    with (automax.folder / bag / "scans_0.mcap").open("r+b") as file:
        file.truncate(3000)
    result = automax("plot", bag, "REF%", "-o", "OUT.png")
    assert result.code == 2
    assert "error[AMX6812]" in result.err
    assert not (automax.folder / "OUT.png").exists()


def test_without_matplotlib_it_says_so(automax, bag, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = automax("plot", bag, "REF%", "-o", "OUT.png")
    assert (result.code, result.out) == (2, "")
    assert "a picture needs matplotlib" in result.err


def test_recording_is_never_written_over(automax, bag):
    folder = automax.folder / bag
    (folder / "scans_0.mcap").rename(folder / "own.png.mcap")
    (folder / "link.png").symlink_to("own.png.mcap")
    before = (folder / "own.png.mcap").read_bytes()
    result = automax("plot", bag, "REF%", "-o", f"{bag}/link.png")
    assert result.code == 2
    assert "belongs to the recording itself" in result.err
    assert (folder / "own.png.mcap").read_bytes() == before
