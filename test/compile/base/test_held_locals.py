"""A force holds a task's own variables: whatever the task writes to them, all that reads them sees the force."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from automax_ros.compile.base.scan_io import Suspension
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.tasks.task import Status, Task
from compile.support import basic_task_of, compiled_of, task_of

HELD = 5
EACH_WRITE = {
    "assignment": "110 X% = 7",
    "an assignment that reads it": "110 X% = X% + 1",
    "a branch": "110 IF SEEN% >= 0 THEN X% = 9",
    "READ": "105 RESTORE\n110 READ X%\n200 DATA 8",
    "a block": "110 CALL SUMMER(INPUT1=X%, INPUT2=100, OUTPUT=X%)",
    "a block with a history": "105 Y% = 1000\n110 CALL LAG(INPUT=Y%, WLG=50.0, RESET=FALSE, OUTPUT=X%)",
    "a FOR that is over at once": "110 FOR X% = 1 TO 4\n111 Y% = Y% + 1\n112 NEXT X%",
    "GOSUB": "110 GOSUB 300\n120 GOTO 320\n300 X% = 11\n310 RETURN\n320 Y% = 0",
}
Scan = Callable[[Task], None]


def ideal(task: Task) -> None:
    task.scan(0)


def modeled(task: Task) -> None:
    for _ in task.scan_modeled(0) or ():
        pass


def source(lines: str) -> str:
    head = "10 COMMON SEEN%\n20 LOCAL X%, Y%\n50 X% = 3\n100 CALL SCAN_LOOP(TICKS=1)\n"
    return f"{head}{lines}\n800 SEEN% = X%\n900 END\n"


@pytest.mark.parametrize("scan", [ideal, modeled])
@pytest.mark.parametrize("lines", EACH_WRITE.values(), ids=EACH_WRITE)
def test_each_kind_of_write_leaves_a_held_local_as_it_is(lines: str, scan: Scan) -> None:
    task, memory = task_of(source(lines))
    task.hold({"X%": HELD})
    task.run()
    for _ in range(3):
        scan(task)
        assert (memory.read_now(0), task.value("X%"), task.status) == (HELD, HELD, Status.RUNNING)
    free, _ = task_of(source(lines))
    free.run()
    task.hold({})
    assert (task.value("X%"), task.held) == (HELD, {})
    free.restore(task.snapshot())
    scan(task)
    scan(free)
    assert task.snapshot() == free.snapshot()


def test_a_block_goes_on_as_if_its_output_were_not_held() -> None:
    """Only what reads the local sees the force: the history of the block that writes it is its own."""
    lines = "105 Y% = 1000\n110 CALL LAG(INPUT=Y%, WLG=50.0, RESET=FALSE, OUTPUT=X%)"
    held, free = task_of(source(lines))[0], task_of(source(lines))[0]
    held.hold({"X%": HELD})
    held.run(), free.run()
    for _ in range(4):
        held.scan(0), free.scan(0)
    held.hold({})
    held.scan(0), free.scan(0)
    assert held.value("X%") == free.value("X%") != HELD


@pytest.mark.parametrize("scan", [ideal, modeled])
def test_a_loop_whose_variable_is_held_inside_its_limits_faults_the_task(scan: Scan) -> None:
    task, _ = task_of(source("110 FOR X% = 1 TO 8\n111 Y% = 1\n112 NEXT X%"))
    task.hold({"X%": HELD})
    task.run()
    scan(task)
    assert task.status is Status.FAULTED
    assert [(entry.line, entry.problem) for entry in task.errors.entries] == [(110, "AMX7040")]


@pytest.mark.parametrize("held", [-3, 9])
def test_a_loop_cannot_reach_past_an_array_with_a_held_variable(held: int) -> None:
    text = source("110 FOR X% = 0 TO 3\n111 T%(X%) = 1\n112 NEXT X%").replace("Y%", "Y%, T%(3)")
    task, _ = task_of(text)
    task.hold({"X%": held})
    task.run()
    task.scan(0)
    assert task.value("T%") == [0, 0, 0, 0]
    assert task.status is (Status.FAULTED if held < 0 else Status.RUNNING)


@pytest.mark.parametrize("scan", [ideal, modeled])
def test_the_other_locals_count_and_states_have_the_same_layout(scan: Scan) -> None:
    task, _ = task_of(source("110 X% = X% + 1\n120 Y% = Y% + 1"))
    layout = task.layout
    task.run()
    for number in range(6):
        task.hold({"X%": number} if number % 2 else {})
        scan(task)
        assert task.layout == layout
    assert (task.value("X%"), task.value("Y%")) == (5, 6)


def test_a_scan_under_way_ends_as_it_began() -> None:
    task, _ = task_of(source("110 X% = 7\n120 SEEN% = 1\n130 X% = X% + 1"))
    task.run()
    steps = task.scan_modeled(0)
    assert steps is not None
    next(steps)
    task.hold({"X%": HELD})
    assert (task.forces, task.held) == ({"X%": HELD}, {})
    for _ in steps:
        pass
    assert (task.memory.read_now(0), task.value("X%"), task.held) == (8, HELD, {"X%": HELD})
    steps = task.scan_modeled(0)
    next(steps)
    task.hold({"X%": 6})
    steps.close()
    task.heed_forces()
    assert (task.value("X%"), task.held) == (6, {"X%": 6})


def test_the_same_names_give_the_same_functions() -> None:
    compiled = compiled_of(source("110 X% = 7"))
    held = compiled.holding(frozenset({"X%"}))
    assert held.holding(frozenset({"X%"})) is held
    assert held.holding(frozenset()).source == compiled.source != held.source
    assert held.layout == compiled.layout


@pytest.mark.parametrize("scan", [ideal, modeled])
def test_a_basic_task_keeps_a_held_local_against_input_and_loops(scan: Scan) -> None:
    channels = Channels()
    reader, _ = basic_task_of(
        "10 COMMON SEEN%\n20 LOCAL X%, Y%\n30 OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I, I), DEPTH = 4\n"
        "40 INPUT #1, X%, Y%\n50 SEEN% = X%\n60 X% = 1\n70 DELAY 1 TICKS\n80 GOTO 40\n90 END\n",
        name="READER",
        channels=channels,
    )
    reader.run()
    scan(reader)
    assert reader.wish[0] == Suspension.EMPTY
    reader.hold({"X%": HELD})
    channels.send(1, "%%", (77, 88), 0)
    scan(reader)
    assert (reader.value("X%"), reader.value("Y%"), reader.memory.read_now(0)) == (HELD, 88, HELD)
    looping, _ = basic_task_of(
        "10 COMMON SEEN%\n20 LOCAL X%\n30 FOR X% = 1 TO 8\n40 SEEN% = SEEN% + 1\n50 NEXT X%\n60 END\n"
    )
    looping.hold({"X%": HELD})
    looping.run()
    for _ in range(3):
        scan(looping)
        assert (looping.wish[0], looping.status) == (Suspension.BUSY, Status.RUNNING)
    looping.hold({})
    scan(looping)
    assert (looping.status, looping.value("X%")) == (Status.ENDED, 9)
