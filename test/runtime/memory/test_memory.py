"""Common memory: the four operations, forcing, the write log, what survives (2.4.5, architecture)."""

from __future__ import annotations

import pytest
from compile.support import OTHER, WRITER, repeatable, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import DataType
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import MemoryValueError, ViewSpec

VIEWS = (
    ViewSpec("SPEED%", DataType.INTEGER),
    ViewSpec("COUNT!", DataType.DOUBLE, non_volatile=True),
    ViewSpec("GAIN", DataType.REAL),
    ViewSpec("RUN@", DataType.BOOLEAN),
    ViewSpec("NAME$", DataType.STRING, length=4),
    ViewSpec("T%", DataType.INTEGER, elements=3, is_array=True),
    ViewSpec("KEPT%", DataType.INTEGER, elements=2, is_array=True, non_volatile=True),
)
SPEED, COUNT, GAIN, RUN, NAME, TABLE, KEPT = range(7)


@pytest.fixture
def memory() -> CommonMemory:
    made = CommonMemory(VIEWS)
    made.keep_log()
    return made


def test_everything_is_zero_at_installation(memory):
    """2.4.5."""
    assert [value for _, _, value in memory.image()] == [0, 0, 0.0, False, "", 0, 0, 0, 0, 0]
    assert [memory.view(spec.name) for spec in VIEWS] == list(range(7))
    with pytest.raises(KeyError):
        memory.view("NONE%")


@pytest.mark.parametrize("views", [[], [COUNT], [RUN, SPEED, COUNT]])
def test_a_latch_is_a_copy_in_the_planned_order(memory, views):
    memory.write_now(SPEED, 5, WRITER)
    memory.write_now(RUN, True, WRITER)
    latched = memory.latch(memory.plan(views))
    memory.write_now(SPEED, 9, WRITER)
    assert latched == tuple({SPEED: 5, COUNT: 0, RUN: True}[view] for view in views)


def test_every_write_that_takes_effect_is_an_entry(memory):
    memory.now_ns = 7
    memory.commit([(SPEED, 5), (COUNT, 6)], WRITER)
    memory.write_now(TABLE, 3, WRITER, 2)
    memory.now_ns = 9
    memory.write_from_outside(RUN, 1, OTHER)
    entries = memory.drain()
    assert [tuple(entry) for entry in entries] == [
        (1, 7, WRITER, WriteKind.COMMIT, SPEED, 0, 5),
        (2, 7, WRITER, WriteKind.COMMIT, COUNT, 0, 6),
        (3, 7, WRITER, WriteKind.BASIC, TABLE, 2, 3),
        (4, 9, OTHER, WriteKind.OUTSIDE, RUN, 0, True),
    ]
    assert memory.drain() == []


def test_without_anybody_who_asked_no_log_is_kept():
    memory = CommonMemory(VIEWS)
    memory.write_now(SPEED, 1, WRITER)
    assert memory.drain() == []
    memory.keep_log()
    memory.write_now(SPEED, 2, WRITER)
    assert [entry.sequence for entry in memory.drain()] == [2]


@pytest.mark.parametrize(
    ("view", "value"),
    [
        (SPEED, 32768),
        (SPEED, -32769),
        (SPEED, 1.5),
        (SPEED, True),
        (SPEED, "1"),
        (SPEED, float("nan")),
        (COUNT, 2**31),
        (COUNT, float("inf")),
        (GAIN, 1e19),
        (GAIN, float("nan")),
        (GAIN, float("-inf")),
        (GAIN, 10**400),
        (GAIN, "1.0"),
        (GAIN, False),
        (RUN, 2),
        (RUN, "TRUE"),
        (NAME, "ABCDE"),
        (NAME, 5),
    ],
)
def test_values_from_outside_that_do_not_fit_are_refused(memory, view, value):
    with pytest.raises(MemoryValueError, match=VIEWS[view].name.replace("$", r"\$")):
        memory.write_from_outside(view, value, OTHER)
    with pytest.raises(MemoryValueError):
        memory.force(view, value)
    assert (memory.drain(), memory.forced) == ([], frozenset())


@pytest.mark.parametrize(
    ("view", "value", "stored"),
    [(SPEED, -5.0, -5), (GAIN, 3, 3.0), (GAIN, 0.1, 0.10000000149011612), (RUN, 1, True), (NAME, "ABCD", "ABCD")],
)
def test_values_from_outside_take_the_variables_type(memory, view, value, stored):
    memory.write_from_outside(view, value, OTHER)
    assert (memory.read_now(view), type(memory.read_now(view))) == (stored, type(stored))


@pytest.mark.parametrize(("view", "element"), [(TABLE, 3), (TABLE, -1), (SPEED, 1)])
def test_elements_that_do_not_exist_are_refused(memory, view, element):
    with pytest.raises(MemoryValueError, match="no element"):
        memory.write_from_outside(view, 1, OTHER, element)


def test_a_force_is_what_everybody_sees_and_nobody_overwrites(memory):
    memory.force(SPEED, 42)
    memory.force(TABLE, 7, element=1)
    memory.drain()
    memory.commit([(SPEED, 1)], WRITER)
    memory.write_now(SPEED, 2, WRITER)
    memory.write_now(TABLE, 2, WRITER, 1)
    memory.write_from_outside(SPEED, 3, OTHER)
    memory.write_now(TABLE, 5, WRITER, 0)
    assert (memory.latch(memory.plan([SPEED])), memory.read_now(SPEED)) == ((42,), 42)
    assert [memory.read_now(TABLE, element) for element in range(3)] == [5, 7, 0]
    assert [(entry.view, entry.element) for entry in memory.drain()] == [(TABLE, 0)], "dropped writes are not entries"
    assert memory.forced == {(SPEED, 0), (TABLE, 1)}


