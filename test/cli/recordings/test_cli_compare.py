"""`automax compare BEFORE AFTER`: exit codes, forms of the report, pictures, what is refused."""

import json
import re
import shutil

import numpy as np
import pytest
from comparison.racks import recording
from recordings.independent import GOLDEN

from automax_ros.cli.output.comparison_figure import MOST_LANES, comparison_figure, drawn
from automax_ros.comparison.comparison import ComparisonOptions, compare

STEP = [(0.0, 0), (1.0, 90), (1.2, 120), (1.5, 100)]
SLOW = [(0.0, 0), (1.0, 50), (2.0, 100)]
REF = [(0.0, 0), (0.9, 100)]


@pytest.fixture
def bags(automax):
    for name, steps in (("before", STEP), ("after", SLOW)):
        courses = {"Y%": steps, "REF%": REF, "RUN@": [(0.0, 0), (0.5, 1)]}
        recording(automax.folder / name, courses, until_s=5.0, units={"Y%": "counts"})
    return automax.folder


def test_equal_recordings_end_with_0_and_say_so(automax, bags):
    result = automax("compare", "before", "before")
    assert (result.code, result.err) == (0, "")
    assert "3 variables compared: none differs from 0 to 5 s" in result.out


def test_what_differs_is_told_with_both_values_and_ends_with_1(automax, bags):
    result = automax("compare", "before", "after", "--reference", "Y%=REF%")
    assert (result.code, result.err) == (1, "")
    rows = [line.split() for line in result.out.splitlines()]
    assert ["Y%", "counts", "-70", "1.2", "120", "50", "1", "90", "50", "1"] in rows
    assert ["Y%", "REF%", "before", "0.9", "0", "20", "0.6", "18"] in rows
    assert ["after", "0.9", "1", "0", "1.1", "60"] in rows
    assert ["change", "+1", "-20", "+0.5", "+42"] in rows


def test_a_tolerance_is_the_verdict(automax, bags):
    assert automax("compare", "before", "after", "--tolerance", "70").code == 0
    assert automax("compare", "before", "after", "--tolerance", "69").code == 1
    assert automax("compare", "before", "after", "REF%,RUN@").code == 0


def test_json_has_all_of_it(automax, bags):
    result = automax("compare", "before", "after", "--json", "--align", "RUN@", "--reference", "Y%=100")
    data = json.loads(result.out)
    assert (result.code, data["equal"]) == (1, False)
    assert data["aligned"] == {"event": "RUN@", "before_s": 0.5, "after_s": 0.5, "shift_s": 0.0}
    (found,) = [item for item in data["variables"] if item["name"] == "Y%"]
    assert found["greatest"] == {"time_s": 0.7, "before": 120.0, "after": 50.0, "difference": -70.0}
    assert found["responses"]["reference"] == "100"
    assert found["responses"]["change"]["overshoot_percent"] == pytest.approx(-20.0)


def test_pulse_is_still_the_other_comparison(automax, bags):
    automax.write("IN.csv", "P%\n1\n2\n")
    assert "PULSE_MULT" in automax("compare", "pulse", "--input", "IN.csv").out
    result = automax("compare", "pulse", "--help")
    assert result.out.startswith("usage: automax compare pulse ")
    assert "pulse" in automax("compare", "--help").out
    (bags / "before").rename(bags / "pulse")
    assert automax("compare", "./pulse", "after").code == 1
    assert automax("compare", "after", "pulse").code == 1
    result = automax("compare", "pulse", "after")
    assert (result.code, "--input" in result.err) == (2, True)


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_pictures_are_the_same_each_time(automax, bags, suffix):
    for name in ("one", "two"):
        assert automax("compare", "before", "after", "Y%", "--plot", f"{name}.{suffix}").code == 1
    one, two = ((bags / f"{name}.{suffix}").read_bytes() for name in ("one", "two"))
    assert one == two
    assert len(one) > 1000


def test_a_picture_has_a_lane_and_a_difference_for_each_variable(bags):
    found = compare(bags / "before", bags / "after", ComparisonOptions(["Y%", "RUN@"], {"Y%": "REF%"}))
    figure = comparison_figure(found, drawn(found, named=True))
    lines = {line.get_gid(): line for axis in figure.axes for line in axis.get_lines() if line.get_gid()}
    assert [name for name in lines if name.startswith("Y%")] == ["Y% before", "Y% after", "Y% difference"]
    assert len(figure.axes) == 4
    corners = {name: [part.tolist() for part in map(np.asarray, line.get_data())] for name, line in lines.items()}
    assert corners["Y% before"] == [[0.0, 1.0, 1.2, 1.5, 5.0], [0.0, 90.0, 120.0, 100.0, 100.0]]
    assert corners["Y% difference"][1] == [0.0, -40.0, -70.0, -50.0, 0.0, 0.0]
    assert {tuple(axis.get_xlim()) for axis in figure.axes} == {(0.0, 5.0)}


def test_without_names_those_that_differ_are_drawn_by_default_into_compare_png(automax, bags):
    result = automax("compare", "before", "after", "--plot")
    assert (result.code, (bags / "compare.png").read_bytes()[:4]) == (1, b"\x89PNG")
    result = automax("compare", "before", "before", "--plot", "none.png")
    assert (result.code, (bags / "none.png").exists()) == (0, False)
    assert "nothing to draw" in result.err


