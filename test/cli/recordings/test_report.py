"""`automax report`: sums against a computation by hand, what the page says, and what it does not let through."""

import html
import os
import re
import struct
import zlib
from math import nan

import pytest

from automax_ros.cli.output.figure import FigureLayout, figure_of
from automax_ros.recordings.tables.series import Window
from automax_ros.replay.drive_report.drive_report import drive_report
from automax_ros.replay.drive_report.rack_report import rack_report
from cli.drive_bags import DriveBag
from cli.drive_racks import COMMONS, loop_task, rack_file, write_rack

AMPS, OHM = 245.816, 0.09152
"""Rated current and armature resistance of the 150 hp example: 150 x 745.7 / (0.91 x 500), 4.5 % of 500 V over it."""


@pytest.fixture
def bag(automax):
    """Open a recording of the rack with one drive."""

    def open_bag(name="bag", rack=None, task=None, names=None, **options):
        sources = {"LOOP.BLK": task or loop_task(LINE_PERIOD=None)}
        return DriveBag(automax.folder / name, rack or rack_file(), names or COMMONS, sources, **options)

    return open_bag


def cells_of(page):
    """The rows of all tables of a page, as texts."""
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", page)
    return [[html.unescape(cell) for cell in re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row)] for row in rows]


def sequence_of(page):
    return [tuple(row) for row in cells_of(page) if len(row) == 3]


def totals_of(page):
    return dict(row for row in cells_of(page) if len(row) == 2)


def run_of(bag):
    """A start at 1 s, 50 % of LIM_BAR for 2 s, 25 % for 1 s, IOC at 4 s, a reset at 5 s; 6 s in all."""
    bag.write(1.0, RUN_B=1, REF_I=2048)
    bag.write(1.2, STATE_B=1)
    bag.write(1.5, CUR_FB_I=2048, CUR_REF_I=2048, DELTA_I=4167, SPD_I=0)
    bag.write(3.5, CUR_FB_I=-1024, BRIDGE_B=1, SPD_I=2048)
    bag.error(4.0, "LOOP", 200, 7110)
    bag.write(4.0, STATE_B=0, IOC_B=1)
    bag.write(5.0, RESET_B=1, IOC_B=0)
    bag.write(6.0, RESET_B=0)


def test_totals_from_counts_alone(automax, bag):
    with bag() as recording:
        run_of(recording)
    result = automax("report", "bag", "--output", "page.html")
    assert (result.code, result.out, result.err) == (0, "", "")
    page = (automax.folder / "page.html").read_text()
    totals = totals_of(page)
    # I_FDBK 2048 is 75.02 % of rated for 2 s, 1024 is 37.51 % for 0.5 s; 0 for 0.3 s before; standby counts as 0
    squares = (2048 / 4095 * 150) ** 2 * 2.0 + (1024 / 4095 * 150) ** 2 * 0.5
    assert totals["in run"] == "2.800 s, 1 start"
    assert totals["bridge"] == "1 change while it ran"
    assert totals["faults"] == "1, 1 in the task's error log"
    whole, in_run = (squares / 6.0) ** 0.5, (squares / 2.8) ** 0.5
    assert totals["rms current by I_FDBK"] == (
        f"{in_run:.1f} % of rated over 2.800 s in run; {whole:.1f} % over all 6.000 s, 0 in standby"
    )
    assert totals["greatest I_FDBK"] == "75.0 % of rated"
    heat = OHM * squares / 1e4 * AMPS**2
    assert float(totals["armature heat by I_FDBK"].split()[0]) == pytest.approx(heat / 1000, rel=1e-3)
    # torque constant 2.606 V s x current x half of 183.26 rad/s for the last 0.5 s, braking
    shaft = 2.606 * -1024 / 4095 * 1.5 * AMPS * 2048 / 4095 * 183.26 * 0.5
    assert float(totals["to the shaft by counts"].split()[0]) == pytest.approx(shaft / 1000, rel=2e-3)
    assert "no messages of the plant" in page


