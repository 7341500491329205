"""Blocks work on the latch, BASIC on actual memory (3.3)."""

import pytest
from compile.support import OTHER, WRITER, compiled_of, repeatable, scan_in_steps, task_of, views_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.task import Task


class Restless(CommonMemory):
    """Another task adds 1000 to REF% in the middle of the scan: whenever MARK is read."""

    def read_now(self, view, element=0):
        if self.specs[view].name == "MARK":
            ref = self.view("REF%")
            self.write_now(ref, super().read_now(ref) + 1000, OTHER)
        return super().read_now(view, element)


SEEN = """10 COMMON REF%, MARK, RUN@, OUT%, T%(5)
20 LOCAL X, BLOCK1%, BLOCK2%, BASIC1%, BASIC2%, ELEMENT%
30 CALL SCAN_LOOP(TICKS=4)
40 BASIC1% = REF%
50 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=BLOCK1%)
60 X = MARK
70 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=BLOCK2%)
80 BASIC2% = REF%
90 END
"""


@pytest.fixture(params=["at once", "in steps"])
def scan(request):
    """Both forms of a scan."""
    return Task.scan if request.param == "at once" else scan_in_steps


def test_blocks_see_the_latch_and_basic_sees_the_present(scan):
    task, _ = task_of(SEEN, Restless, **{"REF%": 7})
    task.run()
    scan(task, 0)
    assert [task.value(name) for name in ("BASIC1%", "BLOCK1%", "BLOCK2%", "BASIC2%")] == [7, 7, 7, 1007]
    scan(task, 1)
    assert [task.value(name) for name in ("BASIC1%", "BLOCK1%", "BLOCK2%", "BASIC2%")] == [1007, 1007, 1007, 2007]


def test_a_basic_write_is_seen_by_a_block_on_the_next_scan(scan):
    text = """10 COMMON REF%
20 LOCAL N%, BLOCK%, BASIC%
30 CALL SCAN_LOOP(TICKS=4)
40 N% = N% + 1
50 REF% = N%
60 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=BLOCK%)
70 BASIC% = REF%
80 END
"""
    task, _ = task_of(text)
    task.run()
    for number in (1, 2, 3):
        scan(task, number)
        assert (task.value("BLOCK%"), task.value("BASIC%")) == (number - 1, number)


WRITES = """10 COMMON REF%, MARK
20 LOCAL X, IN%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=IN%, INPUT2=0, OUTPUT=REF%)
50 X = MARK
60 END
"""


def test_an_unchanged_variable_is_not_written_back_over_another_writer(scan):
    task, memory = task_of(WRITES, Restless)
    memory.keep_log()
    task.run()
    scan(task, 0)
    assert memory.read_now(memory.view("REF%")) == 1000
    assert [(entry.writer, entry.kind) for entry in memory.drain()] == [(OTHER, WriteKind.BASIC)]


def test_a_changed_variable_is_written_back_at_end(scan):
    task, memory = task_of(WRITES, Restless)
    memory.keep_log()
    task.run()
    task.state[task.compiled.layout.index("IN%")] = 5
    scan(task, 0)
    assert memory.read_now(memory.view("REF%")) == 5
    written = [(entry.writer, entry.kind, entry.value) for entry in memory.drain()]
    assert written == [(OTHER, WriteKind.BASIC, 1000), (WRITER, WriteKind.COMMIT, 5)]


def test_a_block_that_changes_a_variable_and_back_writes_nothing():
    text = """10 COMMON REF%
20 CALL SCAN_LOOP(TICKS=4)
30 CALL SUMMER(INPUT1=REF%, INPUT2=5, OUTPUT=REF%)
40 CALL SUMMER(INPUT1=REF%, INPUT2=-5, OUTPUT=REF%)
50 END
"""
    task, memory = task_of(text, **{"REF%": 7})
    before = memory.sequence
    task.run()
    task.scan(0)
    assert memory.sequence == before


def test_a_block_sees_what_a_block_before_it_put_into_the_latch():
    text = """10 COMMON REF%
20 LOCAL A%, B%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=REF%, INPUT2=1, OUTPUT=REF%)
50 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=A%)
60 B% = REF%
70 END
"""
    task, memory = task_of(text, **{"REF%": 7})
    task.run()
    task.scan(0)
    assert (task.value("A%"), task.value("B%"), memory.read_now(0)) == (8, 7, 8)


class Counting(CommonMemory):
    """Knows what was read past the latch."""

    def __init__(self, views):
        super().__init__(views)
        self.names = []

    def read_now(self, view, element=0):
        self.names.append((self.specs[view].name, element))
        return super().read_now(view, element)


