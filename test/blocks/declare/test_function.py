import itertools
from fractions import Fraction
from math import trunc

import pytest
from compile.support import OTHER, run_scans, scan_in_steps, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from automax_ros.runtime.tasks.task import Task
from blocks.support import int16, repeatable, run

RISING = [0, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000]
"""9 = 2**3 + 1 points: 8 segments."""


def function(table, value, max_input=4095, **inputs):
    return run("FUNCTION", max_input=max_input).scan(input=value, table1=table, **inputs)["output"]


@pytest.mark.parametrize(
    ("value", "output"),
    [(0, 0), (512, 1000), (256, 500), (1, 1), (2048, 4000), (3584, 7000), (4094, 7996), (4095, 7998)],
)
def test_points_of_a_straight_line(value, output):
    """512 counts a segment of 1000: 1000 x 1 / 512 = 1.95, 1000 x 510 / 512 = 996.1, 1000 x 511 / 512 = 998.0."""
    assert function(RISING, value) == output


def test_a_table_as_long_as_the_input_is_read_point_by_point():
    """MAX_INPUT 15 and the 17 points of LOCAL T%(16): no two points have an input between them."""
    table = [7, -3, 100, 0, 5, 5, -32768, 32767, 1, 2, 4, 8, 16, 32, 64, 128, 9999]
    assert [function(table, value, 15) for value in range(16)] == table[:16]


def test_the_last_point_is_approached_but_not_reached():
    """INPUT ends one count short of MAX_INPUT + 1."""
    assert function([0, 0, 0, 0, 0, 0, 0, 0, 32767], 4095) == trunc(Fraction(32767 * 511, 512))


def test_the_interpolation_truncates_before_the_point_is_added():
    """Half of the way from 10 down to 9: trunc(-0.5) = 0, so 10; from -10 up to -9 it is -10."""
    assert function([10, 9, 0], 1, max_input=3) == 10
    assert function([-10, -9, 0], 1, max_input=3) == -10
    assert function([10, 7, 0], 1, max_input=3) == 9
    assert function([-10, -7, 0], 1, max_input=3) == -9


def test_the_function_is_folded_into_the_third_quadrant():
    assert [function(RISING, value) for value in (-512, -256, -1, -4095)] == [-1000, -500, -1, -7998]


def test_a_negative_input_negates_whatever_the_table_gives():
    assert function([-300, -100, 0], -1, max_input=3) == 200
    assert function([5, 5, 5], 0, max_input=3) == 5
    assert function([5, 5, 5], -1, max_input=3) == -5


@pytest.mark.parametrize(("value", "same"), [(4096, 4095), (32767, 4095), (-4096, -4095), (-32768, -4095)])
def test_an_input_beyond_max_input_counts_as_max_input(value, same):
    assert function(RISING, value) == function(RISING, same)


def test_minus_32768_counts_as_32767():
    table = [0, 32767]
    assert function(table, -32768, 32767) == function(table, -32767, 32767) == -32766


def test_minus_the_smallest_point_clamps():
    """Section 13 does not say that this is logged."""
    block = run("FUNCTION", max_input=1)
    assert block.scan(input=-1, table1=[0, -32768, 0]) == {"output": 32767}
    assert block.error == 0


def test_the_widest_step_of_a_table():
    """65535 x 32767 is just inside 32 bits."""
    assert function([-32768, 32767], 32767, 32767) == -32768 + 65535 * 32767 // 32768
    assert function([32767, -32768], 32767, 32767) == 32767 - 65535 * 32767 // 32768


def test_select_takes_table_2():
    block = run("FUNCTION", max_input=3)
    tables = {"table1": [1, 2, 3], "table2": [10, 20, 30]}
    assert block.scan(input=2, **tables) == {"output": 2}
    assert [block.scan(input=2, select=state, **tables)["output"] for state in (True, False)] == [20, 2]
    assert [block.scan(input=3, select=state, **tables)["output"] for state in (True, False)] == [25, 2]


def test_input_must_be_a_variable_and_max_input_a_literal():
    with pytest.raises(InstanceError, match="FUNCTION: INPUT must be a variable"):
        run("FUNCTION", input=5)
    with pytest.raises(InstanceError, match="FUNCTION: MAX_INPUT must be a literal"):
        run("FUNCTION").scan(input=5, max_input=15, table1=[1, 2])


@pytest.mark.parametrize("most", [-1, 0, 2, 4, 1000, 32766])
def test_max_input_is_a_power_of_two_less_one(most):
    with pytest.raises(InstanceError, match="MAX_INPUT"):
        run("FUNCTION", max_input=most)


