"""A commit of native scans into the cells: it does what a commit by a call does, and the gate says when it may."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import NativeTask, native_form
from automax_ros.core.types import DataType
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import Place, ViewSpec
from automax_ros.runtime.tasks.task import Task
from compile.support import OTHER, WRITER, compiled_of, program_of, repeatable, views_of

TEXT = """10 COMMON REF%, RUN@, OUT%, SUM%, LAMP@, BACK%
20 LOCAL N%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=REF%, INPUT2=OUT%, OUTPUT=OUT%)
50 CALL SUMMER(INPUT1=SUM%, INPUT2=REF%, OUTPUT=SUM%)
60 CALL AND(INPUT1=RUN@, INPUT2=-LAMP@, OUTPUT=LAMP@)
70 BACK% = BACK% + 1
80 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=BACK%)
90 N% = N% + 1
100 IF N% = 90 THEN STOP
110 END
"""
NAMES = ("REF%", "RUN@", "OUT%", "SUM%", "LAMP@", "BACK%")
REF, RUN, OUT, SUM, LAMP, BACK = range(6)


class Called(CommonMemory):
    """Counts the commits that come as a call."""

    calls = 0

    def commit(self, changes, writer):
        self.calls += 1
        super().commit(changes, writer)

    def committing(self):
        return super().committing()


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> NativeCache:
    return NativeCache(tmp_path_factory.mktemp("cache") / "native")


@pytest.fixture(scope="module")
def native(cache) -> NativeTask:
    return native_form(compiled_of(TEXT), cache)


def two_tasks(native: NativeTask, memory_class=CommonMemory) -> tuple[Task, Task]:
    """The same task in C and in Python, each with a memory of its own, in RUN."""
    specs, made = views_of(program_of(TEXT)), []
    for compiled in (native.compiled.with_scans(native.scans, native.scans_forced), native.compiled):
        task = Task(compiled, memory_class(specs), writer=WRITER)
        task.run()
        made.append(task)
    return made[0], made[1]


def seen(task: Task) -> tuple[object, ...]:
    """All that can be told of a task and its memory; the values by their types as well."""
    memory = task.memory
    log = None if memory._log is None else memory.drain()
    causes = None if memory._causes is None else memory.take_causes()
    return repr(memory.image()), memory.sequence, log, causes, task.status, memory.under_forces


steps = st.one_of(
    st.tuples(st.just("scan"), st.integers(1, 3), st.just(0)),
    st.tuples(st.just("write"), st.integers(0, 5), st.integers(-40_000, 40_000)),
    st.tuples(st.just("force"), st.sampled_from([OUT, LAMP, REF]), st.integers(0, 1)),
    st.tuples(st.just("release"), st.sampled_from([OUT, LAMP, REF]), st.just(0)),
    st.tuples(st.just("hold"), st.sampled_from([OUT, LAMP]), st.integers(0, 1)),
    st.tuples(st.sampled_from(["log", "causes", "record", "not recorded", "put down"]), st.just(0), st.just(0)),
)


def take(task: Task, what: str, first: int, second: int) -> object:
    """Take one step; return what it gives."""
    memory = task.memory
    value = second % 2 == 1 if first in (RUN, LAMP) else second % 1000
    match what:
        case "scan":
            return [task.scan(number) for number in range(first)]
        case "write":
            return memory.write_from_outside(first, value, OTHER)
        case "force":
            return memory.force(first, value)
        case "release":
            return memory.release(first)
        case "hold":
            return memory.hold([(first, 0)] * second)
        case "log":
            return memory.keep_log()
        case "causes":
            return memory.keep_causes()
        case "put down":
            return task.state[:]
    return task.record_scans(on=what == "record")


@given(work=st.lists(steps, max_size=40))
@repeatable(150)
def test_native_scans_commit_what_scans_in_python_do(native, work):
    """Whatever is forced, logged, recorded or written in between: image, numbers of writes, log and records."""
    in_c, in_python = two_tasks(native)
    for step in [*work, ("scan", 2, 0), ("log", 0, 0), ("write", REF, 3), ("scan", 2, 0), ("put down", 0, 0)]:
        assert take(in_c, *step) == take(in_python, *step)
        assert seen(in_c) == seen(in_python)


@pytest.mark.parametrize(
    ("close", "again"),
    [
        (lambda memory: memory.force(OUT, 5), lambda memory: memory.release(OUT)),
        (lambda memory: memory.force(RUN, True), lambda memory: memory.release(RUN)),
        (lambda memory: memory.hold([(REF, 0)]), lambda memory: memory.hold([])),
        (lambda memory: memory.keep_log(), None),
        (lambda memory: memory.keep_causes(), None),
    ],
)
def test_the_gate_is_closed_while_more_than_the_cells_must_know(native, close, again):
    memory = CommonMemory(views_of(program_of(TEXT)))
    gate = memory.committing().gate
    assert list(gate) == [1, 0]
    gate[1] = 4  # four values were stored
    assert memory.sequence == 4
    close(memory)
    assert (gate[0], gate[1], memory.sequence >= 4) == (0, 0, True)
    if again is not None:
        again(memory)
        assert gate[0] == 1


def test_values_that_scans_store_have_numbers_in_the_log_that_follows(native):
    in_c, _ = two_tasks(native)
    memory = in_c.memory
    memory.write_from_outside(REF, 3, OTHER)
    in_c.scan(0)  # writes OUT%, SUM% and, by BASIC, BACK%; BACK% = 3 at END too
    stored = memory.sequence
    assert (stored, memory.committing().gate[1]) == (1 + 1 + 3, 3)
    memory.keep_log()
    memory.write_from_outside(REF, 4, OTHER)
    assert [entry.sequence for entry in memory.drain()] == [stored + 1]


def test_a_memory_whose_commit_is_overridden_is_called(native):
    assert CommonMemory(views_of(program_of(TEXT))).committing() is not None
    task, _ = two_tasks(native, Called)
    task.memory.write_from_outside(REF, 3, OTHER)
    for number in range(3):
        task.scan(number)
    assert task.memory.committing() is None
    assert task.memory.calls == 3


def test_points_of_a_module_are_committed_by_a_call(cache):
    """A word and its bits change together, so that no scan may store them by itself."""
    compiled = compiled_of("10 COMMON IN%, WORD%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL SUMMER(INPUT1=IN%, INPUT2=0, "
                           "OUTPUT=WORD%)\n40 END\n")  # fmt: skip
    views = [
        ViewSpec("IN%", DataType.INTEGER),
        ViewSpec("WORD%", DataType.INTEGER, place=Place(2, 0)),
        ViewSpec("REGISTERS", DataType.INTEGER, elements=1, is_array=True),
        ViewSpec("BIT@", DataType.BOOLEAN, place=Place(2, 0, 1)),
    ]
    memory = CommonMemory(views)
    task = Task(replace(compiled, scans=native_form(compiled, cache).scans), memory, writer=WRITER)
    task.run()
    for value in (2, 1, 3):
        memory.write_from_outside(0, value, OTHER)
        task.scan(value)
        assert [memory.read_now(view) for view in (1, 2, 3)] == [value, value, value != 1]
    assert memory.committing().gate[1] == 0