def test_reals_arrays_and_strings_are_never_latched_not_even_by_blocks():
    text = """10 COMMON REF%, COUNT!, RUN@, GAIN, T%(3), F@(3), N$
20 LOCAL OUT%, S$
30 CALL SCAN_LOOP(TICKS=4)
40 CALL LAG(INPUT=T%(2), WLG=GAIN, RESET=-F@(1), OUTPUT=OUT%)
50 S$ = N$
60 END
"""
    task, memory = task_of(text, Counting, GAIN=5.0)
    assert task.compiled.latched == ("REF%", "COUNT!", "RUN@")
    task.run()
    task.scan(0)
    assert sorted(memory.names) == [("F@", 1), ("GAIN", 0), ("N$", 0), ("T%", 2)]


def test_a_block_writes_an_array_element_at_once_and_not_at_end():
    text = """10 COMMON T%(3)
20 LOCAL A%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=T%(1), INPUT2=1, OUTPUT=T%(1))
50 A% = T%(1)
60 END
"""
    task, memory = task_of(text)
    memory.keep_log()
    task.run()
    task.scan(0)
    task.scan(1)
    assert task.value("A%") == 2
    assert [(entry.kind, entry.element, entry.value) for entry in memory.drain()] == [
        (WriteKind.BASIC, 1, 1),
        (WriteKind.BASIC, 1, 2),
    ]


def test_a_latched_common_in_a_blocks_subscript_is_the_latch():
    """3.3: a block always sees the value of those variables as stored in the buffer."""
    text = """10 COMMON REF%, MARK
20 LOCAL X, T%(2000), BLOCK%, BASIC%
30 T%(1) = 11 \\ T%(1001) = 1111
40 CALL SCAN_LOOP(TICKS=4)
50 X = MARK
60 CALL SUMMER(INPUT1=T%(REF%), INPUT2=0, OUTPUT=BLOCK%)
70 BASIC% = T%(REF%)
80 END
"""
    task, _ = task_of(text, Restless, **{"REF%": 1})
    task.run()
    task.scan(0)
    assert (task.value("BLOCK%"), task.value("BASIC%")) == (11, 1111)


def test_a_held_output_is_written_when_the_block_updates_and_not_otherwise():
    """A LATCH updates while SET or RESET is TRUE, equal values included (decision); END writes only what differs."""
    text = """10 COMMON SET@, FLAG@(2), LIT@
20 CALL SCAN_LOOP(TICKS=4)
30 CALL LATCH(SET=SET@, RESET=FALSE, OUTPUT=FLAG@(1))
40 CALL LATCH(SET=SET@, RESET=FALSE, OUTPUT=LIT@)
50 END
"""
    task, memory = task_of(text)
    memory.keep_log()
    task.run()
    task.scan(0)
    assert memory.drain() == []
    memory.write_from_outside(memory.view("SET@"), True, OTHER)
    memory.drain()
    for now in (1, 2, 3):
        task.scan(now)
    written = [(entry.view, entry.element, entry.value) for entry in memory.drain()]
    assert written == [(1, 1, True), (2, 0, True), (1, 1, True), (1, 1, True)]
    memory.write_from_outside(memory.view("LIT@"), False, OTHER)
    memory.write_from_outside(memory.view("SET@"), False, OTHER)
    task.scan(4)
    assert memory.read_now(memory.view("LIT@")) is False, "the latch has no copy of its own (15)"


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(-3, 3)), max_size=8), st.lists(st.integers(-3, 3), max_size=6))
@repeatable(60)
def test_commit_writes_exactly_what_differs_from_the_latch(outside, additions):
    """Three latched commons; random blocks add to them; another writer writes them beforehand."""
    statements = [
        f"{40 + 10 * index} CALL SUMMER(INPUT1=V{index % 3}%, INPUT2={value}, OUTPUT=V{(index + value) % 3}%)"
        for index, value in enumerate(additions)
    ]
    text = "\n".join(["10 COMMON V0%, V1%, V2%", "20 CALL SCAN_LOOP(TICKS=4)", *statements, "999 END"])
    compiled = compiled_of(text)
    memory = CommonMemory(views_of(compiled.program))
    task = Task(compiled, memory, writer=WRITER)
    for view, value in outside:
        memory.write_from_outside(view, value, OTHER)
    values = [memory.read_now(view) for view in range(3)]
    expected = list(values)
    for index, value in enumerate(additions):
        expected[(index + value) % 3] = expected[index % 3] + value
    memory.keep_log()
    task.run()
    task.scan(0)
    assert [memory.read_now(view) for view in range(3)] == expected
    assert [entry.view for entry in memory.drain()] == [view for view in range(3) if expected[view] != values[view]]