def test_totals_from_the_plant_are_its_own(automax, bag):
    with bag() as recording:
        recording.plant(1.0, current_rms_a=999.0, duration_s=1.0, line_j=100.0, loss_j=10.0, shaft_j=90.0)
        recording.plant(2.0, current_rms_a=100.0, current_a=-95.0, duration_s=1.0, speed_rpm=-500.0, bridge=2)
        recording.plant(
            5.0, current_rms_a=50.0, current_a=50.0, duration_s=3.0, line_j=4100.0, loss_j=1010.0, stored_j=2.0,
            shaft_j=3088.0,
        )  # fmt: skip
    automax("report", "bag", "--output", "page.html")
    totals = totals_of((automax.folder / "page.html").read_text())
    rms = ((100.0**2 * 1 + 50.0**2 * 3) / 4) ** 0.5
    assert totals["rms current"] == f"{rms:.1f} A, {100 * rms / AMPS:.1f} % of rated, over 4.000 s"
    assert totals["greatest current"].startswith("95.0 A, 38.6 % of rated")
    assert totals["greatest speed"] == "500.0 rpm"
    assert totals["energy from the line"] == "4.000 kJ (1.111 Wh)"
    assert totals["energy lost as heat"].startswith("1.000 kJ")
    assert totals["energy stored in inductances"].startswith("0.002 kJ")
    assert totals["energy to the shaft"].startswith("2.998 kJ")


