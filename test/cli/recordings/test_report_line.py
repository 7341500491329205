"""The part of `automax report` on the rack: alarms, numbers and sequence on the page, next to drives, which picture."""

import html
import re
import time
from pathlib import Path

import pytest

from automax_ros.cli.output.figure import FigureLayout, figure_of
from automax_ros.messages.types.messages import RollState, WebState
from automax_ros.messages.types.topics import SCAN
from automax_ros.replay.drive_report.rack_report import rack_report
from cli.drive_bags import DriveBag
from cli.drive_racks import COMMONS, loop_task, rack_file

WATCHING = "watch: [RPM, SPEED_REF%, REF%, IOC@]\nalarms: [TACH@, BELT@]\n"
MORE = (
    "  RPM%: {unit: rpm}\n  SPEED_REF%: {unit: rpm, scale: {counts: [0, 4095], value: [0.0, 1750.0]}}\n"
    "  BELT@: {description: <the belt> slips}\n"
)
NAMES = [*COMMONS, "RPM%", "SPEED_REF%", "BELT@"]


@pytest.fixture
def bag(automax):
    """A recording of a rack with one drive and a rack file that watches."""
    rack = rack_file(more=MORE) + WATCHING.replace("RPM,", "RPM%,")
    with DriveBag(automax.folder / "bag", rack, NAMES, {"LOOP.BLK": loop_task(LINE_PERIOD=None)}) as recording:
        recording.outside(0.5, "operator", SPEED_REF_I=4095)
        recording.write(1.0, STATE_B=1, RPM_I=875)
        recording.plant(1.5, speed_rpm=880.0, current_a=50.0)
        recording.write(2.0, BELT_B=1)
        recording.error(2.5, "LOOP", 200, 7110)
        recording.write(3.0, BELT_B=0, TACH_B=1)
        recording.plant(3.5, speed_rpm=900.0, faults=("lose_tach",))
        recording.operation(4.0, "stop_all", "")
    return automax.folder / "bag"


def rows_of(page):
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", page)
    return [[html.unescape(cell) for cell in re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row)] for row in rows]


def section_of(page):
    return page[page.index("<h2>The line</h2>") : page.index("<h2>UNWIND</h2>")]


def test_the_line_stands_before_its_drives_which_keep_what_they_show(automax, bag):
    assert automax("report", "bag", "--output", "page.html").err == ""
    page = (automax.folder / "page.html").read_text()
    assert re.findall(r"<h2>(.*?)</h2>", page) == ["The line", "UNWIND"]
    assert page.count("data:image/png") == 2
    automax("report", "bag", "--output", "drive.html", "--task", "LOOP")
    drive = (automax.folder / "drive.html").read_text()
    assert "The line" not in drive
    told = '<p class="note">What happened to it stands in the sequence of the line.</p>\n'
    own = page[page.index("<h2>UNWIND") :].replace(told, "")
    alone = drive[drive.index("<h2>UNWIND") :]
    sequence = alone[alone.index("<h3>Sequence") : alone.index('<p class="note">Not recorded, since their variables')]
    assert alone.replace(sequence, "") == own
    assert page.count("<h3>Sequence of operations</h3>") == 1  # 15: it stood once more for each drive
    assert rows_of(section_of(page))[:3] == [
        ["alarm", "meaning", "times", "time on, s", "first, s", "at the end"],
        ["TACH@", "", "1", "1.000", "3.0000", "on"],
        ["BELT@", "<the belt> slips", "1", "1.000", "2.0000", "off"],
    ]


def test_numbers_are_in_engineering_units_and_have_the_plants(automax, bag):
    automax("report", "bag", "--output", "page.html")
    rows = [row for row in rows_of(section_of((automax.folder / "page.html").read_text())) if len(row) == 7]
    assert rows[1:] == [
        ["RPM%", "", "rpm", "0", "875", "656.2", "875"],
        ["SPEED_REF%", "", "rpm", "0", "1750", "1531", "1750"],
        ["REF%", "", "", "0", "0", "0", "0"],
        ["IOC@", "", "", "FALSE", "FALSE", "0 % TRUE", "FALSE"],
        ["UNWIND/speed_rpm", "", "rpm", "880", "900", "884", "900"],
        ["UNWIND/current_a", "", "A", "0", "50", "40", "0"],
    ]


