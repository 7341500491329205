import operator

import pytest
from compile.support import OTHER, run_scans, scan_in_steps, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from automax_ros.runtime.tasks.task import Task
from blocks.support import int16, repeatable, run

COMPARISONS = {"compare_gtr": operator.gt, "compare_equ": operator.eq, "compare_les": operator.lt}
NOT_FOUND = {"found": False, "output": -1}


def search(value, table, *options, **inputs):
    return run("SEARCH", **dict.fromkeys(options, True)).scan(input=value, table1=table, **inputs)


def found(index):
    return {"found": True, "output": index}


FALLING = [40, 30, 20, 10]


@pytest.mark.parametrize(
    ("options", "value", "table", "expected"),
    [
        # The examples of section 29; the printed INPUT of 1501 can only mean 150 (decision).
        (("compare_gtr",), 15, FALLING, found(3)),
        (("compare_les",), 150, [100, 200, 300, 400], found(1)),
        # INPUT against the element, in this order; two comparisons are joined by OR.
        (("compare_equ",), 20, FALLING, found(2)),
        (("compare_equ",), 25, FALLING, NOT_FOUND),
        (("compare_gtr",), 20, FALLING, found(3)),
        (("compare_gtr",), 10, FALLING, NOT_FOUND),
        (("compare_gtr",), 41, FALLING, found(0)),
        (("compare_les",), 39, FALLING, found(0)),
        (("compare_les",), 40, FALLING, NOT_FOUND),
        (("compare_gtr", "compare_equ"), 20, FALLING, found(2)),
        (("compare_gtr", "compare_equ"), 21, FALLING, found(2)),
        (("compare_gtr", "compare_equ"), 9, FALLING, NOT_FOUND),
        (("compare_les", "compare_equ"), 40, FALLING, found(0)),
        (("compare_les", "compare_equ"), 41, FALLING, NOT_FOUND),
        (("compare_gtr", "compare_les"), 40, FALLING, found(1)),
        (("compare_gtr", "compare_les"), 20, FALLING, found(0)),
        # The first match ends the search.
        (("compare_equ",), 5, [1, 5, 5, 5], found(1)),
        (("compare_gtr",), 5, [9, 1, 2, 3], found(1)),
        # Element 0 and the last one are searched.
        (("compare_equ",), 7, [7, 0, 0], found(0)),
        (("compare_equ",), 7, [0, 0, 7], found(2)),
        (("compare_equ",), 7, [7], found(0)),
        (("compare_equ",), 7, [8], NOT_FOUND),
        # The ends of the range, where a difference of 16 bits would wrap.
        (("compare_gtr",), 32767, [32767, -32768], found(1)),
        (("compare_les",), -32768, [-32768, 32767], found(1)),
        (("compare_gtr",), -32768, [32767, -32768], NOT_FOUND),
        (("compare_les",), 32767, [32767, -32768], NOT_FOUND),
    ],
)
def test_what_is_found(options, value, table, expected):
    assert search(value, table, *options) == expected


def test_a_search_that_finds_nothing_clears_the_outputs():
    block = run("SEARCH", compare_equ=True)
    assert block.scan(input=2, table1=[1, 2]) == found(1)
    assert block.scan(input=3, table1=[1, 2]) == NOT_FOUND


def test_select_takes_table_2():
    block = run("SEARCH", compare_equ=True)
    tables = {"table1": [1, 2, 3], "table2": [3, 2, 1]}
    assert block.scan(input=3, **tables) == found(2)
    assert block.scan(input=3, select=True, **tables) == found(0)
    assert block.scan(input=3, select=False, **tables) == found(2)


def test_input_must_be_a_variable_and_the_options_literals():
    with pytest.raises(InstanceError, match="SEARCH: INPUT must be a variable"):
        run("SEARCH", input=5)
    with pytest.raises(InstanceError, match="SEARCH: COMPARE_EQU must be a literal"):
        run("SEARCH").scan(input=5, compare_equ=True, table1=[1])


@repeatable
@given(
    st.sets(st.sampled_from(sorted(COMPARISONS)), min_size=1, max_size=2),
    int16 | st.integers(-4, 4),
    st.lists(int16 | st.integers(-4, 4), min_size=1, max_size=20),
    st.booleans(),
)
def test_against_the_operators(options, value, table, select):
    """In either table; the other one would give another result."""
    matches = [n for n, element in enumerate(table) if any(COMPARISONS[option](value, element) for option in options)]
    other = [value] * len(table) if not matches else [(element ^ 0x55) for element in table]
    first, second = (other, table) if select else (table, other)
    result = search(value, first, *options, table2=second, select=select)
    assert result == (found(matches[0]) if matches else NOT_FOUND)