def test_a_page_loads_nothing_and_escapes_texts(automax, bags):
    evil = "<script>alert(1)</script>"
    recording(bags / "evil", {"Y%": SLOW, "REF%": REF, "RUN@": [(0.0, 0)]}, rack=evil, units={"Y%": "<b>"})
    shutil.move(bags / "evil", bags / "<i>evil")
    assert automax("compare", "before", "<i>evil", "--html", "page.html").code == 1
    page = (bags / "page.html").read_text()
    assert "<script" not in page
    assert "<i>" not in page
    assert "&lt;script&gt;" in page
    assert "default-src 'none'" in page
    assert "data:image/png;base64," in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert "error integral" not in page or "Responses" in page


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["before"], "AFTER"),
        (["before", "nowhere"], "nowhere"),
        (["before", "after", "NONE%"], "NONE%"),
        (["before", "after", "--align", "RUN@=5=6"], "not an event"),
        (["before", "after", "--align", "REF%>900"], "never begins in before"),
        (["before", "after", "--align", "NONE@"], "NONE@"),
        (["before", "after", "--align", "Y%"], "only of a BOOLEAN"),
        (["before", "after", "--reference", "Y%"], "not VAR=REF"),
        (["before", "after", "--reference", "Y%=1", "--reference", "y%=2"], "two references"),
        (["before", "after", "--reference", "Y%=NONE%"], "NONE%"),
        (["before", "after", "--shift", "x"], "not a number"),
        (["before", "after", "--shift=-9"], "no time in common"),
        (["before", "after", "--from", "2", "--to", "1"], "--to lies before --from"),
        (["before", "after", "--align-from", "1"], "--align-from is where --align EVENT begins to look"),
        (["before", "after", "--band", "0"], "--band"),
        (["before", "after", "--tolerance=-1"], "--tolerance"),
        (["before", "after", "--plot", "x.jpeg"], "names no format of pictures"),
        (["before", "after", "--html", "nowhere/x.html"], "there is no folder"),
        (["before", "after", "--html", "before/metadata.yaml"], "belongs to the recording"),
        (["before", "after", "--plot", "x.png", "--html", "x.png"], "same file"),
    ],
)
def test_wrong_usage_is_2_with_the_reason(automax, bags, words, told):
    result = automax("compare", *words)
    assert (result.code, result.out) == (2, "")
    assert told in result.err
    assert "Traceback" not in result.err


def test_of_more_variables_than_a_picture_shows_those_that_differ_first_are_drawn(automax):
    names = [f"V{number}%" for number in range(MOST_LANES + 2)]
    for name, apart in (("one", 0), ("other", 1)):
        steps = {item: [(0.0, 0), (2.0 - 0.1 * number, apart)] for number, item in enumerate(names)}
        recording(automax.folder / name, steps, until_s=3.0)
    assert automax("compare", "one", "other", *names, "--plot", "x.png").code == 1
    found = compare(automax.folder / "one", automax.folder / "other")
    shown = drawn(found, named=True)
    assert [item.name for item in shown] == names[:1:-1]
    assert "2 more differ" in comparison_figure(found, shown).get_suptitle()


def test_a_recording_that_is_cut_off_is_refused_with_its_repair(automax, bags):
    shutil.copytree(GOLDEN, bags / "cut")
    file = bags / "cut" / "scans_0.mcap"
    file.write_bytes(file.read_bytes()[:60_000])
    result = automax("compare", str(GOLDEN), "cut")
    assert (result.code, result.out) == (2, "")
    assert "automax bag repair cut" in result.err


RACK = (
    "rack: L1\nslots: {0: {module: 57C413}, 1: {module: 57C435, tasks: {LINE: {priority: 5}}}}\n"
    "common: {SP%: {ros: in}, SPD%: {unit: rpm}}\n"
)
LINE = (
    "10 COMMON SP%, SPD%\n15 LOCAL GAIN [CURRENT=1.0, HIGH=4.0, LOW=0.0, STEP=0.1]\n20 CALL SCAN_LOOP(TICKS=2)\n"
    "30 SPD% = SPD% + (SP% * GAIN - SPD%) / 8\n40 END\n"
)


def test_a_rerun_from_the_middle_of_a_ramp_tells_the_edit_and_no_response(automax):
    """12: what goes on ramping had a rise and an overshoot, and nobody said what was edited."""
    automax.write("rack.yaml", RACK)
    automax.write("LINE.BLK", LINE)
    automax.write("s.yaml", "- {at: 0.5, ramp: {SP%: {to: 1000, over: 1.0}}}\n")
    run = automax("run", ".", "--simulated", "--duration", "3", "--stimuli", "s.yaml", "--record", "one")
    assert run.code == 0, run.err
    rerun = automax("rerun", "one", "--from", "1", "--tune", "LINE.GAIN=2", "--record", "two")
    assert rerun.code == 0, rerun.err
    result = automax("compare", "one", "two", "SPD%")
    assert result.code == 1
    assert "the run after is a rerun, edited from 1 s on: LINE.GAIN = 2.0" in result.out
    assert "overshoot" not in result.out
    settled = automax("rerun", "one", "--from", "2.5", "--tune", "LINE.GAIN=2", "--record", "three")
    assert settled.code == 0, settled.err
    assert "overshoot" not in automax("compare", "one", "three", "SPD%").out  # the run before makes no step
    assert "overshoot" in automax("compare", "one", "three", "SPD%", "--reference", "SPD%=2000").out
