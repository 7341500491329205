"""Modeled execution: commit times, pre-emption, overlap."""

from __future__ import annotations

import pytest

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.runtime.scan.error_log import LOG_NUMBERS, ErrorLog, LogEntry
from automax_ros.runtime.tasks.task import Status
from rack.helpers import Observer, rack_at, run_for

TASK = """10 COMMON {name}%
20 CALL SCAN_LOOP(TICKS={ticks})
30 CALL SUMMER(INPUT1={name}%, INPUT2=1, OUTPUT={name}%)
40 END
"""
SCAN_US = 80.00 + 1.6 + 2.5
"""SCAN_LOOP of a 7010 with one INTEGER common (table 4)."""
END_US = 13.82 + 2.0 + 1.6


def rack_of(tmp_path, tasks: dict[str, tuple[int, int]], tick: str = "0.5") -> Rack:
    """A modeled rack of one 7010: priority and TICKS by task, each counting a common of its own name."""
    lines = "".join(f"      {name}: {{priority: {priority}}}\n" for name, (priority, _) in tasks.items())
    commons = "".join(f"  {name}%:\n" for name in tasks)
    module = f"    module: 57C435\n    tick_ms: {tick}\n    tasks:\n"
    text = f"rack: R\nexecution: modeled\nslots:\n  0:\n{module}{lines}common:\n{commons}"
    (tmp_path / "rack.yaml").write_text(text)
    for name, (_, ticks) in tasks.items():
        (tmp_path / f"{name}.BLK").write_text(TASK.format(name=name, ticks=ticks))
    return rack_at(tmp_path / "rack.yaml")


def commits(rack: Rack, seconds: float) -> list[tuple[str, int]]:
    """Who wrote when, in the order of the write log."""
    rack.memory.keep_log()
    rack.start()
    rack.run(seconds)
    names = [spec.name for spec in rack.memory.specs]
    return [(names[write.view], write.time_ns) for write in rack.memory.drain()]


def test_a_scan_commits_when_its_time_has_passed(tmp_path):
    found = commits(rack_of(tmp_path, {"A": (5, 1)}), 0.001)
    first = found[0][1]
    assert [entry[1] - first for entry in found] == [0, 500_000]
    assert first > (SCAN_US + END_US) * 1000


def test_a_higher_priority_suspends_a_lower_one(tmp_path):
    alone = commits(rack_of(tmp_path, {"A": (5, 1)}), 0.0004)[0][1]
    found = commits(rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)}), 0.0005)
    assert [name for name, _ in found] == ["HIGH%", "LOW%"]
    assert [time for _, time in found] == [alone, 2 * alone]


def test_an_overlap_stops_all(tmp_path):
    tasks = {f"T{number}": (4 + number, 1) for number in range(6)}
    rack = run_for(rack_of(tmp_path, tasks), 0.01)
    assert rack.operations.stopped is not None
    assert rack.operations.stopped.code == "14"
    assert rack.operations.stopped.time_ns == 500_000
    faulted = [task.name for task in rack.tasks if task.status is Status.FAULTED]
    assert faulted == [rack.operations.stopped.task]
    last = rack.task(faulted[0]).errors.last
    assert last is not None
    assert last.problem == "AMX7070"


@pytest.mark.parametrize("parts", [1, 7])
def test_time_may_pass_in_pieces(tmp_path, parts):
    whole = rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)})
    expected = commits(whole, 0.07)
    rack = rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)})
    rack.memory.keep_log()
    rack.start()
    for _ in range(parts):
        rack.run(0.07 / parts)
    names = [spec.name for spec in rack.memory.specs]
    assert [(names[write.view], write.time_ns) for write in rack.memory.drain()] == expected


def built(tmp_path, slots: dict[int, str], commons: str, **sources: str) -> Rack:
    """A modeled rack; ``slots`` are the modules as YAML flow mappings."""
    for name, text in sources.items():
        (tmp_path / f"{name}.BLK").write_text(text)
    listed = "".join(f"  {slot}: {module}\n" for slot, module in slots.items())
    (tmp_path / "rack.yaml").write_text(f"rack: R\nexecution: modeled\nslots:\n{listed}common:\n{commons}")
    return rack_at(tmp_path / "rack.yaml")


def remarks(count: int, first: int = 1000) -> str:
    return "".join(f"{number} ! TAKES TIME\n" for number in range(first, first + count))