@pytest.mark.parametrize(
    ("options", "value", "output"),
    [
        (("compare_equ",), 20, 2),
        (("compare_gtr",), 20, 3),
        (("compare_les",), 39, 0),
        (("compare_gtr", "compare_equ"), 20, 2),
        (("compare_les", "compare_equ"), 40, 0),
        (("compare_gtr", "compare_les"), 40, 1),
    ],
)
def test_table_2_is_searched_in_the_same_way(options, value, output):
    tables = {"table1": [0, 0, 0, 0], "table2": [40, 30, 20, 10]}
    assert run("SEARCH", **dict.fromkeys(options, True)).scan(input=value, select=True, **tables) == found(output)


@pytest.fixture(params=["at once", "in steps"])
def scan(request):
    """Both forms of a scan."""
    return Task.scan if request.param == "at once" else scan_in_steps


def test_a_local_table(scan):
    text = """10 LOCAL T%(3), IN%, OUT%, FOUND@
20 T%(0) = 100 \\ T%(1) = 200 \\ T%(2) = 300 \\ T%(3) = 400
30 CALL SCAN_LOOP(TICKS=4)
40 IN% = IN% + 150
50 CALL SEARCH(COMPARE_LES=TRUE, INPUT=IN%, TABLE1=T%, FOUND=FOUND@, OUTPUT=OUT%)
60 END
"""
    task, _ = task_of(text)
    task.run()
    seen = []
    for number in (1, 2, 3):
        scan(task, number)
        seen.append((task.value("OUT%"), task.value("FOUND@")))
    assert seen == [(1, True), (3, True), (-1, False)]


def test_a_common_table_is_read_in_the_present_state_of_memory(scan):
    """Arrays are never latched (3.3): a BASIC statement of the same scan and another writer are seen at once."""
    text = """10 COMMON T%(3), REF%
20 LOCAL OUT1%, OUT2%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SEARCH(COMPARE_EQU=TRUE, INPUT=REF%, TABLE1=T%, OUTPUT=OUT1%)
50 T%(1) = 7
60 CALL SEARCH(COMPARE_EQU=TRUE, INPUT=REF%, TABLE1=T%, OUTPUT=OUT2%)
70 T%(1) = 0
80 END
"""
    task, memory = task_of(text, **{"REF%": 7})
    task.run()
    seen = []
    for number, element in ((1, 3), (2, 0)):
        memory.write_from_outside(memory.view("T%"), 7, OTHER, element)
        scan(task, number)
        seen.append((task.value("OUT1%"), task.value("OUT2%")))
    assert seen == [(3, 1), (0, 0)]


@pytest.mark.parametrize(("value", "reads"), [(20, [10, 20]), (99, [10, 20, 30, 40])])
def test_a_record_of_the_scan_has_what_was_read_up_to_the_match(value, reads):
    """A replay never guesses: common memory read past the latch is part of the record."""
    text = """10 COMMON T%(3), REF%
20 LOCAL OUT%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SEARCH(COMPARE_EQU=TRUE, INPUT=REF%, TABLE1=T%, OUTPUT=OUT%)
50 END
"""
    task, memory = task_of(text, **{"REF%": value})
    table = memory.view("T%")
    for element in range(4):
        memory.write_from_outside(table, 10 * element + 10, OTHER, element)
    task.record_scans()
    task.run()
    assert task.scan(0).reads == [(table, element, read) for element, read in enumerate(reads)]


def test_two_tables_of_different_scope():
    text = """10 COMMON SE@, SECOND%(2)
20 LOCAL FIRST%(2), IN%, OUT%
30 FIRST%(1) = 5 \\ SECOND%(2) = 5 \\ IN% = 5
40 CALL SCAN_LOOP(TICKS=4)
50 CALL SEARCH(TABLE2=SECOND%, SELECT=SE@, TABLE1=FIRST%, COMPARE_EQU=ON, COMPARE_GTR=OFF, INPUT=IN%, OUTPUT=OUT%)
60 END
"""
    for state, output in ((False, 1), (True, 2)):
        task, _ = task_of(text, **{"SE@": state})
        run_scans(task, 1)
        assert task.value("OUT%") == output
