"""A running task: RUN and STOP, records of scans, the error log, snapshots, tunables."""

from __future__ import annotations

import pytest
from compile.support import OTHER, WRITER, lines, logged, run_scans, scan_in_steps, task_of

from automax_ros.core.kinds import WriteKind
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.scan.error_log import LOG_NUMBERS, ErrorLog, LogEntry
from automax_ros.runtime.tasks.task import Status
from runtime.drives import finished

COUNTING = """10 LOCAL N%, OUT%, STARTS%
20 STARTS% = STARTS% + 1
30 CALL SCAN_LOOP(TICKS=4)
40 N% = N% + 1
50 CALL RAMP(INPUT=1000, ACCEL_RATE=10, OUTPUT=OUT%)
60 END
"""


def test_nothing_happens_before_run():
    task, _ = task_of(COUNTING)
    assert (task.scan(0), task.status, task.value("N%")) == (None, Status.STOPPED, 0)
    assert list(task.scan_modeled(0)) == []
    assert task.period_ns == 4 * 5_500_000


def test_run_again_starts_blocks_anew_and_keeps_locals():
    """2.4.5."""
    task, _ = task_of(COUNTING)
    run_scans(task, 3)
    assert [task.value(name) for name in ("STARTS%", "N%", "OUT%")] == [1, 3, 30]
    task.stop()
    task.scan(9)
    assert (task.status, task.value("N%")) == (Status.STOPPED, 3)
    task.run()
    assert [task.value(name) for name in ("STARTS%", "N%", "OUT%", "50 RAMP.register")] == [2, 3, 30, 0]
    task.scan(10)
    assert (task.value("N%"), task.value("OUT%"), task.scan_number) == (4, 10, 1)


def test_stop_of_a_task_that_does_not_run_changes_nothing():
    task, _ = task_of(lines("STOP"))
    run_scans(task, 1)
    task.stop()
    assert task.status is Status.ENDED


RECORDED = """10 COMMON IN%, OUT%, T%(3), LATE!
20 LOCAL A%
30 A% = IN%
40 CALL SCAN_LOOP(TICKS=4)
50 T%(1) = IN% + LATE!
60 CALL SUMMER(INPUT1=IN%, INPUT2=T%(1), OUTPUT=OUT%)
70 A% = 100000 * IN%
80 END
"""


@pytest.mark.parametrize("in_steps", [False, True])
def test_a_record_has_all_that_a_scan_saw_and_did(in_steps):
    task, memory = task_of(RECORDED, **{"IN%": 7})
    task.record_scans()
    start = task.run(5)
    assert (start.time_ns, start.scan, start.latched, start.reads) == (5, 0, (), [(0, 0, 7)])
    memory.keep_log()
    record = finished(task.scan_modeled(9, skipped=3)) if in_steps else task.scan(9, skipped=3)
    assert (record.time_ns, record.scan, record.skipped) == (9, 1, 3)
    assert record.latched == (7, 0, 0)
    assert record.reads == [(0, 0, 7), (3, 0, 0), (2, 1, 7), (0, 0, 7)]
    assert record.writes == [(2, 1, 7)]
    assert record.commits == [(1, 14)]
    assert record.errors == [(70, 7020)]
    assert [(entry.writer, entry.kind, entry.time_ns) for entry in memory.drain()] == [
        (WRITER, WriteKind.BASIC, 9),
        (WRITER, WriteKind.COMMIT, 9),
    ]


def test_records_are_of_one_scan_each_and_may_begin_and_end_while_a_task_runs():
    task, _ = task_of(RECORDED, **{"IN%": 7})
    task.record_scans()
    task.run()
    first, second = task.scan(1), task.scan(2)
    assert (first.scan, second.scan, second.commits) == (1, 2, [])
    task.record_scans(on=False)
    assert task.scan(3) is None
    task.record_scans()
    assert task.scan(4).scan == task.scan_number == 4


def test_times_that_a_modeled_scan_is_sent_are_those_of_its_writes():
    task, memory = task_of(RECORDED, **{"IN%": 7})
    memory.keep_log()
    task.run()
    finished(task.scan_modeled(100), range(110, 1000, 10))
    assert [entry.time_ns for entry in memory.drain()] == [140, 170]


def test_a_modeled_scan_is_open_to_others_between_its_accesses():
    """Pre-emption: what another writes after the latch is seen by BASIC, not by blocks."""
    text = lines("A% = K%", "CALL SUMMER(INPUT1=K%, INPUT2=0, OUTPUT=B%)", declare="LOCAL A%, B% \\ COMMON K%")
    task, memory = task_of(text, **{"K%": 1})
    task.run()
    for number, _ in enumerate(task.scan_modeled(0)):
        if number == 1:
            memory.write_now(0, 2, OTHER)
    assert (task.value("A%"), task.value("B%")) == (2, 1)


def test_stop_in_a_modeled_scan_ends_the_task():
    task, _ = task_of(lines("A% = 1", "STOP"))
    task.run()
    scan_in_steps(task, 1)
    assert task.status is Status.ENDED


def entry(number: int) -> LogEntry:
    return LogEntry(10 * number, 7000 + number, number)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 9])
def test_the_log_keeps_first_second_and_last(count):
    """J2-3106-1 p. 13-4."""
    log = ErrorLog()
    for number in range(1, count + 1):
        log.add(entry(number))
    kept = sorted({number for number in (1, 2, count) if 1 <= number <= count})
    assert (log.entries, log.count) == ([entry(number) for number in kept], count)
    assert log.last == (entry(count) if count else None)
    twin = ErrorLog()
    twin.restore(log.flatten())
    assert twin == log
    assert len(log.flatten()) == LOG_NUMBERS
    log.clear()
    assert (log.entries, log.count) == ([], 0)


