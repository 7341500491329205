"""Every kind of difference: outputs of blocks, writes of BASIC, elements, strings, booleans, errors, states."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from recordings.live_racks import YAML as OTHER_YAML
from recordings.live_racks import build

from automax_ros.core.types import same_bits
from automax_ros.messages.types.messages import Scan, ScanError, TaskState, Values
from automax_ros.rack.rack import Rack
from automax_ros.replay.scans.compare import SETTLED_SCANS, DifferenceCounts, Found, Label, Seen, within
from automax_ros.replay.scans.report import DifferenceKind
from replay.replays import SPEED, WORK, edited, record, recorded, replayed, rewritten


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=2.0)


@pytest.mark.parametrize(
    ("task", "text", "name", "line", "recorded_value", "replayed_value"),
    [
        ("SPEED", edited(SPEED, ("INPUT2=TRIM%", "INPUT2=3")), "OUT%", 130, 0, 1),
        ("WORK", edited(WORK, ("LEFT$(NOTE$, 4)", "LEFT$(NOTE$, 3)")), "COPY$", 120, "read", "rea"),
        ("WORK", edited(WORK, ("TABLE%(0,I%) + I%", "TABLE%(0,I%) + 2 * I%")), "TABLE%(1,1)", 150, 1, 2),
        ("WORK", edited(WORK, ("TOTAL > 2.0", "TOTAL >= 0.0")), "FLAG@", 180, False, True),
        ("WORK", edited(WORK, ("TOTAL * 0.5", "TOTAL * 0.25")), "TOTAL", 110, 0.1875, 0.15625),
        ("WORK", edited(WORK, ("COUNT! = 5", "COUNT! = 6")), "COUNT!", 30, 5, 6),
    ],
)
def test_kinds_of_variables(bag, task, text, name, line, recorded_value, replayed_value):
    report = replayed(bag, {task: text})
    found = report.differences[0]
    assert (found.task, found.kind, found.name) == (task, DifferenceKind.VARIABLE, name)
    assert line in found.lines
    assert (found.first.recorded, found.first.replayed) == (recorded_value, replayed_value)
    assert (found.greatest is None) == isinstance(recorded_value, (bool, str))
    assert not report.identical
    assert report.first is not None
    assert report.first.scan == found.first.scan


def test_an_error_less_is_a_difference_of_an_edited_task(bag):
    report = replayed(bag, {"WORK": edited(WORK, ("OUT% > 200", "OUT% > 32000"))})
    (found,) = report.differences
    assert (found.kind, found.name) == (DifferenceKind.ERRORS, "run-time errors")
    assert found.first.recorded == (
        "AMX7020 value clamped on assignment to an INTEGER variable, AMX7024 division by zero in an expression"
    )
    assert found.first.replayed == "none"
    assert report.tasks[1].different == found.scans > 10


def test_lines_that_moved_are_no_difference(bag):
    """Other line numbers, other order, other names of locals, the same meaning: identical, run-time errors included."""
    moved = """\
