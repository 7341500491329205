"""The report on a rack: its numbers are those of the export, its sequence that of the operations, alarms, lanes."""

import csv
from pathlib import Path

import numpy as np
import pytest
from rack.helpers import written_in

from automax_ros.cli.main import main
from automax_ros.core.types import DataType
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.series import WHOLE_RUN, Window
from automax_ros.recordings.tables.traces import TraceRole
from automax_ros.replay.drive_report.rack_report import RackReport, rack_report

RACK = """\
rack: L1
watch: [SPEED_REF%, SPEED%, TENSION%, RUN@]
alarms: [FAST@, 'LIMIT@(2)', NEVER@]
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 5}}}
common:
  SPEED_REF%: {ros: in, unit: fpm, description: set-point}
  SPEED%: {unit: fpm}
  TENSION%: {unit: N, scale: {counts: [0, 4095], value: [0.0, 1000.0]}}
  RUN@: {ros: in}
  FAST@: {description: too fast}
  LIMIT@(4):
  NEVER@: {description: never comes}
  LENGTH!:
  NOTE$:
"""
LINE = """\
10 COMMON SPEED_REF%, SPEED%, TENSION%, RUN@, FAST@, LIMIT@(4), LENGTH!
20 CALL SCAN_LOOP(TICKS=2)
30 IF RUN@ THEN SPEED% = SPEED% + (SPEED_REF% - SPEED%) / 4
40 TENSION% = SPEED% * 2
50 LENGTH! = LENGTH! + SPEED%
60 FAST@ = SPEED% > 800
70 LIMIT@(2) = SPEED% > 400
80 END
"""
STIMULI = """\
- {at: 0.5, set: {RUN@: true, SPEED_REF%: 500}}
- {at: 1.5, set: {SPEED_REF%: 900}}
- {at: 2.5, set: {SPEED_REF%: 600}}
- {at: 3.0, stop: [LINE]}
- {at: 3.2, run: [LINE]}
- {at: 3.5, ramp: {SPEED_REF%: {to: 850, over: 0.5}}}
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds and a half of the line."""
    folder = tmp_path_factory.mktemp("line")
    return recorded(folder, RACK, LINE, STIMULI)


def recorded(folder: Path, rack: str, task: str, stimuli: str = "[]\n", seconds: str = "4.5") -> Path:
    written_in(folder, rack, LINE=task)
    (folder / "s.yaml").write_text(stimuli)
    run = ["run", str(folder), "--simulated", "--duration", seconds, "--stimuli", str(folder / "s.yaml")]
    assert main([*run, "--record", str(folder / "bag")]) == 0
    return folder / "bag"


