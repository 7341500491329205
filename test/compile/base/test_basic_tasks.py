"""BASIC tasks: where bursts end, what they ask for, and that the two forms of a burst agree."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.base.scan_io import Suspension
from automax_ros.compile.lowering.basic_statements import BURST_LIMIT
from automax_ros.core.ticks import NS_PER_S
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.tasks.task import Status
from compile.support import ESTIMATES_US, TICK, basic_task_of, repeatable


def text(*statements: str, declare: str = "LOCAL A%, B%, I%, J%, X, S$, F@, T%(5)") -> str:
    numbered = [f"{10 * (place + 2)} {statement}" for place, statement in enumerate(statements)]
    return "\n".join([f"10 {declare}", *numbered, "30000 END"]) + "\n"


def test_a_burst_ends_at_each_wait_and_goes_on_after_it() -> None:
    task, _ = basic_task_of(text("A% = 1", "DELAY 3 TICKS", "A% = A% + 1", "DELAY 2 SECONDS", "A% = A% + 1"))
    task.run(0)
    seen = []
    now = 0
    while task.status is Status.RUNNING:
        task.scan(now)
        seen.append((now, task.value("A%")))
        now = task.wake_ns
    assert seen == [(0, 1), (3 * TICK, 2), (3 * TICK + 2 * NS_PER_S, 3)]
    assert task.status is Status.ENDED


def test_units_and_expressions_of_times() -> None:
    for unit, ns in (("TICKS", TICK), ("SECONDS", NS_PER_S), ("MINUTES", 60 * NS_PER_S), ("HOURS", 3600 * NS_PER_S)):
        task, _ = basic_task_of(text("A% = 3", f"DELAY A% * 2 - 1 {unit}"))
        task.run(0)
        task.scan(1000)
        assert (task.wish, task.wake_ns) == ((Suspension.DELAY, 5 * ns), 1000 + 5 * ns)


def test_a_delay_of_nothing_does_not_suspend() -> None:
    task, _ = basic_task_of(text("DELAY A% TICKS", "A% = 7"))
    task.run(0)
    task.scan(0)
    assert (task.value("A%"), task.status, task.errors.count) == (7, Status.ENDED, 0)


def test_for_and_gosub_last_over_suspensions() -> None:
    source = text(
        "FOR I% = 1 TO 3", "GOSUB 80", "NEXT I%", "B% = 100", "STOP", "REM",
        "A% = A% + I%", "DELAY I% TICKS", "RETURN",
    )  # fmt: skip
    task, _ = basic_task_of(source)
    task.run(0)
    now, instants = 0, []
    while task.status is Status.RUNNING:
        instants.append(now)
        task.scan(now)
        now = task.wake_ns
    assert instants == [0, TICK, 3 * TICK, 6 * TICK]
    assert (task.value("A%"), task.value("B%"), task.value("I%")) == (6, 100, 4)


def test_start_every_counts_from_the_statement_and_goes_on_after_it() -> None:
    source = text("A% = 1", "START EVERY 10 TICKS", "B% = B% + 1", "DELAY 4 TICKS", "J% = J% + 1")
    task, _ = basic_task_of(source)
    task.run(0)
    now, starts = 0, []
    for _ in range(6):
        task.scan(now)
        starts.append((now // TICK, task.value("B%"), task.value("J%")))
        now = task.wake_ns
    assert starts == [(0, 1, 0), (4, 1, 1), (10, 2, 1), (14, 2, 2), (20, 3, 2), (24, 3, 3)]
    assert task.value("A%") == 1


@pytest.mark.parametrize(
    ("delay", "expected", "next_start"),
    [
        pytest.param(25, [0, 25, 30, 55], 60, id="instants that a longer run has passed are left out"),
        pytest.param(10, [0, 10, 10, 20, 20], 30, id="a run that ends just when the next begins misses none"),
    ],
)
def test_instants_of_start_every(delay, expected, next_start) -> None:
    task, _ = basic_task_of(text("START EVERY 10 TICKS", "A% = A% + 1", f"DELAY {delay} TICKS"))
    task.run(0)
    now, starts = 0, []
    for _ in expected:
        task.scan(now)
        starts.append(now // TICK)
        now = task.wake_ns
    assert (starts, now) == (expected, next_start * TICK)


def test_a_loop_without_a_wait_gives_others_their_turn_at_the_next_tick() -> None:
    task, _ = basic_task_of(text("A% = 0", "A% = A% + 1", "IF A% > 30000 THEN A% = 0", "GOTO 30"))
    task.run(0)
    task.scan(0)
    assert (task.wish, task.wake_ns) == ((Suspension.BUSY, 0), TICK)
    first = task.value("A%")
    assert BURST_LIMIT // 4 <= first <= BURST_LIMIT
    task.scan(TICK)
    assert task.value("A%") > first
    assert task.wake_ns == 2 * TICK


def test_end_inside_a_subroutine_leaves_it() -> None:
    task, _ = basic_task_of(text("START EVERY 1 TICKS", "GOSUB 50", "REM", "A% = A% + 1", "IF A% < 40 THEN END"))
    task.run(0)
    for tick in range(40):
        task.scan(tick * TICK)
    assert (task.value("A%"), task.errors.count) == (40, 0)


def test_run_begins_at_the_first_statement_wherever_the_task_stopped() -> None:
    task, _ = basic_task_of(text("A% = A% + 1", "DELAY 1 TICKS", "B% = B% + 1", "DELAY 1 TICKS"))
    for _ in range(3):
        task.run(0)
        task.scan(0)
        task.scan(TICK)
        task.stop()
    assert (task.value("A%"), task.value("B%")) == (3, 3)


def test_common_memory_is_read_and_written_at_once() -> None:
    task, memory = basic_task_of(
        text("Q% = 5", "Q% = Q% + 1", "DELAY 1 TICKS", "A% = Q%", declare="LOCAL A% \\ COMMON Q%")
    )
    task.record_scans()
    task.run(0)
    record = task.scan(0)
    assert record is not None
    assert (record.writes, record.reads, record.latched, record.commits) == (
        [(0, 0, 5), (0, 0, 6)],
        [(0, 0, 5)],
        (),
        [],
    )
    memory.write_from_outside(0, 99, 9)
    task.scan(TICK)
    assert task.value("A%") == 99


def test_a_burst_in_steps_takes_the_estimates_of_its_statements() -> None:
    source = text("A% = 1", "Q% = A%", "DELAY 1 TICKS", declare="LOCAL A% \\ COMMON Q%")
    task, _ = basic_task_of(source, cost_model=CostModel(Model.MODEL_7010))
    task.run(0)
    steps = [ns for ns in task.scan_modeled(0) if ns]
    assign, delay = (round(ESTIMATES_US[word] * 1000) for word in ("Assignment", "Delay"))
    assert steps == [2 * assign, delay]


# A message passes from one task to another


def pair(depth: int = 2) -> tuple:
    channels = Channels()
    types = "TYPE = (I, R, S, B)"
    reader, _ = basic_task_of(
        text(f"OPEN CHANNEL FOR INPUT AS FILE #7, {types}, DEPTH = {depth}", "INPUT #7, A%, X, S$, F@", "J% = J% + A%",
             "GOTO 30"),
        name="READER", channels=channels,
    )  # fmt: skip
    writer, _ = basic_task_of(
        text(f"OPEN CHANNEL FOR OUTPUT AS FILE #7, {types}", "A% = A% + 1", 'PRINT #7, A%, A% / 2.0, "NO"; A% > 2',
             "GOTO 30"),
        name="WRITER", channels=channels,
    )  # fmt: skip
    for task in (reader, writer):
        task.record_scans()
        task.run(0)
    return reader, writer, channels


def test_a_writer_waits_for_the_reader_then_for_room() -> None:
    reader, writer, channels = pair()
    writer.scan(0)
    assert writer.wish == (Suspension.ABSENT, 7)
    reader.scan(0)
    assert reader.wish == (Suspension.EMPTY, 7)
    writer.scan(0)
    assert writer.wish == (Suspension.FULL, 7)
    assert channels.state() == ((7, "%.$@", 2, "READER", ((1, 0.5, "NO", False), (2, 1.0, "NO", False))),)
    record = reader.scan(0)
    assert (reader.value("J%"), reader.value("X"), reader.value("S$")) == (3, 1.0, "NO")
    assert record.reads == [
        (65535, 7, 0), (65535, 7, 1), (65533, 7, 0.5), (65531, 7, "NO"), (65532, 7, False),
        (65535, 7, 0), (65535, 7, 2), (65533, 7, 1.0), (65531, 7, "NO"), (65532, 7, False),
        (65535, 7, -1),
    ]  # fmt: skip


def test_a_full_writer_sends_once_there_is_room() -> None:
    reader, writer, _ = pair(depth=1)
    reader.scan(0)
    writer.scan(0)
    reader.scan(0)
    writer.scan(0)
    reader.scan(0)
    assert (reader.value("J%"), writer.value("A%")) == (1 + 2, 3)


def test_empty_and_full_lead_to_their_lines() -> None:
    channels = Channels()
    reader, _ = basic_task_of(
        text("OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I), DEPTH = 1", "INPUT:EMPTY=60 #1, A%", "B% = 1", "STOP",
             "B% = 2"),
        name="READER", channels=channels,
    )  # fmt: skip
    writer, _ = basic_task_of(
        text("OPEN CHANNEL FOR OUTPUT AS FILE #1, TYPE = (I)", "PRINT #1, 5", "PRINT:FULL=60 #1, 6", "STOP", "B% = 2"),
        name="WRITER", channels=channels,
    )  # fmt: skip
    reader.run(0)
    reader.scan(0)
    assert reader.value("B%") == 2
    writer.run(0)
    writer.scan(0)
    assert writer.value("B%") == 2
    reader.run(0)
    reader.scan(0)
    assert (reader.value("A%"), reader.value("B%")) == (5, 1)


def test_a_second_reader_and_another_type_are_logged() -> None:
    """AMX7051 and AMX7052 take two tasks."""
    reader, _, channels = pair()
    reader.scan(0)
    second, _ = basic_task_of(
        text("OPEN CHANNEL FOR INPUT AS FILE #7, TYPE = (I), DEPTH = 1", "INPUT #7, A%"),
        name="SECOND",
        channels=channels,
    )
    wrong, _ = basic_task_of(text("OPEN CHANNEL FOR OUTPUT AS FILE #7, TYPE = (I)", "PRINT #7, 1"), channels=channels)
    for task in (second, wrong):
        task.run(0)
        task.scan(0)
        assert task.status is Status.ENDED
    codes = [[entry.problem for entry in task.errors.entries] for task in (second, wrong)]
    assert codes == [["AMX7051", "AMX7050"], ["AMX7052", "AMX7050"]]


def test_a_port_is_the_tasks_log() -> None:
    task, _ = basic_task_of(
        text('OPEN "PORTB" AS FILE #1, SETUP = 0D00H, 9600', 'PRINT #1, "A ="; A%', 'PUT #1, "X"',
             "GET:EMPTY=60 #1, S$", "CLOSE #1", "B% = 1", 'PRINT #1, "STILL OPEN"')
    )  # fmt: skip
    task.run(0)
    task.scan(0)
    assert list(task.printed) == ["PORTB: A =0", "PORTB: X"]
    assert [(entry.line, entry.problem) for entry in task.errors.entries] == [(80, "AMX7050")]
    assert task.value("B%") == 1


# Random programs: both forms agree, and a task that is stored at any wait goes on as if nothing had happened


SIMPLE = st.sampled_from(
    ["A% = A% + 1", "B% = A% * 2", "Q% = Q% + A%", "T%(A% AND 3) = B%", "IF A% > B% THEN B% = B% + 3", "X = X + 0.5",
     "IF Q% > 20 THEN Q% = 0", "PRINT A%; B%", "S$ = STR$(Q%)", "READ J%", "RESTORE", "SET GO_ON"]
)  # fmt: skip
WAITS = st.sampled_from(["DELAY 1 TICKS", "DELAY A% - 3 TICKS", "START EVERY 7 TICKS", "DELAY 1 SECONDS", "REM"])


@st.composite
def programs(draw) -> str:
    """A BASIC task of statements, waits, one-line branches, a loop and a subroutine."""
    parts = draw(st.lists(st.one_of(SIMPLE, WAITS), min_size=1, max_size=8))
    loop = draw(st.lists(st.one_of(SIMPLE, WAITS), max_size=3))
    inner = draw(st.lists(st.one_of(SIMPLE, WAITS), max_size=3))
    statements = [
        *parts,
        "FOR I% = 1 TO 4",
        *loop,
        "GOSUB 2000",
        "NEXT I%",
        draw(st.sampled_from(["STOP", "REM", "GOTO 20"])),
    ]
    head = ["10 LOCAL A%, B%, I%, J%, X, S$, T%(5) \\ COMMON Q%", "15 EVENT NAME = GO_ON", "16 DATA 4, -2, 9"]
    body = [f"{20 + 10 * place} {statement}" for place, statement in enumerate(statements)]
    sub = [
        "1990 END" if draw(st.booleans()) else "1990 STOP",
        *(f"{2000 + n} {one}" for n, one in enumerate(["REM", *inner])),
    ]
    sub[0] = sub[0].replace("END", "IF TRUE THEN END")
    return "\n".join([*head, *body, *sub, "2900 RETURN", "3000 END"]) + "\n"


def outcome(task, memory, bursts: int, *, modeled: bool, renew=None) -> list:
    """What a task does over some bursts, each at the instant it asks for."""
    task.record_scans()
    task.run(0)
    now, seen = 0, []
    for _ in range(bursts):
        if task.status is not Status.RUNNING:
            break
        if renew is not None:
            task = renew(task)
        if modeled:
            steps = task.scan_modeled(now)
            try:
                while True:
                    next(steps)
            except StopIteration as end:
                record = end.value
        else:
            record = task.scan(now)
        seen.append((now, record, task.wish, task.every, task.snapshot(), task.status))
        now = max(now, task.wake_ns)
    return [*seen, list(memory.image())]


@given(programs())
@repeatable(60)
def test_both_forms_of_a_burst_agree(source: str) -> None:
    whole = outcome(*basic_task_of(source), 12, modeled=False)
    assert outcome(*basic_task_of(source), 12, modeled=True) == whole
    assert outcome(*basic_task_of(source, cost_model=CostModel(Model.MODEL_7010)), 12, modeled=True) == whole


@pytest.mark.parametrize("before", ["! TAKES TIME", "REM", "A% = 1", "FOR I% = 1 TO 2"])
def test_where_a_burst_goes_on_does_not_depend_on_what_it_costs(before: str) -> None:
    """Else a modeled recording could not be replayed, nor a state from one form of execution go on in another."""
    after = "NEXT I%" if before.startswith("FOR") else "REM"
    opening = "OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I), DEPTH = 2"
    source = text("DELAY 1 TICKS", before, opening, before, "INPUT #1, A%", after, after, "DELAY 1 TICKS")
    ideal, memory = basic_task_of(source)
    modeled, other = basic_task_of(source, cost_model=CostModel(Model.MODEL_7010))
    assert modeled.layout == ideal.layout
    assert outcome(modeled, other, 4, modeled=True) == outcome(ideal, memory, 4, modeled=False)


@given(programs())
@repeatable(40)
def test_a_task_stored_at_a_wait_goes_on_as_if_nothing_had_happened(source: str) -> None:
    def renewed(task):
        again, _ = basic_task_of(source, memory=task.memory, events=task.events, channels=task.channels)
        again.record_scans()
        again.restore(task.snapshot())
        again.wait_again(task.waiting())
        again.status, again.scan_number = task.status, task.scan_number
        return again

    whole = outcome(*basic_task_of(source), 12, modeled=False)
    assert outcome(*basic_task_of(source), 12, modeled=False, renew=renewed) == whole