1 ! the same task, tidied up
10 COMMON FLAG@, OUT%, GAIN, TOTAL
11 COMMON NOTE$:8, COPY$:8, TABLE%(1,2), COUNT!
20 LOCAL K%, ELEMENT%, ZERO%
30 COUNT! = 2
35 COUNT! = 5
100 CALL SCAN_LOOP(TICKS=2)
1000 COPY$ = LEFT$(NOTE$, 4)
1010 COUNT! = COUNT! + 1
1020 TOTAL = GAIN + TOTAL / 2
1030 FLAG@ = NOT (TOTAL <= 2.0)
1040 FOR K% = 2 TO 0 STEP -1
1050 ELEMENT% = TABLE%(0,K%) + K%
1060 TABLE%(1,K%) = ELEMENT%
1070 NEXT K%
1080 IF OUT% > 200 THEN ELEMENT% = 1 / ZERO%
1090 END
"""
    report = replayed(bag, {"WORK": moved})
    assert report.identical
    work = report.tasks[1]
    assert (work.edited, work.source, work.scans, work.different) == (True, "new/WORK.BLK", 183, 0)


def test_moved_blocks_are_no_difference_from_the_start_on(bag):
    moved = edited(SPEED, ("120 CALL", "121 CALL"), ("130 CALL", "1300 CALL"), ("140 END", "1400 END"))
    assert replayed(bag, {"SPEED": moved}).identical


def test_added_variable_is_read_from_the_image(bag):
    """REF% is not one that WORK knew when it was recorded: the write log tells it, for BASIC and for the latch."""
    added = edited(
        WORK,
        ("10 COMMON", "5 COMMON REF%, SPARE%\n10 COMMON"),
        ("200 END", "195 CALL SUMMER(INPUT1=REF%, INPUT2=1, OUTPUT=SPARE%)\n200 END"),
    )
    report = replayed(bag, {"WORK": added})
    (found,) = report.differences
    assert (found.name, found.first.recorded, found.first.replayed, found.lines) == ("SPARE%", 0, 1, (195,))
    again = edited(
        WORK, ("10 COMMON", "5 COMMON REF%, SPARE%\n10 COMMON"), ("200 END", "195 SPARE% = REF% + 1\n200 END")
    )
    (basic,) = replayed(bag, {"WORK": again}).differences
    assert (basic.first, basic.greatest, basic.scans) == (found.first, found.greatest, found.scans)
    assert basic.greatest is not None
    assert basic.greatest.difference == 482, "REF% is at most 13 * 37 = 481 in 20 slices of 37 each, modulo 500"


def test_tolerance(bag):
    """INPUT2=103 gives up to 3 % more: 14 counts of 481."""
    changed = {"SPEED": edited(SPEED, ("INPUT2=100", "INPUT2=103"))}
    exact = replayed(bag, changed)
    assert exact.differences[0].greatest is not None
    greatest = exact.differences[0].greatest.difference
    assert 5 < greatest < 15
    some = replayed(bag, changed, tolerance=greatest - 1.5)
    assert 0 < some.tasks[0].different < exact.tasks[0].different
    assert some.differences[0].first.scan > exact.differences[0].first.scan
    assert replayed(bag, changed, tolerance=greatest).identical
    assert all(task.states == 0 for task in some.tasks), "a state is not in counts"


def test_tolerance_is_absolute_for_reals_and_never_for_the_rest(bag):
    changed = {"WORK": edited(WORK, ("+ GAIN", "+ GAIN + 0.01"))}
    assert replayed(bag, changed).differences[0].name == "TOTAL"
    assert "TOTAL" not in [item.name for item in replayed(bag, changed, tolerance=0.0201).differences]
    assert replayed(bag, changed, tolerance=0.019).differences[0].name == "TOTAL"
    flag = {"WORK": edited(WORK, ("TOTAL > 2.0", "TOTAL >= 0.0"))}
    assert [item.name for item in replayed(bag, flag, tolerance=5.0).differences] == ["FLAG@"]
    note = {"WORK": edited(WORK, ("LEFT$(NOTE$, 4)", "LEFT$(NOTE$, 3)"))}
    assert [item.name for item in replayed(bag, note, tolerance=5.0).differences] == ["COPY$"]


@pytest.mark.parametrize(
    ("recorded_value", "replayed_value", "tolerance", "expected"),
    [
        (1, 3, 2, True),
        (1, 3, 1, False),
        (1.0, 1.5, 0.5, True),
        (True, False, 9, False),
        ("A", "B", 9, False),
        (3, 3.5, 0.5, True),
        (1, 2, 0, False),
        (math.nan, 1.0, 1, False),
    ],
)
def test_within(recorded_value, replayed_value, tolerance, expected):
    assert within(recorded_value, replayed_value, tolerance) is expected


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (0.0, -0.0, False),
        (-0.0, -0.0, True),
        (math.nan, math.nan, True),
        (1.5, 1.5, True),
        (1, True, False),
        (1, 1, True),
        ("", "", True),
    ],
)
def test_same_bits(one, other, expected):
    assert same_bits(one, other) is expected


def change_scan(number: int, task: str = "WORK", **fields):
    def change(message):
        if isinstance(message, Scan) and (message.task, message.scan) == (task, number):
            return message._replace(**{name: value(getattr(message, name)) for name, value in fields.items()})
        return message

    return change


def nth(values: Values, position: int, value: float) -> Values:
    return values._replace(value=tuple(value if index == position else one for index, one in enumerate(values.value)))


def test_same_source_must_write_the_same_in_the_same_order(bag, tmp_path):
    """A recorded write of COUNT! is exchanged: the variable differs. Two exchanged writes: only the order does."""
    other = rewritten(bag, tmp_path / "value", change_scan(40, written=lambda values: nth(values, 5, 999)))
    (found,) = replayed(other).differences
    assert (found.kind, found.name, found.scans) == (DifferenceKind.VARIABLE, "COUNT!", 1)
    assert (found.first.scan, found.first.recorded, found.first.replayed) == (40, 999, 45)

    def swapped(values: Values) -> Values:
        order = [1, 0, *range(2, len(values.value))]
        return Values(*(tuple(part[index] for index in order) for part in values[:3]), values.text)

    other = rewritten(bag, tmp_path / "order", change_scan(40, written=swapped))
    (found,) = replayed(other).differences
    assert (found.kind, found.name, found.first.scan) == (DifferenceKind.WRITES, "order of writes", 40)
    assert str(found.first.recorded).startswith("COPY$ = ")
    assert str(found.first.replayed).startswith("TOTAL = ")


def test_same_source_must_log_errors_at_the_same_lines(bag, tmp_path):
    other = rewritten(bag, tmp_path / "bag", change_scan(40, errors=lambda _: (ScanError(191, 7020),)))
    (found,) = replayed(other).differences
    assert (found.kind, found.first.scan) == (DifferenceKind.ERRORS, 40)
    assert found.first.recorded == "line 191 AMX7020 value clamped on assignment to an INTEGER variable"


def test_commit_of_a_block_is_compared(bag, tmp_path):
    other = rewritten(bag, tmp_path / "bag", change_scan(100, "SPEED", committed=lambda values: nth(values, 0, -7)))
    (found,) = replayed(other).differences
    assert (found.task, found.name, found.first.scan, found.first.recorded, found.scans) == (
        "SPEED",
        "OUT%",
        100,
        -7,
        1,
    )


def test_negative_zero_is_another_value(bag, tmp_path):
    """Bit for bit means the sign of zero too."""
    other = rewritten(bag, tmp_path / "bag", change_scan(1, written=lambda values: nth(values, 0, -0.0)))
    (found,) = replayed(other).differences
    assert (found.name, str(found.first.recorded), str(found.first.replayed)) == ("TOTAL", "-0.0", "0.0")


def test_states_are_compared_bit_for_bit(bag, tmp_path):
    def change(message):
        if isinstance(message, TaskState) and message.task == "SPEED" and message.scan == 1:
            place = list(message.field).index("120 LAG.y1")
            values = list(message.value)
            values[place] = math.nextafter(values[place], 1e9)
            return message._replace(value=values)
        return message

    report = replayed(rewritten(bag, tmp_path / "bag", change))
    (found,) = report.differences
    assert (found.kind, found.name, found.first.scan, found.task) == (
        DifferenceKind.STATE,
        "state 120 LAG.y1",
        1,
        "SPEED",
    )
    assert report.first is not None
    assert not report.identical


def test_task_that_stops_by_itself_is_told(bag):
    report = replayed(bag, {"WORK": edited(WORK, ("200 END", "195 IF COUNT! = 50 THEN STOP\n200 END"))})
    (found,) = report.differences
    assert (found.kind, found.first.scan, found.first.recorded, found.first.replayed) == (
        DifferenceKind.STATUS,
        46,
        "runs",
        "ended by STOP",
    )
    work = report.tasks[1]
    assert work.scans == 46
    assert "stopped in scan 45, ended by STOP; the scans after it are not compared" in work.notes


def test_endless_loop_of_an_edited_task_ends(bag):
    report = replayed(bag, {"WORK": edited(WORK, ("180 FLAG@", "175 IF COUNT! = 50 THEN 175\n180 FLAG@"))})
    assert any("faulted: scan 45, line 175: AMX7040" in str(item.first.replayed) for item in report.differences)


def test_stop_all_replays_to_its_end(tmp_path):
    endless = edited(WORK, ("180 FLAG@", "175 IF GAIN > 1.0 THEN 175\n180 FLAG@"))
    bag = recorded(tmp_path, WORK=endless)
    report = replayed(bag)
    assert report.identical
    assert {task.name: task.scans for task in report.tasks} == {"SPEED": 1 + 165, "WORK": 1 + 83}


def test_most_differences_are_counted_beyond_the_limit(bag):
    many = {
        "WORK": edited(WORK, ("TABLE%(0,I%) + I%", "TABLE%(0,I%) + I% + 7"), ("COUNT! + 1", "COUNT! + 2")),
        "SPEED": edited(SPEED, ("INPUT2=100", "INPUT2=103")),
    }
    everything = replayed(bag, many)
    assert everything.more == 0
    assert len(everything.differences) == 5
    few = replayed(bag, many, max_differences=2)
    assert few.differences == everything.differences[:2]
    assert few.more == 3
    assert "and 3 more" in few.text()
    assert [task.different for task in few.tasks] == [task.different for task in everything.tasks]


def test_json_is_the_whole_report(bag):
    report = replayed(bag, {"SPEED": edited(SPEED, ("INPUT2=100", "INPUT2=103"))})
    data = json.loads(json.dumps(report.as_json(), allow_nan=False))
    assert (data["identical"], data["scans"], data["rack"]) == (False, 1 + 364 + 1 + 182, "LINE1")
    (found,) = data["differences"]
    assert (found["kind"], found["name"], found["lines"]) == ("variable", "OUT%", [130])
    assert data["first"]["scan"] == found["first"]["scan"]
    assert [item["name"] for item in data["first"]["latched"]] == ["REF%", "OUT%", "RUN@"]
    assert "open_loop" in data


def test_stream_of_many_types_replays(tmp_path):
    """The rack of the recorder's tests: REALs at their limits, strings, arrays, tunables set on the way."""

    def play(rack: Rack, number: int) -> None:
        rack.write("REF%", (number * 7919) % 65536 - 32768)
        rack.write("GAIN", (number - 10) * 1.1e17)
        rack.write("RUN@", number % 3 == 1)
        rack.write("NOTE$", ["", "ready", "Grüße", "12345678"][number % 4])
        if number % 5 == 4:
            rack.tune(rack.task("SPEED"), "TRIM%", number % 10)

    report = replayed(record(build(tmp_path, OTHER_YAML), tmp_path / "bag", play, seconds=12.0))
    assert report.identical
    assert report.scans == 1091 + 1 + 1200 + 1