def test_the_force_itself_is_in_the_write_log(memory):
    """The write log is the bag's truth: without it a replay would not know the value."""
    memory.force(SPEED, 42, writer=OTHER)
    memory.force(SPEED, 43, writer=OTHER)
    assert [(entry.writer, entry.kind, entry.value) for entry in memory.drain()] == [
        (OTHER, WriteKind.FORCE, 42),
        (OTHER, WriteKind.FORCE, 43),
    ]
    memory.release(SPEED, writer=OTHER)
    assert [(entry.kind, entry.value) for entry in memory.drain()] == [(WriteKind.RELEASE, 43)]
    memory.release(SPEED, writer=OTHER)
    assert memory.drain() == []


def test_release_leaves_the_value_until_the_next_write(memory):
    memory.force(SPEED, 42)
    memory.release(SPEED)
    assert memory.read_now(SPEED) == 42
    memory.write_now(SPEED, 1, WRITER)
    assert memory.read_now(SPEED) == 1
    memory.release(SPEED)


def test_a_forced_latch_and_dropped_writes_of_a_task():
    text = """10 COMMON IN%, OUT%, BASIC%
20 CALL SCAN_LOOP(TICKS=4)
30 CALL SUMMER(INPUT1=IN%, INPUT2=1, OUTPUT=OUT%)
40 BASIC% = IN% + 2
50 END
"""
    task, memory = task_of(text)
    memory.force(memory.view("IN%"), 10)
    task.run()
    task.scan(0)
    assert (memory.read_now(1), memory.read_now(2)) == (11, 12)
    memory.force(memory.view("OUT%"), -1)
    memory.force(memory.view("BASIC%"), -2)
    task.scan(1)
    assert (memory.read_now(1), memory.read_now(2)) == (-1, -2)
    memory.release(memory.view("OUT%"))
    task.scan(2)
    assert (memory.read_now(1), memory.read_now(2)) == (11, -2)


def test_clear_keeps_what_is_non_volatile_or_forced(memory):
    for view, element in ((SPEED, 0), (COUNT, 0), (TABLE, 0), (TABLE, 1), (KEPT, 1)):
        memory.write_now(view, 5, WRITER, element)
    memory.force(TABLE, 6, element=1)
    memory.drain()
    memory.clear()
    assert [memory.read_now(view) for view in (SPEED, COUNT)] == [0, 5]
    assert [memory.read_now(TABLE, element) for element in range(3)] == [0, 6, 0]
    assert memory.read_now(KEPT, 1) == 5
    assert [(entry.view, entry.element, entry.value) for entry in memory.drain()] == [(SPEED, 0, 0), (TABLE, 0, 0)]
    memory.clear(keep_non_volatile=False)
    assert [memory.read_now(COUNT), memory.read_now(KEPT, 1), memory.read_now(TABLE, 1)] == [0, 0, 6]


def test_an_image_is_taken_over_without_log(memory):
    memory.write_now(SPEED, 5, WRITER)
    memory.write_now(TABLE, 6, WRITER, 2)
    twin = CommonMemory(VIEWS)
    twin.keep_log()
    twin.load_image(memory.image())
    assert (twin.image(), twin.drain(), twin.sequence) == (memory.image(), [], 0)


Operation = tuple[str, int, int, int]
operations = st.tuples(
    st.sampled_from(["commit", "basic", "outside", "force", "release", "drain", "clear"]),
    st.sampled_from([SPEED, COUNT, TABLE, KEPT]),
    st.integers(0, 2),
    st.integers(-3, 3),
)


@given(st.lists(operations, max_size=40))
@repeatable(200)
def test_memory_against_a_plain_model(work):
    """What is forced stays; every entry has the next number; the log applied to a fresh image gives the memory."""
    memory = CommonMemory(VIEWS)
    memory.keep_log()
    cells = {(view, element): value for view, element, value in memory.image()}
    forced: set[tuple[int, int]] = set()
    entries = []
    for kind, view, number, value in work:
        element = number % VIEWS[view].elements
        place = (view, element)
        if kind == "force":
            memory.force(view, value, element)
            forced.add(place)
            cells[place] = value
        elif kind == "release":
            memory.release(view, element)
            forced.discard(place)
        elif kind == "drain":
            entries += memory.drain()
        elif kind == "clear":
            memory.clear(OTHER)
            for cell in cells:
                if cell not in forced and not VIEWS[cell[0]].non_volatile:
                    cells[cell] = VIEWS[cell[0]].type.zero
        else:
            if kind == "commit" and not VIEWS[view].is_array:
                memory.commit([(view, value)], WRITER)
            elif kind == "basic":
                memory.write_now(view, value, WRITER, element)
            else:
                memory.write_from_outside(view, value, OTHER, element)
            if place not in forced:
                cells[place] = value
        assert {(view, element): value for view, element, value in memory.image()} == cells
        assert memory.forced == forced
    entries += memory.drain()
    assert [entry.sequence for entry in entries] == list(range(1, memory.sequence + 1))
    twin = CommonMemory(VIEWS)
    twin.load_image((entry.view, entry.element, entry.value) for entry in entries)
    assert twin.image() == memory.image()


def test_forcing_status_tells_that_something_is_forced():
    memory = CommonMemory([ViewSpec("REF%", DataType.INTEGER), ViewSpec("FORCINGSTATUS@", DataType.BOOLEAN)])
    memory.force(0, 5)
    assert memory.read_now(1) is True
    memory.release(0)
    assert memory.read_now(1) is False