def test_energies_that_were_not_metered_are_left_out(automax, bag):
    nothing = dict.fromkeys(("line_j", "loss_j", "stored_j", "shaft_j"), float("nan"))
    with bag() as recording:
        recording.plant(1.0, **nothing)
        recording.plant(2.0, duration_s=1.0, **nothing)
    automax("report", "bag", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    assert "energy" not in totals_of(page)
    assert "Energies were not metered." in page
    assert "nan" not in page.replace("data:image", "")[: page.index("data:image")]


def test_the_sequence_tells_what_happened_in_order(automax, bag):
    with bag() as recording:
        run_of(recording)
        recording.plant(6.5, contactor=True, faults=("short_scr 3",))
        recording.operation(7.0, "plant", "UNWIND repair all")
        recording.operation(7.5, "set", "REF% = 1", "it is forced")
        recording.plant(8.0)
    automax("report", "bag", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    assert sequence_of(page)[1:] == [
        ("1.0000", "state", "start is requested (RUN@)"),
        ("1.2000", "state", "the drive runs (STATE@)"),
        ("3.5000", "state", "bridge 2 is on (BRIDGE@)"),
        ("4.0000", "error", "AMX7110: drive fault: instantaneous overcurrent (IOC) (line 200)"),
        ("4.0000", "fault", "fault: instantaneous overcurrent (IOC_OUT IOC@)"),
        ("4.0000", "state", "the drive is in standby (STATE@)"),
        ("5.0000", "state", "fault reset (RESET@)"),
        ("5.0000", "fault", "no fault any more: instantaneous overcurrent (IOC_OUT IOC@)"),
        ("6.5000", "plant", "the plant has short_scr 3"),
        ("7.0000", "operation", "plant UNWIND repair all"),
        ("7.5000", "operation", "set REF% = 1: refused, it is forced"),
        ("8.0000", "plant", "the contactor is open"),
        ("8.0000", "plant", "the plant has short_scr 3 no longer"),
    ]
    (fault,) = [row for row in cells_of(page) if len(row) == 5 and row[0] != "from, s"]
    assert fault == ["4.0000", "5.0000", "instantaneous overcurrent", "IOC_OUT", "IOC@"]


def test_the_suspected_scrs_are_named_by_the_pair(automax, bag):
    names = [*COMMONS, "SCR%"]
    task = loop_task(BAD_SCR_OUT="TACH@", TACH_LOSS_OUT=None, BAD_SCR_NUM="SCR%").replace("REF%,", "REF%, SCR%,", 1)
    with bag(rack=rack_file(more="  SCR%: {}\n"), task=task, names=names) as recording:
        recording.write(1.0, TACH_B=1, SCR_I=3)
    ((run, _),) = drive_report(automax.folder / "bag").drives
    assert [event.text for event in run.happened.events] == [
        "fault: shorted SCR (BAD_SCR_OUT TACH@)", "suspected shorted SCR: 3 or 16 (SCR%)"
    ]  # fmt: skip


def test_a_fault_that_stays_is_still_on(automax, bag):
    with bag() as recording:
        recording.write(1.0, TACH_B=1)
        recording.write(2.0, REF_I=1)
    automax("report", "bag", "--output", "page.html")
    rows = cells_of((automax.folder / "page.html").read_text())
    assert ["1.0000", "still on", "voltage without speed", "TACH_LOSS_OUT", "TACH@"] in rows


def lines_of(path, **options):
    ((run, _),) = drive_report(path, **options).drives
    return {line.variable.label: line for line in run.lines}


def test_courses_are_in_engineering_units(automax, bag):
    with bag() as recording:
        run_of(recording)
        recording.plant(2.0, speed_rpm=875.0, current_a=AMPS / 4)
    lines = lines_of(automax.folder / "bag")
    assert list(lines["DELTA DELTA%"].values) == pytest.approx([0.0, 4167 * 60e-6 * 360])
    assert list(lines["I_FDBK CUR_FB%"].values) == pytest.approx(
        [0, 2048 / 4095 * 150, -1024 / 4095 * 150, nan], nan_ok=True
    )  # from the start of the loop to its stop
    assert list(lines["SPEED_FDBK SPD%"].values) == pytest.approx([0, 2048 / 40.95])
    assert list(lines["speed of the plant"].values) == pytest.approx([50.0])
    assert list(lines["current of the plant"].values) == pytest.approx([25.0], rel=1e-4)
    units = {line.variable.unit for line in lines.values()}
    assert units == {"% of full speed", "% of rated current", "deg", ""}
    assert lines["IOC_OUT IOC@"].times.tolist() == [0.0, 4.0, 5.0]


def test_delta_counts_against_the_measured_period(automax, bag):
    names = [*COMMONS, "PERIOD%"]
    rack, task = (
        rack_file(more="  PERIOD%: {}\n"),
        loop_task(LINE_PERIOD="PERIOD%").replace("REF%,", "REF%, PERIOD%,", 1),
    )
    with bag(rack=rack, task=task, names=names) as recording:
        recording.write(1.0, PERIOD_I=20000, DELTA_I=5000)
    assert lines_of(automax.folder / "bag")["DELTA DELTA%"].values[-1] == pytest.approx(90.0)


def test_without_lim_bar_currents_are_counts(automax, bag):
    with bag(task=loop_task(LIM_BAR="LEVEL%")) as recording:
        recording.write(1.0, CUR_FB_I=2048, STATE_B=1)
    (line,) = [line for name, line in lines_of(automax.folder / "bag").items() if name == "I_FDBK CUR_FB%"]
    assert (line.variable.unit, line.values[-1]) == ("counts", 2048)


def test_a_window_holds_what_was_before_it(automax, bag):
    with bag() as recording:
        run_of(recording)
    report = drive_report(automax.folder / "bag", window=Window(2 * 10**9, 3 * 10**9))
    ((run, _),) = report.drives
    assert (report.start_s, report.end_s) == (2.0, 3.0)
    assert run.counts.rms == pytest.approx(2048 / 4095 * 150)
    assert run.counts.run_s == pytest.approx(1.0)
    assert run.happened.events == []


def test_lines_of_a_lane_that_agree_are_all_seen(automax, bag):
    """Finding 16: the last line hid the others. Now the plant's is wide and underneath, the reference on top."""
    with bag() as recording:
        run_of(recording)
        recording.plant(2.0, current_a=AMPS / 4)
    report = drive_report(automax.folder / "bag")
    ((run, marks),) = report.drives
    figure = figure_of(report.traces(run, marks), FigureLayout("one"))
    lane = next(axis for axis in figure.axes if axis.get_ylabel() == "% of rated current")
    lines = [line for line in lane.get_lines() if line.get_gid()]  # the others mark errors
    labels = [text.get_text().strip() for text in lane.get_legend().get_texts()]
    assert labels == [line.get_gid() for line in lines] == [
        "REFERENCE REF%", "REF_LAG_OUT CUR_REF%", "I_FDBK CUR_FB%", "current of the plant"
    ]  # fmt: skip
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 4
    *others, plant = lines
    assert plant.get_zorder() < min(line.get_zorder() for line in others)
    assert plant.get_linewidth() > 2 * max(line.get_linewidth() for line in others)
    assert [line.get_zorder() for line in lines] == sorted((line.get_zorder() for line in lines), reverse=True)


def test_a_speed_reference_is_drawn_where_somebody_names_it(automax, bag):
    """Finding 22. The joint of the plant names one; `--speed-ref` names another."""
    rack = rack_file(more="  SP%: {unit: rpm, ros: in}\n  COUNTS%: {}\n  NOTE$: {}\n")
    joint = rack.replace(
        "  UNWIND: {", "  UNWIND: {joint: {velocity: {common: SP%, scale: {counts: [0, 100], value: [0, 875]}}}, "
    )
    assert joint != rack
    names = [*COMMONS, "SP%", "COUNTS%"]
    for name, text in (("bag", rack), ("joint", joint)):
        with bag(name=name, rack=text, names=names) as recording:
            recording.write(1.0, SP_I=100, COUNTS_I=2048)
    assert not any("SPEED_REF" in label for label in lines_of(automax.folder / "bag"))
    line = lines_of(automax.folder / "joint")["SPEED_REF SP%"]
    assert (line.variable.unit, line.values[-1]) == ("% of full speed", pytest.approx(50.0, rel=1e-3))
    line = lines_of(automax.folder / "bag", references={"": "SP%"})["SPEED_REF SP%"]
    assert line.values[-1] == pytest.approx(100 / 17.5, rel=1e-3)
    line = lines_of(automax.folder / "joint", references={"UNWIND": "COUNTS%"})["SPEED_REF COUNTS%"]
    assert line.values[-1] == pytest.approx(2048 / 40.95)
    for given, told in (
        ("NONE%", "no common variable"),
        ("NOTE$", "is STRING"),
        ("WIND=SP%", "is not a drive of the report"),
    ):
        result = automax("report", "bag", "--speed-ref", given, "--output", "page.html")
        assert (result.code, "AMX6841" in result.err, told in result.err) == (2, True, True), result.err
    assert "has one already" in automax("report", "bag", "--speed-ref", "SP%", "--speed-ref", "SP%").err


def test_an_inverted_input_is_turned_round(automax, bag):
    with bag(task=loop_task(CML_RUN="-RUN@")) as recording:
        recording.write(1.0, RUN_B=1)
        recording.write(2.0, RUN_B=0)
    ((run, _),) = drive_report(automax.folder / "bag").drives
    assert [(event.time_s, event.text) for event in run.happened.events] == [
        (1.0, "stop is requested (RUN@)"), (2.0, "start is requested (RUN@)")
    ]  # fmt: skip


def test_locals_are_named_as_not_recorded(automax, bag):
    with bag(task=loop_task(LINE_PERIOD="LEVEL%")) as recording:
        recording.write(1.0, REF_I=1)
    automax("report", "bag", "--output", "page.html")
    assert "are locals: KP, LINE_PERIOD." in (automax.folder / "page.html").read_text()


def test_the_page_is_whole_and_the_same_each_time(automax, bag):
    with bag() as recording:
        run_of(recording)
        recording.plant(2.0, speed_rpm=875.0)
    automax("report", "bag", "--output", "one.html", "--png", "one.png")
    automax("report", "bag", "--output", "two.html", "--png", "two.png")
    page = (automax.folder / "one.html").read_text()
    assert (automax.folder / "two.html").read_text() == page
    assert (automax.folder / "one.png").read_bytes() == (automax.folder / "two.png").read_bytes()
    sources = re.findall(r'(?:src|href|url)\s*[=(]\s*"?([^">)]{0,22})', page)
    assert sources == ["data:image/png;base64,"]
    assert "<script" not in page
    assert "http" not in page.replace("http-equiv", "")
    assert "default-src &#x27;none&#x27;" in page or "default-src 'none'" in page
    assert chunks_of((automax.folder / "one.png").read_bytes())[0] == b"IHDR"


def chunks_of(data):
    """The chunks of a PNG file, each with its checksum verified."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    found, place = [], 8
    while place < len(data):
        (length,) = struct.unpack_from(">I", data, place)
        kind, body = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack_from(">I", data, place + 8 + length)[0]
        found.append(kind)
        place += 12 + length
    return found


def test_names_from_a_recording_cannot_become_markup(automax, bag):
    evil = "<img src=x onerror=alert(1)>&\"'"
    with bag(name="a<b>&c") as recording:
        recording.write(1.0, RUN_B=1)
        recording.operation(2.0, evil, evil, evil)
        recording.plant(3.0, faults=(f"{evil}\x1b[31m",))
    assert automax("report", "a<b>&c", "--output", "page.html").code == 0
    page = (automax.folder / "page.html").read_text()
    assert "<img src=x" not in page
    assert "a&lt;b&gt;&amp;c" in page
    assert html.escape(evil, quote=True) in page
    assert "\x1b" not in page


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e300, -1e300])
@pytest.mark.parametrize("name", ["current_a", "current_rms_a", "speed_rpm", "duration_s"])
def test_messages_with_impossible_numbers_are_passed_over(automax, bag, name, value):
    with bag() as recording:
        recording.plant(1.0)
        recording.plant(2.0, current_rms_a=10.0, duration_s=1.0, **{name: value} if name == "speed_rpm" else {})
        recording.plant(3.0, **{"current_rms_a": 20.0, "duration_s": 1.0, name: value})
        recording.operation(4.0, "x" * 5000, "")
    ((run, _),) = drive_report(automax.folder / "bag").drives
    assert run.plant.rms_a == (0.0 if name == "speed_rpm" else 10.0)
    assert max(len(event.text) for event in run.happened.events) == 300


def test_a_long_recording_keeps_its_peaks_and_the_page_its_size(automax, bag):
    with bag() as recording:
        recording.write(0.001, STATE_B=1)
        for step in range(1, 70_000):
            recording.write(step * 0.0055, CUR_FB_I=4000 if step == 43_210 else step % 100)
    lines = lines_of(automax.folder / "bag")
    course = lines["I_FDBK CUR_FB%"]
    assert len(course.values) < 66_000
    assert course.values.max() == pytest.approx(4000 / 4095 * 150)
    assert automax("report", "bag", "--output", "page.html").code == 0
    page = (automax.folder / "page.html").read_text()
    assert len(page) < 1_000_000
    assert totals_of(page)["greatest I_FDBK"] == "146.5 % of rated"


def test_many_events_are_cut(automax, bag):
    with bag() as recording:
        for step in range(1, 2601):
            recording.write(step * 0.01, RUN_B=step % 2)
    automax("report", "bag", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    assert len(sequence_of(page)) == 501
    assert "And 2100 more." in page


def test_what_comes_later_is_not_lost_to_what_comes_often(automax, bag):
    with bag() as recording:
        for step in range(1, 5001):
            recording.write(step * 0.01, IOC_B=step % 2, RUN_B=step % 2)
        recording.operation(60.0, "stop_all", "")
    ((run, _),) = drive_report(automax.folder / "bag").drives
    assert run.happened.events[-1].text == "stop_all"
    assert (run.fault_count, len(run.faults), run.happened.omitted) == (2500, 2000, 6000)


def two_drives(bag):
    commons = COMMONS
    rack = rack_file(slots="  9: {module: 57C406, plant: WIND}\n  10: {module: 57C408}\n", tasks="")
    rack = rack.replace("plants:\n", "plants:\n  WIND: {motor: dc_10hp_240v}\n").replace(
        "  7: {module", "  2: {module: 57C435, tasks: {OTHER: {priority: 4}}}\n  7: {module", 1
    )
    recording = bag(rack=rack, names=commons)
    recording._writer.attach("OTHER.BLK", "text/plain", loop_task(slot=9).encode())
    return recording


def test_two_drives_have_a_section_and_a_picture_each(automax, bag):
    with two_drives(bag) as recording:
        run_of(recording)
    assert automax("report", "bag", "--output", "page.html", "--png", "page.png").code == 0
    page = (automax.folder / "page.html").read_text()
    assert re.findall(r"<h2>(.*?)</h2><|<h2>(.*?)</h2>", page) == [("", "UNWIND"), ("", "WIND")]
    assert page.count("data:image/png") == 2
    automax("report", "bag", "--output", "one.html", "--task", "other")
    assert re.findall(r"<h2>(.*?)</h2>", (automax.folder / "one.html").read_text()) == ["WIND"]


def test_a_drive_of_a_udc_is_reported_as_far_as_it_is_known(automax, bag):
    rack = (
        "rack: U\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435}\n  5: {module: 57552, plants: {B: W}}\nplants:\n"
        "  W: {motor: dc_10hp_240v, motor_overload_ratio: 200}\ncommon:\n  CUR%: {slot: 5, register: 1207}\n"
        "  SPD%: {slot: 5, register: 1204}\n  FAULTS%: {slot: 5, register: 1202}\n"
        "  CMD%: {slot: 5, register: 1101}\n  OTHER%: {slot: 5, register: 207}\n"
    )
    folder = automax.folder / "bag"
    with DriveBag(folder, rack, ["CUR%", "CMD%", "OTHER%", "SPD%", "FAULTS%"], {}) as recording:
        recording.write(1.0, CUR_I=4095, CMD_I=7, OTHER_I=3, SPD_I=409, FAULTS_I=-32768)
        recording.plant(2.0, "W", speed_rpm=175.0, slot=5, drive="B")
    lines = lines_of(folder)
    speed = [lines[label] for label in ("SPEED_FDBK SPD%", "speed of the plant")]
    assert [line.variable.unit for line in speed] == ["% of full speed"] * 2  # finding 22: the fault word stood there
    assert lines["register 202 FAULTS%"].variable.unit == "faults, latched"
    currents = [lines[label].variable.unit for label in ("REFERENCE CMD%", "I_FDBK CUR%", "current of the plant")]
    assert currents == ["% of rated current"] * 3
    assert lines["I_FDBK CUR%"].values[-1] == pytest.approx(200.0)
    assert lines["REFERENCE CMD%"].values[-1] == pytest.approx(7 / 4095 * 200)
    assert lines["speed of the plant"].values[-1] == pytest.approx(10.0)
    assert not any("OTHER%" in name for name in lines)
    assert automax("report", "bag", "--output", "page.html").code == 0
    assert "57552 in slot 5, drive B" in (automax.folder / "page.html").read_text()


def test_without_options_page_and_picture_stand_next_to_the_recording(automax, bag):
    with bag() as recording:
        run_of(recording)
    assert automax("report", "bag").code == 0
    assert (automax.folder / "bag_report.html").read_text().startswith("<!DOCTYPE html>")
    assert chunks_of((automax.folder / "bag_report.png").read_bytes())
    (file,) = (automax.folder / "bag").glob("*.mcap")
    assert automax("report", file).code == 0
    assert (automax.folder / "bag" / f"{file.stem}_report.html").exists()


def test_each_file_of_a_split_recording_is_reported(automax, bag):
    with bag(names=COMMONS) as recording:
        run_of(recording)
    assert automax("report", automax.folder / "bag" / "scans_0.mcap", "--output", "page.html").code == 0


def test_a_cut_recording_is_refused_with_the_way_to_repair_it(automax, bag):
    with bag() as recording:
        run_of(recording)
    (file,) = (automax.folder / "bag").glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-200])
    result = automax("report", "bag", "--output", "page.html")
    assert result.code == 2
    assert "AMX6812" in result.err
    assert "automax bag repair" in result.err
    assert not (automax.folder / "page.html").exists()


PLAIN = (
    "rack: D\nwatch: [REF%, RUN@]\nslots: {0: {module: 57C413}, 1: {module: 57C435, tasks: {LINE: {priority: 5}}}}\n"
    "common: {SP%: {ros: in}, REF%: {unit: fpm}, RUN@: {}}\n"
)
LINE = "10 COMMON SP%, REF%\n20 CALL SCAN_LOOP(TICKS=2)\n30 CALL LIMIT(INPUT=SP%, OUTPUT=REF%)\n40 END\n"


def test_a_rack_without_a_drive_is_reported_as_far_as_it_goes(automax):
    """Finding 22: such a recording was refused."""
    with DriveBag(automax.folder / "bag", PLAIN, ["SP%", "REF%", "RUN@"], {"LINE.BLK": LINE}) as recording:
        recording.write(1.0, RUN_B=1)
        recording.error(1.5, "LINE", 30, 7001)
        recording.write(2.0, REF_I=1500)
        recording.operation(3.0, "stop", "", "it is critical")
    result = automax("report", "bag")
    assert (result.code, result.out, result.err) == (0, "", "")
    page = (automax.folder / "bag_report.html").read_text()
    assert ["LINE", "57C435 in slot 1", "11", "1", "1"] in cells_of(page)
    told = [row for row in sequence_of(page) if row[1] not in ("", "kind")]
    assert [(time, kind) for time, kind, _ in told] == [("1.5000", "error"), ("3.0000", "operation")]
    assert told[0][2].startswith("LINE: AMX7001")
    assert told[1][2] == "stop: refused, it is critical"
    assert "data:image/png" in page
    assert chunks_of((automax.folder / "bag_report.png").read_bytes())[0] == b"IHDR"
    report = rack_report(automax.folder / "bag")
    assert [line.variable.label for line in report.traces.lines] == ["REF%", "RUN@"]
    later = rack_report(automax.folder / "bag", Window(2 * 10**9, None))
    assert [(task.scans, task.errors) for task in later.tasks] == [(0, 0)]


def test_a_rack_without_anything_to_draw_has_a_page(automax):
    rack = "rack: D\nslots: {0: {module: 57C413}, 1: {module: 57C435}}\ncommon: {REF%: {ros: closed}}\n"
    with DriveBag(automax.folder / "bag", rack, ["REF%"], {}):
        pass
    assert automax("report", "bag", "--output", "page.html").code == 0
    result = automax("report", "bag", "--png", "page.png")
    assert (result.code, "no course to draw" in result.err) == (2, True)


def test_what_an_operator_a_person_in_ros_and_stimuli_set_is_in_the_sequence(automax, bag):
    """Finding 22: it was missing. A ramp's samples are one event; what ROS says again is told once."""
    names = [*COMMONS, "SP%"]
    with bag(rack=rack_file(more="  SP%: {ros: in}\n"), names=names) as recording:
        recording.outside(1.0, "operator", SP_I=5)
        recording.outside(1.2, "operator", SP_I=5)
        for step in range(50):
            recording.outside(2.0 + step * 0.001, "operator", SP_I=step)
        for step in range(5):
            recording.outside(3.0 + 0.1 * step, "ros", RUN_B=1)
        recording.write(4.0, SP_I=7)
        recording.operation(4.5, "set", "SP% = 5")
        recording.outside(4.5, "operator", SP_I=5)
    assert automax("report", "bag", "--output", "page.html").err == ""
    page = (automax.folder / "page.html").read_text()
    assert [row for row in sequence_of(page) if row[1] == "operation"] == [
        ("1.0000", "operation", "set SP% = 5"),
        ("1.2000", "operation", "set SP% = 5"),
        ("2.0000", "operation", "set SP% = 0, then 49 more values to 49 at 2.049 s"),
        ("3.0000", "operation", "ROS sets RUN@ = TRUE"),
        ("4.5000", "operation", "set SP% = 5"),
    ]


def test_a_rack_file_with_errors_inside_is_refused(automax, bag):
    with bag(rack=rack_file().replace("57C406", "57C999")):
        pass
    result = automax("report", "bag")
    assert result.code == 2
    assert "57C999" in result.err
    assert "the rack file stored inside has errors" in result.err


def test_a_task_without_a_loop_is_refused(automax, bag):
    rack = rack_file(tasks=", PLAIN: {priority: 5}")
    with bag(rack=rack) as recording:
        recording._writer.attach("PLAIN.BLK", "text/plain", b"10 CALL SCAN_LOOP(TICKS=1)\n20 END\n")
    assert "AMX6860" in automax("report", "bag", "--task", "PLAIN").err
    assert "AMX6827" in automax("report", "bag", "--task", "NONE").err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--png", "x.svg"], "the picture is a PNG file"),
        (["--output", "x.png", "--png", "x.png"], "are the same file"),
        (["--output", "none/x.html"], "there is no folder"),
        (["--output", "bag/metadata.yaml"], "AMX6824"),
        (["--from", "2", "--to", "1"], "--to lies before --from"),
    ],
)
def test_wrong_use(automax, bag, options, told):
    with bag() as recording:
        run_of(recording)
    result = automax("report", "bag", *options)
    assert result.code == 2
    assert told in result.err