def exported(bag: Path, names: str, *options: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and columns of an export, each value held from the row before."""
    table = bag.parent / "table.csv"
    assert main(["export", str(bag), "--watch", names, "-o", str(table), *options]) == 0
    with table.open() as file:
        head, *rows = csv.reader(file)
    words = {"TRUE": "1", "FALSE": "0"}
    cells = np.array([[float(words.get(cell, cell) or "nan") for cell in row] for row in rows])
    return cells[:, 0], {name: cells[:, column] for column, name in enumerate(head)}


def told(report: RackReport, *kinds: str) -> list[tuple[float, str]]:
    return [(round(event.time_s, 6), event.text) for event in report.happened.events if event.kind in kinds]


@pytest.mark.parametrize("window", [WHOLE_RUN, Window(1_000_000_000, 2_600_000_000)], ids=["whole", "part"])
def test_numbers_are_those_of_the_exported_columns(bag, window):
    report = rack_report(bag, window)
    part = ["--from", "1", "--to", "2.6"] if window.end_ns else []
    times, columns = exported(bag, "SPEED_REF%,SPEED%,TENSION%,RUN@", *part)
    end = report.traces.end_s
    assert end == pytest.approx(2.6 if part else 4.5, abs=0.012)
    lengths = np.diff(np.append(times, end))
    assert [item.label for item in report.numbers] == ["SPEED_REF%", "SPEED%", "TENSION%", "RUN@"]
    for item in report.numbers:
        values = columns[item.label]
        if item.label == "TENSION%":  # 4095 counts are 1000 N
            values = values * 1000 / 4095
        numbers = item.numbers
        assert numbers.least == pytest.approx(values.min()), item.label
        assert numbers.greatest == pytest.approx(values.max()), item.label
        assert numbers.last == pytest.approx(values[-1]), item.label
        assert numbers.mean == pytest.approx((values * lengths).sum() / lengths.sum(), rel=1e-9), item.label
    assert [item.unit for item in report.numbers] == ["fpm", "fpm", "N", ""]
    assert report.numbers[0].text == "set-point"


def test_alarms_are_counted_and_timed_as_the_booleans_were(bag):
    report = rack_report(bag)
    times, columns = exported(bag, "FAST@,LIMIT@(2),NEVER@")
    lengths = np.diff(np.append(times, report.traces.end_s))
    assert [item.label for item in report.alarms] == ["FAST@", "LIMIT@(2)", "NEVER@"]
    for alarm in report.alarms:
        values = columns[alarm.label]
        rises = int((np.diff(values, prepend=0.0) > 0).sum())
        assert (alarm.times, alarm.is_on) == (rises, bool(values[-1]))
        assert alarm.on_s == pytest.approx((values * lengths).sum())
        assert alarm.first_s == (None if not rises else times[np.flatnonzero(values)[0]])
    fast, limit, never = report.alarms
    assert fast.times == 2
    assert (limit.times, limit.is_on) == (1, True)
    assert (never.times, never.on_s) == (0, 0.0)
    edges = [(time, text.split()[0:2]) for time, text in told(report, "alarm") if "FAST@" in text]
    changes = times[np.flatnonzero(np.diff(columns["FAST@"], prepend=0.0))]
    assert [time for time, _ in edges] == pytest.approx(changes)
    assert [words for _, words in edges][:2] == [["alarm:", "too"], ["alarm", "gone"]]


def test_the_sequence_has_each_write_and_each_operation_in_order(bag):
    report = rack_report(bag)
    assert told(report, "operation") == [
        (0.5, "set RUN@ = TRUE"),
        (0.5, "set SPEED_REF% = 500"),
        (1.5, "set SPEED_REF% = 900"),
        (2.5, "set SPEED_REF% = 600"),
        (3.0, "stop LINE"),
        (3.2, "run LINE"),
        (3.501, "set SPEED_REF% = 601, then 249 more values to 850 at 3.999 s"),
    ]
    times = [event.time_s for event in report.happened.events]
    assert times == sorted(times)


def test_a_reference_is_in_front_of_what_follows_it_and_scales_give_engineering_values(bag):
    lines = {line.variable.label: line for line in rack_report(bag).traces.lines}
    assert list(lines) == ["SPEED_REF%", "SPEED%", "TENSION%", "RUN@", "FAST@", "LIMIT@(2)"]  # NEVER@ never came
    assert [line.role for line in lines.values()][:3] == [TraceRole.REFERENCE, TraceRole.OTHER, TraceRole.OTHER]
    assert lines["SPEED_REF%"].variable.unit == lines["SPEED%"].variable.unit == "fpm"  # one lane
    tension = lines["TENSION%"]
    assert (tension.variable.unit, tension.variable.kind) == ("N", DataType.REAL)
    assert tension.values.max() == pytest.approx(lines["SPEED%"].values.max() * 2 * 1000 / 4095)
    alone = rack_report(bag, watch=["SPEED_REF%"]).traces.lines
    assert alone[0].role is TraceRole.OTHER  # nothing follows it there


def test_what_is_asked_for_is_shown_in_place_of_what_the_file_watches(bag):
    report = rack_report(bag, watch=["length!", "LIMIT@(2)", "LENGTH!"])
    assert [item.label for item in report.numbers] == ["LENGTH!", "LIMIT@(2)"]
    assert [line.variable.label for line in report.traces.lines] == ["LENGTH!", "LIMIT@(2)", "FAST@"]
    wrong = {"NONE%": "AMX6821", "NOTE$": "AMX6828", "OTHER.X%": "AMX6827", "X/speed_rpm": "AMX6850"}
    for name, code in wrong.items():
        with pytest.raises(BagError) as error:
            rack_report(bag, watch=[name])
        assert error.value.code == code


def test_an_empty_window_is_told(bag):
    with pytest.raises(BagError) as error:
        rack_report(bag, Window(60_000_000_000, None))
    assert error.value.code == "AMX6825"


def test_a_rack_of_booleans_alone_has_lanes_and_shares_of_time(tmp_path):
    rack = RACK.replace("watch: [SPEED_REF%, SPEED%, TENSION%, RUN@]", "watch: [RUN@, FAST@]")
    stimuli = "- {at: 1.0, set: {RUN@: true}}\n- {at: 2.0, set: {RUN@: false}}\n"
    report = rack_report(recorded(tmp_path, rack, LINE, stimuli, "3"))
    assert {line.variable.kind for line in report.traces.lines} == {DataType.BOOLEAN}
    run = report.numbers[0].numbers
    assert (run.least, run.greatest, run.last) == (0.0, 1.0, 0.0)
    assert run.mean == pytest.approx(1 / 3, abs=0.005)


def test_without_watch_it_shows_what_a_status_line_would(tmp_path):
    rack = "".join(line for line in RACK.splitlines(True) if not line.startswith(("watch", "alarms")))
    report = rack_report(recorded(tmp_path, rack, LINE, "[]\n", "0.5"))
    assert len(report.traces.lines) == 5
    assert report.traces.lines[0].variable.label == "SPEED%"  # what control-block tasks write comes first
    assert (report.alarms, report.has_line) == ((), True)


WEB = """\
rack: W1
watch: [TENSION%]
alarms: [TIGHT@]
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 5}}}
  7: {module: 57C406, plant: UNWIND}
  9: {module: 57C406, plant: PRESS}