def test_the_sequence_has_alarms_errors_faults_and_what_was_done(automax, bag):
    automax("report", "bag", "--output", "page.html")
    rows = [tuple(row) for row in rows_of(section_of((automax.folder / "page.html").read_text())) if len(row) == 3]
    assert rows[1:] == [
        ("0.5000", "operation", "set SPEED_REF% = 4095"),
        ("1.0000", "state", "UNWIND: the drive runs (STATE@)"),
        ("2.0000", "alarm", "alarm: <the belt> slips (BELT@)"),
        ("2.5000", "error", rows[4][2]),
        ("3.0000", "alarm", "alarm gone after 1.000 s: <the belt> slips (BELT@)"),
        ("3.0000", "alarm", "alarm: TACH@"),
        ("3.0000", "fault", "UNWIND: fault: voltage without speed (TACH_LOSS_OUT TACH@)"),
        ("3.5000", "plant", "UNWIND: the plant has lose_tach"),
        ("4.0000", "operation", "stop_all"),
    ]
    assert rows[4][2].startswith("LOOP: AMX7110")


def test_references_are_in_front_and_plants_thin_in_the_background(automax, bag):
    figure = figure_of(rack_report(bag).traces, FigureLayout("one"))
    lane = next(axis for axis in figure.axes if axis.get_ylabel() == "rpm")
    lines = {line.get_gid(): line for line in lane.get_lines() if line.get_gid()}
    assert list(lines) == ["RPM%", "SPEED_REF%", "UNWIND/speed_rpm"]
    speed, reference, plant = lines.values()
    assert plant.get_zorder() < speed.get_zorder() < reference.get_zorder()
    assert plant.get_linewidth() < min(speed.get_linewidth(), reference.get_linewidth())


def test_the_picture_is_that_of_the_drives_or_with_watch_that_of_the_line(automax, bag):
    automax("report", "bag", "--png", "drives.png")
    automax("report", "bag", "--png", "line.png", "--watch", "RPM%,SPEED_REF%,REF%,IOC@", "--output", "page.html")
    automax("report", "bag", "--png", "alone.png", "--task", "LOOP")
    drives, line, alone = ((automax.folder / f"{name}.png").read_bytes() for name in ("drives", "line", "alone"))
    assert drives == alone
    assert line != drives


def test_webs_and_rolls_are_drawn_and_told_when_the_recording_has_them(automax):
    """Tensions always, a diameter that changes; a roller's, and speeds without a lane of their unit, as numbers."""
    rack = rack_file() + "watch: [REF%]\n"
    with DriveBag(automax.folder / "bag", rack, COMMONS, {"LOOP.BLK": loop_task(LINE_PERIOD=None)}) as recording:
        for second in range(1, 5):
            stamp = second * 10**9
            web = WebState(stamp, "W1", "UNWIND", "PRESS", 100.0 * second, 0.1, 0.0, 0.0, 0.0, second == 3)
            recording._send("webs/W1", web, stamp, SCAN)
            for name, diameter in (("UNWIND", 1.25 - second / 100), ("PRESS", 0.5)):
                roll = RollState(stamp, name, 2.0, 393.7, diameter, 0.0, 0.0)
                recording._send(f"rolls/{name}", roll, stamp, SCAN)
    report = rack_report(automax.folder / "bag")
    lines = {line.variable.label: line for line in report.traces.lines}
    assert list(lines) == ["W1/tension_n", "REF%", "UNWIND/diameter_m"]
    assert [line.variable.unit for line in lines.values()] == ["N", "", "m"]
    assert lines["W1/tension_n"].values.tolist() == [100.0, 200.0, 300.0, 400.0]
    assert [(event.time_s, event.text) for event in report.happened.events] == [
        (3.0, "web W1 broke"), (4.0, "web W1 is threaded again")
    ]  # fmt: skip
    numbers = {item.label: item.numbers for item in report.numbers}
    assert set(numbers) == {*lines, "UNWIND/web_mps", "PRESS/web_mps", "PRESS/diameter_m"}
    assert numbers["W1/tension_n"].mean == pytest.approx(200.0)  # 100, 200 and 300 N, a second each
    asked = rack_report(automax.folder / "bag", watch=["w1/tension_n"]).traces.lines
    assert [line.variable.label for line in asked] == ["W1/tension_n", "UNWIND/diameter_m"]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--output", "page.pdf"], "the page is an HTML file"),
        (["--watch", ","], "--watch names no variable"),
        (["--watch", "NONE%"], "AMX6821"),
        (["--watch", "RPM%", "--task", "LOOP"], "leave one of them out"),
    ],
)
def test_wrong_use(automax, bag, options, told):
    result = automax("report", "bag", *options)
    assert (result.code, told in result.err) == (2, True), result.err


def test_two_minutes_are_reported_in_seconds(automax):
    """`bench/report.py` measures; here is only that nothing takes another order of time."""
    section = Path(__file__).parents[3] / "config" / "section_drive"
    run = automax("run", section, "--simulated", "--duration", "120", "--record", "bag")
    assert run.code == 0, run.err
    begun = time.perf_counter()
    assert automax("report", "bag").code == 0
    assert time.perf_counter() - begun < 10