def test_a_run_of_a_simulated_rack(automax):
    """From end to end: the rack runs, records, and the plant's own meter agrees with the counts of the loop."""
    task = loop_task(SPEED_FDBK=None, OSV_FDBK=None, OSV_THRESH=None)
    rack = rack_file(more="  PERM@: {slot: 8, register: 0, bit: 0, ros: in}\n")
    write_rack(automax.folder, rack, LOOP=task)
    automax.write("s.yaml", "- {at: 0.1, set: {PERM@: true, REF%: 1500}}\n- {at: 1.0, set: {RUN@: true}}\n")
    result = automax("run", ".", "--simulated", "--duration", "2.5", "--stimuli", "s.yaml", "--record", "bag")
    assert result.code == 0, result
    ((run, _),) = drive_report(automax.folder / "bag").drives
    assert [event.text for event in run.happened.events[:4]] == [
        "set PERM@ = TRUE", "set REF% = 1500", "set RUN@ = TRUE", "start is requested (RUN@)"
    ]  # fmt: skip
    assert run.starts == 1
    assert run.plant.greatest_rpm > 100
    assert run.plant.rms_a == pytest.approx(run.counts.rms / 100 * AMPS, rel=0.06)
    assert run.plant.energy_j("line_j") == pytest.approx(
        sum(run.plant.energy_j(name) for name in ("loss_j", "stored_j", "shaft_j")), rel=1e-3
    )