def test_a_log_from_elsewhere_is_checked():
    with pytest.raises(ValueError, match="10 numbers"):
        ErrorLog().restore([0] * 9)


def test_entries_say_what_they_are():
    assert entry(1).describe() == "scan 1, line 10: AMX7001 output of a block clamped to 16 bits"
    assert LogEntry(5, 7040, 2).describe().endswith("(code 14 on the rack)")
    assert LogEntry(5, 9999, 2).describe() == "scan 2, line 5: AMX9999 unknown problem"


def test_the_task_logs_line_code_and_scan():
    task, _ = task_of(lines("A% = A% + 1", "IF A% > 1 THEN B% = 5000 * A% * A%"))
    run_scans(task, 5)
    assert logged(task) == [(40, 7020)] * 3
    assert [item.scan for item in task.errors.entries] == [3, 4, 5]


def test_a_snapshot_that_does_not_fit_changes_nothing():
    task, _ = task_of(COUNTING)
    run_scans(task, 2)
    good = task.snapshot()
    for bad in (good[:-1], [*good, 0], ["TEXT", *good[1:]], [*good[:-1], "TEXT"], [99999, *good[1:]], []):
        with pytest.raises(ValueError, match=r"\w"):
            task.restore(bad)
        assert task.snapshot() == good


def test_the_layout_of_a_snapshot_counts_its_values():
    task, _ = task_of(RECORDED)
    assert sum(field.size for field in task.layout.fields) == len(task.snapshot())


TUNED = lines("A% = A% + G%", declare="LOCAL A%, G% [CURRENT=3, HIGH=10, LOW=-2], H [CURRENT=1.5, HIGH=2.0, LOW=0.1]")


def test_tunables_take_values_within_their_limits():
    task, _ = task_of(TUNED)
    for value in (-2, 10, 4):
        task.tune("G%", value)
        assert (task.value("G%"), type(task.value("G%"))) == (value, int)
    task.tune("H", 1)
    assert (task.value("H"), type(task.value("H"))) == (1.0, float)
    task.tune("H", 0.3)
    assert task.value("H") == 0.30000001192092896, "a REAL holds 24 bits"
    task.tune("H", task.compiled.program.symbols["H"].tuning.low)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("G%", 11),
        ("G%", -3),
        ("G%", 3.5),
        ("G%", float("nan")),
        ("G%", True),
        ("G%", "4"),
        ("H", 2.1),
        ("H", float("nan")),
        ("H", float("inf")),
    ],
)
def test_tunables_refuse_other_values(name, value):
    task, _ = task_of(TUNED)
    before = task.value(name)
    with pytest.raises(ValueError, match=r"\w"):
        task.tune(name, value)
    assert task.value(name) == before


@pytest.mark.parametrize("name", ["A%", "NONE%"])
def test_only_tunables_are_tuned(name):
    task, _ = task_of(TUNED)
    with pytest.raises(KeyError):
        task.tune(name, 1)


def test_run_keeps_what_was_tuned():
    task, _ = task_of(TUNED)
    task.tune("G%", 5)
    run_scans(task, 2)
    assert (task.value("G%"), task.value("A%")) == (5, 10)


def test_printed_lines_are_bounded():
    task, _ = task_of(lines("FOR A% = 1 TO 1500", "PRINT A%", "NEXT A%"))
    run_scans(task, 1)
    assert (len(task.printed), task.printed[-1]) == (1000, "1500")


ENDLESS = """10 LOCAL N%, M%
20 CALL SCAN_LOOP(TICKS=4)
30 N% = N% + 1
40 IF N% < 3 THEN GOTO 60
50 GOTO 50
60 M% = N%
70 END
"""


def test_a_scan_that_is_broken_off_keeps_what_it_reached():
    task, _ = task_of(ENDLESS)
    run_scans(task, 5)
    assert (task.status, task.scan_number) == (Status.FAULTED, 3)
    assert [task.value(name) for name in ("N%", "M%")] == [3, 2]
    task.run()
    task.scan(9)
    assert (logged(task)[-1], task.value("N%"), task.value("M%")) == ((50, 7040), 4, 2)


def test_what_is_set_between_scans_is_what_the_next_scan_works_with():
    task, _ = task_of(COUNTING)
    run_scans(task, 2)
    task.state[task.compiled.layout.index("N%")] = 100
    task.scan(3)
    task.scan(4)
    assert task.value("N%") == 102
    saved = task.snapshot()
    task.scan(5)
    task.restore(saved)
    task.scan(6)
    assert [task.value(name) for name in ("N%", "OUT%")] == [103, 50]


class Refusing(CommonMemory):
    """A memory whose commit fails while ``refuses`` is set, as no real one does."""

    refuses = False

    def commit(self, changes, writer):
        if self.refuses:
            raise KeyboardInterrupt
        super().commit(changes, writer)


def test_a_task_goes_on_after_a_scan_was_interrupted():
    """Ctrl-C may come in the middle of a scan: the state is whole, and the next scan begins from it."""
    task, memory = task_of(
        "10 COMMON OUT%\n20 LOCAL N%\n30 CALL SCAN_LOOP(TICKS=4)\n40 N% = N% + 1\n"
        "50 CALL SUMMER(INPUT1=N%, INPUT2=0, OUTPUT=OUT%)\n60 END\n",
        Refusing,
    )
    run_scans(task, 2)
    memory.refuses = True
    with pytest.raises(KeyboardInterrupt):
        task.scan(3)
    memory.refuses = False
    assert (task.value("N%"), memory.read_now(memory.view("OUT%"))) == (3, 2)
    task.scan(4)
    assert (task.value("N%"), memory.read_now(memory.view("OUT%"))) == (4, 4)