plants:
  UNWIND:
    motor: dc_150hp_500v
    gear: 4.0
    load: {speed_rpm: 400}
    roll: {diameter_m: 1.25, core_m: 0.15, width_m: 2.5, caliper_um: 90, density_kg_m3: 780}
  PRESS: {motor: dc_150hp_500v, gear: 5.25, load: {speed_rpm: 1314.6}, roller: {diameter_m: 0.5}}
webs:
  WEB:
    {from: UNWIND, to: PRESS, length_m: 4.0, stiffness_n: 2.0e5, feeds: {TENSION%: {signal: tension_n, every_ms: 5.0,
      scale: {counts: [0, 4095], value: [0.0, 1000.0]}}}}
common:
  TENSION%: {unit: N, scale: {counts: [0, 4095], value: [0.0, 1000.0]}}
  TIGHT@: {description: the web is tight}
"""
TIGHT = "10 COMMON TENSION%, TIGHT@\n20 CALL SCAN_LOOP(TICKS=2)\n30 TIGHT@ = TENSION% > 800\n40 END\n"


def test_a_line_with_a_web_shows_its_tension_the_roll_and_the_break(tmp_path):
    """Two held shafts: the tension of the web is in the background of the one that is fed, and the same."""
    report = rack_report(recorded(tmp_path, WEB, TIGHT, "- {at: 2.0, web: {WEB: break}}\n", "2.5"))
    lines = {line.variable.label: line for line in report.traces.lines}
    assert list(lines) == ["TENSION%", "WEB/tension_n", "UNWIND/diameter_m", "TIGHT@"]
    fed, own = lines["TENSION%"], lines["WEB/tension_n"]
    assert (fed.variable.unit, own.variable.unit, own.role) == ("N", "N", TraceRole.BACKGROUND)
    assert fed.values.max() == pytest.approx(own.values.max(), abs=1.0)
    diameter = lines["UNWIND/diameter_m"].values
    assert diameter[0] > diameter[-1] > 1.249  # 13 m of 90 um leave a roll of 1.25 m
    texts = told(report, "alarm", "operation", "web")
    assert [text for _, text in texts] == [
        "alarm: the web is tight (TIGHT@)", "web WEB break", "web WEB broke", texts[-1][1]
    ]  # fmt: skip
    assert texts[-1][1].startswith("alarm gone after")
    assert [event.is_end for event in report.happened.events if event.kind == "alarm"] == [False, True]
    assert report.has_webs
    assert report.has_line


def test_a_roll_that_ran_out_is_not_told_as_a_break(tmp_path):
    """1.2 m of board at 2 m/s."""
    rack = WEB.replace("speed_rpm: 400", "speed_rpm: 990").replace("speed_rpm: 1314.6", "speed_rpm: 401.6")
    rack = rack.replace("diameter_m: 1.25", "diameter_m: 0.16").replace("caliper_um: 90", "caliper_um: 2000")
    report = rack_report(recorded(tmp_path, rack, TIGHT, "[]\n", "1.0"))
    ((_, text),) = told(report, "web")
    assert text == "web WEB ran out: UNWIND is empty"