def numbers(differences: list[float]) -> tuple[int, float, float] | None:
    """Where and how a row of differences settles; scans count from 1."""
    tallies = DifferenceCounts(0, 10)
    for scan, difference in enumerate(differences, 1):
        found = [Found(DifferenceKind.VARIABLE, "X", 0, difference)] if difference else []
        tallies.scan("TASK", scan, scan, found, lambda *_: Label("X"), Seen)
    (result,) = tallies.differences()
    return result.settled and (result.settled.scan, result.settled.low, result.settled.high)


def test_where_a_difference_settles():
    assert numbers([5] * SETTLED_SCANS) == (1, 5, 5)
    assert numbers([5] * (SETTLED_SCANS - 1)) is None
    assert numbers([100, 50, 20, *[7, 8, 9] * 5]) == (4, 7, 9)
    assert numbers([1] * 20 + [0] * SETTLED_SCANS) == (21, 0, 0)
    assert numbers([1] * 20 + [0] * 50 + [1] * 12) == (71, 1, 1)
    assert numbers([1, 0] * 20) == (1, 0, 1), "within two counts"
    assert numbers([1000] * 20 + [1049] * 20) == (1, 1000, 1049), "within 5 %"
    assert numbers([1000] * 20 + [1060] * 20) == (21, 1060, 1060)
    assert numbers([0.001] * 20) == (1, 0.001, 0.001)
    assert numbers([0.001] * 20 + [0.002] * 15) == (21, 0.002, 0.002)
    assert numbers([float(step) for step in range(1, 100)]) is None, "it grows"