@pytest.mark.parametrize(
    ("model", "commit_us"),
    [
        # SCAN_LOOP with t and i, SUMMER, END with t and i (table 4)
        ("57C435", 80.00 + 1.6 + 2.5 + 11.28 + 13.82 + 2.0 + 1.6),
        ("57C430A", 326 + 2.4 + 4.4 + 44 + 60.0 + 3.2 + 2.8),
        ("57C431", 326 + 2.4 + 4.4 + 44 + 60.0 + 3.2 + 2.8),
    ],
)
def test_a_commit_comes_at_the_sum_of_the_manuals_times(tmp_path, model, commit_us):
    module = f"{{module: {model}, tick_ms: 1.0, tasks: {{A: {{priority: 5}}}}}}"
    rack = built(tmp_path, {0: module}, "  A%: {}\n", A=TASK.format(name="A", ticks=3))
    first = round(commit_us * 1000)
    assert commits(rack, 0.007) == [("A%", first), ("A%", 3_000_000 + first), ("A%", 6_000_000 + first)]


HIGH = """10 COMMON HIGH%
20 CALL SCAN_LOOP(TICKS=1)
30 CALL SUMMER(INPUT1=HIGH%, INPUT2=1, OUTPUT=HIGH%)
40 END
"""
"""112.80 us on a 7010: 84.10 + 11.28 + 17.42."""
LOW = f"""10 COMMON HIGH%, LOW%, EARLY%, LATE%
20 CALL SCAN_LOOP(TICKS=4)
30 EARLY% = HIGH%
{remarks(35)}2000 LATE% = HIGH%
2010 CALL SUMMER(INPUT1=HIGH%, INPUT2=0, OUTPUT=LOW%)
2020 END
"""
"""SCAN_LOOP 80 + 4 t (6.4) + 4 i (10.0) = 96.40; 6.00 a BASIC assignment (estimated); 35 remarks 345.80; SUMMER 11.28;
END 13.82 + 4 t (8.0) + 4 i (6.4) = 28.22."""
TWO = "{module: 57C435, tick_ms: 0.5, tasks: {HIGH: {priority: 4}, LOW: {priority: 9}}}"
COMMONS = "  HIGH%: {}\n  LOW%: {}\n  EARLY%: {}\n  LATE%: {}\n"


def test_a_scan_that_is_suspended_goes_on_with_the_time_that_it_has_left(tmp_path):
    """LOW begins at 112.80, latches HIGH% = 1 at 209.20; HIGH scans from 500.00 to 612.80 and makes it 2."""
    rack = built(tmp_path, {0: TWO}, COMMONS, HIGH=HIGH, LOW=LOW)
    early = 112_800 + 96_400 + 6_000
    late = early + 345_800 + 6_000 + 112_800
    commit = late + 11_280 + 28_220
    assert commits(rack, 0.00099) == [
        ("HIGH%", 112_800),
        ("EARLY%", early),
        ("HIGH%", 612_800),
        ("LATE%", late),
        ("LOW%", commit),
    ]
    values = {name: rack.value(name) for name in ("EARLY%", "LATE%", "LOW%")}
    assert values == {"EARLY%": 1, "LATE%": 2, "LOW%": 1}, "BASIC sees what is, blocks what was latched"
    counts = rack.statistics["LOW"]
    assert (counts.scans, counts.last_ns) == (1, commit - 112_800)


@pytest.mark.parametrize("same", [True, False], ids=["same Processor", "another Processor"])
def test_the_manuals_example_of_100_and_299(tmp_path, same):
    """3.3: ABC latches 100; XYZ writes 299 before ABC has completed its scan; ABC's blocks see 100 to the end of it."""
    abc = f"""10 COMMON COMM_VAR%, FIRST%, SECOND%, BASIC%
20 LOCAL NIL%
100 CALL SCAN_LOOP(TICKS=4)
110 CALL SUMMER(INPUT1=COMM_VAR%, INPUT2=NIL%, OUTPUT=FIRST%)
{remarks(60)}2000 CALL SUMMER(INPUT1=COMM_VAR%, INPUT2=NIL%, OUTPUT=SECOND%)
2010 BASIC% = COMM_VAR%
2020 END
"""
    xyz = """10 COMMON COMM_VAR%
20 LOCAL N%
30 CALL SCAN_LOOP(TICKS=1)
40 N% = N% + 1
50 IF N% = 2 THEN COMM_VAR% = 299
60 END
"""
    tasks = (
        ["{ABC: {priority: 8}}", "{XYZ: {priority: 4}}"] if not same else ["{ABC: {priority: 8}, XYZ: {priority: 4}}"]
    )
    slots = {0: "{module: 57C413}"}
    for slot, listed in enumerate(tasks, 1):
        slots[slot] = f"{{module: 57C435, tick_ms: 0.5, tasks: {listed}}}"
    commons = "  COMM_VAR%: {preset: 100}\n  FIRST%: {}\n  SECOND%: {}\n  BASIC%: {}\n"
    rack = run_for(built(tmp_path, slots, commons, ABC=abc, XYZ=xyz), 0.0019)
    names = ("COMM_VAR%", "FIRST%", "SECOND%", "BASIC%")
    assert [rack.value(name) for name in names] == [299, 100, 100, 299]
    rack.run(0.002)
    assert [rack.value(name) for name in names] == [299, 299, 299, 299]


