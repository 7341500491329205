"""The form of a scan that yields before each BASIC line: the same results, and where it halts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from automax_ros.compile.compiler import compile_program
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.task import ScanRecord, Task
from compile.programs import checked, outside_writes, tasks
from compile.support import OTHER, WRITER, basic_task_of, repeatable, task_of, views_of

FLOW = """\
10 COMMON REF%, SUM!, OUT%
20 LOCAL I%, N%, M%
100 CALL SCAN_LOOP(TICKS=1)
105 REM nothing
110 N% = I% \\ M% = N% + 1
120 FOR I% = 1 TO 2
130 SUM! = SUM! + I%
140 NEXT I%
145 CALL SUMMER(INPUT1=REF%, INPUT2=M%, OUTPUT=OUT%)
150 IF M% > 1 THEN
160 GOSUB 300
170 ELSE
180 N% = 6
190 END_IF
200 IF N% > 5 THEN 220
210 N% = 0
220 GOTO 400
300 M% = 0
310 RETURN
400 END
"""


def by_lines(task: Task, now_ns: int = 0) -> list[Any]:
    """One scan; the lines with the values that they showed."""
    form: Any = task.compiled.scan_lines.scan
    return list(task.scan_modeled(now_ns, form=form))


def record_of(task: Task, now_ns: int) -> ScanRecord | None:
    """One scan; its record."""
    records: list[ScanRecord | None] = []

    def through() -> Iterator[Any]:
        form: Any = task.compiled.scan_lines.scan
        records.append((yield from task.scan_modeled(now_ns, form=form)))

    list(through())
    return records[0]


def installed(program) -> tuple[Task, CommonMemory]:
    memory = CommonMemory(views_of(program))
    compiled = compile_program(program, {spec.name: view for view, spec in enumerate(memory.specs)})
    memory.keep_log()
    task = Task(compiled, memory, writer=WRITER)
    task.record_scans()
    return task, memory


@given(text=tasks(), history=st.lists(outside_writes(), min_size=2, max_size=2), force=st.booleans())
@repeatable(60)
def test_a_scan_by_lines_does_what_a_scan_does(text, history, force):
    program = checked(text)
    (task, memory), (other, others_memory) = installed(program), installed(program)
    task.run(0)
    other.run(0)
    for now, writes in enumerate(history, 1):
        for place in (memory, others_memory):
            for name, value in writes.items():
                place.write_from_outside(place.view(name), value, OTHER)
            if force and task.written:
                view = task.written[0]
                place.force(view, place.read_now(view))
        record = task.scan(now)
        assert record_of(other, now) == record
        assert other.snapshot() == task.snapshot()
        assert others_memory.drain() == memory.drain()
        assert other.status is task.status


def test_lines_come_in_the_order_in_which_they_are_executed():
    task, _ = task_of(FLOW)
    assert sorted(task.compiled.scan_lines.lines)[:4] == [105, 110, 120, 130]
    task.run()
    first = [line for line, _ in by_lines(task)]
    # the first scan: M% is 1, so the branch of ELSE, and N% = 6 jumps to 220
    assert first == [105, 110, 120, 130, 140, 130, 140, 145, 150, 180, 200, 220, 400]
    second = [line for line, _ in by_lines(task)]
    assert second == [105, 110, 120, 130, 140, 130, 140, 145, 150, 160, 300, 310, 200, 210, 220, 400]


def test_each_line_shows_the_values_by_then():
    task, _ = task_of(FLOW, **{"REF%": 7})
    names = [*(field.name for field in task.compiled.layout.fields), *task.compiled.latched]
    task.run()
    shown = {line: dict(zip(names, values, strict=True)) for line, values in by_lines(task)}
    assert (shown[110]["M%"], shown[120]["M%"]) == (0, 1)
    assert [shown[line]["N%"] for line in (150, 180, 200)] == [0, 0, 6]
    assert shown[105]["REF%"] == 7
    # the block's output stands in the latch until END commits it
    assert (shown[145]["OUT%"], shown[150]["OUT%"]) == (0, 8)


def test_a_scan_that_is_given_up_leaves_its_task_as_it_was():
    task, _ = task_of(FLOW)
    task.run()
    form: Any = task.compiled.scan_lines.scan
    steps = task.scan_modeled(0, form=form)
    assert [next(steps)[0] for _ in range(3)] == [105, 110, 120]  # type: ignore[index]
    steps.close()
    assert task.value("M%") == 0
    assert 180 in [line for line, _ in by_lines(task)], "what follows is a first scan again"
    assert task.value("M%") == 1


def test_a_burst_of_a_basic_task_by_lines():
    task, _ = basic_task_of("10 LOCAL A%\n20 DELAY 1 TICKS\n30 A% = A% + 1\n40 IF A% < 2 THEN 30\n50 END\n")
    task.run()
    form: Any = task.compiled.scan_lines.scan
    bursts = [[line for line, _ in task.scan_modeled(now, form=form)] for now in (0, 5_500_000)]  # type: ignore[misc]
    assert bursts == [[20], [30, 40, 30, 40]]