def test_pipes_take_the_page_and_the_picture(automax, bag):
    with bag() as recording:
        run_of(recording)
    assert automax("report", "bag", "--output", "/dev/stdout").code == 0
    os.mkfifo(automax.folder / "F")
    result = automax("report", "bag", "--output", "F")
    assert (result.code, "it is a pipe without a reader" in result.err) == (2, True)


def test_faults_without_a_common_are_not_none(automax, bag):
    """4: the page said that there were none."""
    with bag(task=loop_task(IOC_OUT=None, TACH_LOSS_OUT=None, LINE_PERIOD=None)) as recording:
        recording.write(1.0, REF_I=1)
    automax("report", "bag", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    assert "<p>Not recorded: no common carries a fault output of its loop.</p>" in page
    assert "<p>None" not in page
    assert totals_of(page)["faults"] == "not recorded, 0 in the task's error log"
    with bag(name="some") as recording:
        recording.write(1.0, REF_I=1)
    automax("report", "some", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    assert "<p>None of those that are recorded.</p>" in page
    assert "no common carries them: SYNC_LOSS_OUT, OSV_OUT, " in page


def test_what_a_loop_keeps_in_standby_is_a_gap_and_does_not_count(automax, bag):
    """16: 8 s of standby had the current of the last scan, in the picture and in the mean; in the line's too."""
    rack = rack_file() + "watch: [CUR_FB%]\n"
    with bag(rack=rack) as recording:
        recording.write(1.0, STATE_B=1, CUR_FB_I=1000)
        recording.write(3.0, STATE_B=0)
        recording.write(9.0, STATE_B=1, CUR_FB_I=2000)
        recording.write(10.0, RUN_B=1)
    report = rack_report(automax.folder / "bag")
    (line,) = report.traces.lines
    assert line.times.tolist() == [1.0, 3.0, 9.0]
    assert line.values.tolist() == pytest.approx([1000.0, nan, 2000.0], nan_ok=True)
    assert report.numbers[0].numbers.mean == pytest.approx((1000 * 2 + 2000 * 1) / 3)
    ((run, _),) = report.drives.drives
    (own,) = [item for item in run.numbers if item.label == "I_FDBK CUR_FB%"]
    assert own.numbers.mean == pytest.approx((1000 * 2 + 2000 * 1) / 3 / 4095 * 150)
    assert automax("report", "bag", "--output", "page.html", "--png", "page.png").code == 0
    page = (automax.folder / "page.html").read_text()
    assert "CUR_FB% is a current of a loop, which is shown and counted only while the loop runs" in page
    assert "currents (I_FDBK, REF_LAG_OUT) are shown and counted only while it runs" in page


def test_the_end_of_a_fault_is_not_red(automax, bag):
    with bag() as recording:
        run_of(recording)
    automax("report", "bag", "--output", "page.html")
    page = (automax.folder / "page.html").read_text()
    row = page[: page.index("no fault any more")].rpartition("<tr")[2]
    assert not row.startswith(" class")
    assert page[: page.index("<td>fault: instantaneous")].rpartition("<tr")[2].startswith(' class="fault"')