@pytest.mark.parametrize(
    ("count", "stopped_ns"),
    [
        # 80.00 + 13.82 + 41 x 9.88 = 498.90 of 500 us
        (41, None),
        # 508.78
        (42, 500_000),
    ],
)
def test_a_task_alone_overlaps_just_above_its_period(tmp_path, count, stopped_ns):
    text = f"10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=1)\n{remarks(count)}3000 END\n"
    module = "{module: 57C435, tick_ms: 0.5, tasks: {A: {priority: 5}}}"
    rack = run_for(built(tmp_path, {0: module}, "  X%: {}\n", A=text), 0.1)
    stopped = rack.operations.stopped
    assert (None if stopped is None else stopped.time_ns) == stopped_ns
    assert rack.statistics["A"].scans == (200 if stopped_ns is None else 0)


@pytest.mark.parametrize(("count", "stopped_ns"), [(68, None), (69, 1_000_000)])
def test_tasks_overlap_when_together_they_need_more_than_there_is(tmp_path, count, stopped_ns):
    """Two scans of HIGH and 93.82 + 9.88 a remark: 991.26 or 1001.14 of 1000 us."""
    low = f"10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=2)\n{remarks(count)}3000 END\n"
    rack = run_for(built(tmp_path, {0: TWO}, COMMONS, HIGH=HIGH, LOW=low), 0.05)
    stopped = rack.operations.stopped
    assert (None if stopped is None else (stopped.time_ns, stopped.task, stopped.code)) == (
        None if stopped_ns is None else (stopped_ns, "LOW", "14")
    )
    if stopped is not None:
        assert rack.value("HIGH%") == 0, "STOP ALL clears volatile commons"
        assert rack.task("HIGH").status is Status.STOPPED
        assert rack.task("LOW").errors.last.describe().startswith("scan 1, line 20: AMX7070 overlap")


def test_an_overlap_is_told_as_a_scan_that_has_nothing_but_its_error(tmp_path):
    seen = []

    class Notes(Observer):
        def scanned(self, task, record, _) -> None:
            seen.append((task.name, record.scan, record.time_ns, record.errors, record.reads))

        def operated(self, operation) -> None:
            seen.append((operation.what, operation.task, operation.at_ns))

    text = f"10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=1)\n{remarks(42)}3000 END\n"
    module = "{module: 57C435, tick_ms: 0.5, tasks: {A: {priority: 5}}}"
    rack = built(tmp_path, {0: module}, "  X%: {}\n", A=text)
    rack.observe(Notes())
    rack.start()
    rack.run(0.1)
    assert seen[-2:] == [("A", 1, 500_000, [(20, 7070)], []), ("stop_all", "A", 500_000)]


GIVEN_UP = f"""10 COMMON SEEN%, OUT%
20 LOCAL N%, T%(2), GAIN% [CURRENT=2, HIGH=9, LOW=0]
30 CALL SCAN_LOOP(TICKS=2)
40 N% = N% + GAIN%
50 T%(1) = N%
60 SEEN% = N%
{remarks(20)}2000 CALL SUMMER(INPUT1=N%, INPUT2=0, OUTPUT=OUT%)
2010 END
"""


def test_a_scan_that_is_given_up_leaves_nothing_but_what_it_has_written(tmp_path):
    module = "{module: 57C435, tick_ms: 0.5, tasks: {A: {priority: 5}}}"
    rack = run_for(built(tmp_path, {0: module}, "  SEEN%: {}\n  OUT%: {}\n", A=GIVEN_UP), 0.00115)
    task = rack.task("A")
    assert (rack.value("SEEN%"), rack.value("OUT%"), task.scan_number, task.value("N%")) == (4, 2, 1, 2)
    rack.operations.stop("A")
    rack.run(0.01)
    assert (rack.value("SEEN%"), rack.value("OUT%")) == (4, 2)
    assert [task.value("N%"), task.value("T%")] == [2, [0, 2, 0]]
    rack.operations.run("A")
    rack.run(0.00099)
    assert (rack.value("SEEN%"), rack.value("OUT%"), task.value("N%")) == (4, 4, 4)