@st.composite
def functions(draw):
    """A MAX_INPUT of 2**n - 1, a table of 2**m + 1 points with m at most n, and inputs."""
    n = draw(st.integers(1, 15))
    m = draw(st.integers(0, min(n, 6)))
    table = draw(st.lists(int16, min_size=2**m + 1, max_size=2**m + 1))
    inputs = st.integers(-(2**n), 2**n) | int16
    return 2**n - 1, table, draw(st.lists(inputs.filter(lambda v: -32768 <= v <= 32767), min_size=1, max_size=20))


@repeatable
@given(functions(), st.booleans())
def test_against_the_manuals_formula(case, select):
    """Subscript and remainder of INPUT x (table_size - 1) / (max_input + 1), then the line between two points."""
    most, table, values = case
    other = [point ^ 0x55 for point in table]
    tables = {"table1": other, "table2": table} if select else {"table1": table, "table2": other}
    block = run("FUNCTION", max_input=most)
    for value in values:
        place = Fraction(min(abs(value), most) * (len(table) - 1), most + 1)
        subscript = trunc(place)
        way = (table[subscript + 1] - table[subscript]) * (place - subscript)
        exact = table[subscript] + trunc(way)
        output = block.scan(input=value, select=select, **tables)["output"]
        assert output == (exact if value >= 0 else min(-exact, 32767))


@repeatable
@given(functions())
def test_a_result_lies_between_two_neighbours_of_the_table(case):
    most, table, values = case
    for value in values:
        output = function(table, abs(value) % (most + 1), most)
        assert any(min(pair) <= output <= max(pair) for pair in itertools.pairwise(table))


@pytest.fixture(params=["at once", "in steps"])
def scan(request):
    """Both forms of a scan."""
    return Task.scan if request.param == "at once" else scan_in_steps


def test_a_local_table(scan):
    text = """10 LOCAL T%(8), I%, IN%, OUT%
20 FOR I% = 0 TO 8
30 T%(I%) = I% * I% * 100
40 NEXT I%
50 CALL SCAN_LOOP(TICKS=4)
60 IN% = IN% - 24
70 CALL FUNCTION(INPUT=IN%, MAX_INPUT=127, TABLE1=T%, OUTPUT=OUT%)
80 END
"""
    task, _ = task_of(text)
    task.run()
    found = []
    for number in range(1, 7):
        scan(task, number)
        found.append(task.value("OUT%"))
    # 16 counts a segment: -24 is half way from 1 to 2, -48 at 3 ... -120 half way from 7 to 8, -144 stops at 127.
    assert found == [-250, -900, -2050, -3600, -5650, -(4900 + 1500 * 15 // 16)]


def test_a_common_table_is_read_in_the_present_state_of_memory(scan):
    """Arrays are never latched (3.3): a BASIC statement of the same scan and another writer are seen at once."""
    text = """10 COMMON CURVE%(4), REF%
20 LOCAL N%, OUT1%, OUT2%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL FUNCTION(INPUT=REF%, MAX_INPUT=3, TABLE1=CURVE%, OUTPUT=OUT1%)
50 N% = N% + 1 \\ CURVE%(2) = N%
60 CALL FUNCTION(INPUT=REF%, MAX_INPUT=3, TABLE1=CURVE%, OUTPUT=OUT2%)
70 END
"""
    task, memory = task_of(text, **{"REF%": 2})
    curve = memory.view("CURVE%")
    task.run()
    found = []
    for number in (1, 2, 3):
        memory.write_from_outside(curve, 500 * number, OTHER, element=2)
        scan(task, number)
        found.append((task.value("OUT1%"), task.value("OUT2%")))
    assert found == [(500, 1), (1000, 2), (1500, 3)]


def test_select_in_a_task_takes_the_table_that_is_written_there():
    text = """10 COMMON SE@, SECOND%(2)
20 LOCAL FIRST%(2), IN%, OUT%
30 FIRST%(1) = 11 \\ SECOND%(1) = 22 \\ IN% = 2
40 CALL SCAN_LOOP(TICKS=4)
50 CALL FUNCTION(TABLE2=SECOND%, TABLE1=FIRST%, SELECT=-SE@, INPUT=IN%, MAX_INPUT=3, OUTPUT=OUT%)
60 END
"""
    for state, output in ((False, 22), (True, 11)):
        task, _ = task_of(text, **{"SE@": state})
        run_scans(task, 1)
        assert task.value("OUT%") == output