def test_what_is_tuned_while_a_scan_is_under_way_is_in_force_from_the_next_one(tmp_path):
    module = "{module: 57C435, tick_ms: 0.5, tasks: {A: {priority: 5}}}"
    rack = run_for(built(tmp_path, {0: module}, "  SEEN%: {}\n  OUT%: {}\n", A=GIVEN_UP), 0.00005)
    rack.tune(rack.task("A"), "GAIN%", 5)
    rack.run(0.00095)
    assert rack.value("OUT%") == 2
    rack.run(0.001)
    assert (rack.value("OUT%"), rack.task("A").value("GAIN%")) == (7, 5)


def test_tasks_start_in_the_order_of_priority_and_name_before_anything_is_latched(tmp_path):
    """J2-3106-1 p. 12-4; start-up parts take no time (decision), so the first latch is that of the highest priority."""
    text = """10 COMMON ORDER%(9), NEXT%, {name}%
20 ORDER%(NEXT%) = {digit}
30 NEXT% = NEXT% + 1
40 CALL SCAN_LOOP(TICKS=1)
50 CALL SUMMER(INPUT1={name}%, INPUT2=1, OUTPUT={name}%)
60 END
"""
    digits = {"D": (4, 1), "A": (7, 2), "B": (7, 3), "C": (9, 4)}
    listed = ", ".join(f"{name}: {{priority: {digits[name][0]}}}" for name in "BCDA")
    module = f"{{module: 57C435, tick_ms: 1.0, tasks: {{{listed}}}}}"
    commons = "  ORDER%(9): {}\n  NEXT%: {}\n" + "".join(f"  {name}%: {{}}\n" for name in digits)
    sources = {name: text.format(name=name, digit=digit) for name, (_, digit) in digits.items()}
    rack = run_for(built(tmp_path, {0: module}, commons, **sources))
    assert [rack.value("ORDER%", place) for place in range(4)] == [1, 2, 3, 4]
    assert commits_of(rack, 0.001) == ["D%", "A%", "B%", "C%"]


def commits_of(rack: Rack, seconds: float) -> list[str]:
    rack.memory.keep_log()
    rack.run(seconds)
    return [rack.memory.specs[write.view].name for write in rack.memory.drain()]


ERRORS = """10 COMMON A%
15 LOCAL NIL%, I%, N%
20 CALL SCAN_LOOP(TICKS=1)
30 N% = N% / NIL%
40 FOR I% = 1 TO 40
50 A% = A% + 1
60 NEXT I%
70 N% = N% / NIL%
80 END
"""


@pytest.mark.parametrize("later", [False, True])
def test_an_error_log_that_is_cleared_in_the_middle_of_a_scan_keeps_what_the_scan_logs(tmp_path, later):
    """Two errors a scan: the second scan has logged one of its two when the log is cleared."""
    rack = rack_of(tmp_path, {"A": (5, 1)}, tick="5.5")
    rack.operations.reload("A", SourceText("A.BLK", ERRORS))
    rack.start()
    rack.run(0.0058)
    task = rack.task("A")
    assert (task.progress is not None, task.errors.count) == (True, 3)
    rack.operations.clear_errors("A")
    assert task.errors.entries == [LogEntry(30, 7024, 2)]
    assert ErrorLog().flatten() == task.snapshot()[-LOG_NUMBERS:]
    if later:
        state, rack = rack.state(), rack_of(tmp_path, {"A": (5, 1)}, tick="5.5")
        rack.operations.reload("A", SourceText("A.BLK", ERRORS))
        rack.load(state)
        task = rack.task("A")
    rack.run(0.003)
    assert task.progress is None
    assert task.errors.entries == [LogEntry(30, 7024, 2), LogEntry(70, 7024, 2)]
    assert task.snapshot()[-LOG_NUMBERS:] == task.errors.flatten()


def test_a_scan_that_is_given_up_after_its_error_log_was_cleared_leaves_it_empty(tmp_path):
    rack = rack_of(tmp_path, {"A": (5, 1)}, tick="5.5")
    rack.operations.reload("A", SourceText("A.BLK", ERRORS))
    rack.start()
    rack.run(0.0058)
    rack.operations.clear_errors("A")
    rack.operations.stop("A")
    assert rack.task("A").errors.count == 0
