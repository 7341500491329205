import pytest
from compile.support import OTHER, logged, ran, run_scans, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import int16, repeatable, run

LARGEST, SMALLEST = 2**31 - 1, -(2**31)
int32 = st.integers(SMALLEST, LARGEST) | st.sampled_from([SMALLEST, SMALLEST + 1, -1, 0, 1, LARGEST - 1, LARGEST])


def test_counts_up_and_down_from_zero():
    block = run("COUNTER")
    moves = [(5, 0), (3, 1), (0, 10), (-4, 0), (0, -4)]
    outputs = [block.scan(input_plus=plus, input_minus=minus)["output"] for plus, minus in moves]
    assert outputs == [5, 7, -3, -7, -3]


def test_all_inputs_have_defaults():
    block = run("COUNTER")
    assert [block.scan()["output"] for _ in range(3)] == [0, 0, 0]
    assert [run("COUNTER", input_plus=2).scan()["output"], run("COUNTER", input_minus=2).scan()["output"]] == [2, -2]


def test_constants_count_each_scan():
    block = run("COUNTER", input_plus=3, input_minus=1)
    assert [block.scan()["output"] for _ in range(4)] == [2, 4, 6, 8]


def test_the_output_is_limited_but_the_count_goes_on():
    """40 000 counts show as 32767, unlogged; 10 000 back show as 30 000."""
    block = run("COUNTER")
    assert [block.scan(input_plus=20000)["output"] for _ in range(2)] == [20000, 32767]
    assert block.error == 0
    assert block.scan(input_minus=10000) == {"output": 30000}
    assert [block.scan(input_minus=32767)["output"] for _ in range(2)] == [-2767, -32768]
    assert block.error == 0
    assert block.scan(input_plus=32767)["output"] == -2767


def test_reset_presets_with_32_bits():
    block = run("COUNTER")
    assert block.scan(reset=True, preset=100000) == {"output": 32767}
    assert [block.scan(preset=100000, input_minus=32767)["output"] for _ in range(4)] == [32767, 32767, 1699, -31068]


def test_the_inputs_do_not_count_while_reset():
    block = run("COUNTER")
    block.scan(input_plus=77)
    assert block.scan(reset=True, preset=-5, input_plus=100, input_minus=7) == {"output": -5}
    assert block.scan(reset=True, preset=-5, input_plus=100, input_minus=7) == {"output": -5}
    assert block.scan(preset=-5, input_plus=1) == {"output": -4}


def test_preset_defaults_to_0_and_acts_only_while_reset():
    block = run("COUNTER")
    assert block.scan(input_plus=9, preset=500) == {"output": 9}
    assert block.scan(input_plus=9, reset=True) == {"output": 0}


def test_reset_follows_a_preset_that_changes():
    block = run("COUNTER")
    assert [block.scan(reset=True, preset=value)["output"] for value in (1, 2, -3)] == [1, 2, -3]


@pytest.mark.parametrize(
    ("preset", "plus", "minus", "after_one_back"), [(LARGEST, 1, 0, LARGEST - 1), (SMALLEST, 0, 1, SMALLEST + 1)]
)
def test_the_count_stops_at_32_bits_and_logs(preset, plus, minus, after_one_back):
    block = run("COUNTER")
    clamp = 32767 if preset > 0 else -32768
    block.scan(reset=True, preset=preset)
    assert block.error == 0
    for _ in range(2):
        assert block.scan(input_plus=plus, input_minus=minus) == {"output": clamp}
        assert block.error == 7002
    assert block.scan(input_plus=minus, input_minus=plus) == {"output": clamp}
    assert block.error == 0
    assert block.state["count"] == after_one_back


def test_plus_less_minus_is_added_in_one_step():
    """At the top 5 in and 5 out do not move it, hence no overflow."""
    block = run("COUNTER")
    block.scan(reset=True, preset=LARGEST)
    block.scan(input_plus=5, input_minus=5)
    assert (block.state["count"], block.error) == (LARGEST, 0)


def test_preset_must_be_a_variable():
    with pytest.raises(InstanceError, match="COUNTER: PRESET must be a variable"):
        run("COUNTER", preset=5)


@repeatable
@given(int32, st.lists(st.tuples(st.booleans(), int16, int16), max_size=40))
def test_against_whole_numbers(preset, rows):
    block = run("COUNTER")
    block.scan(reset=True, preset=preset)
    count = preset
    for reset, plus, minus in rows:
        exact = preset if reset else count + plus - minus
        count = min(max(exact, SMALLEST), LARGEST)
        output = block.scan(reset=reset, preset=preset, input_plus=plus, input_minus=minus)["output"]
        assert output == min(max(count, -32768), 32767)
        assert block.error == (0 if count == exact else 7002)


@pytest.mark.parametrize(
    ("preset", "value", "outputs"),
    [
        ("D!", 70000, [32767, 32767, 10000]),
        ("A%", -70, [-70, -30070, -32768]),
        ("T!(2)", 40000, [32767, 10000, -20000]),
    ],
)
def test_preset_of_either_type_in_a_task(preset, value, outputs):
    text = f"""10 LOCAL A%, D!, T!(3), OUT%
20 COMMON RESET@
30 {preset} = {value}
40 CALL SCAN_LOOP(TICKS=4)
50 CALL COUNTER(RESET=RESET@, PRESET={preset}, INPUT_MINUS=30000, OUTPUT=OUT%)
60 END
"""
    task, memory = task_of(text, **{"RESET@": True})
    run_scans(task, 1)
    memory.write_from_outside(0, False, OTHER)
    found = [task.value("OUT%")]
    for number in (2, 3):
        run_scans(task, 1, first=number)
        found.append(task.value("OUT%"))
    assert found == outputs


def test_a_task_put_into_run_again_counts_from_zero():
    task = ran("CALL COUNTER(INPUT_PLUS=3, OUTPUT=A%)", scans=4)
    assert task.value("A%") == 12
    run_scans(task, 2)
    assert task.value("A%") == 6


def test_saturation_is_logged_in_a_task():
    task = ran("D! = 2147483647", "CALL COUNTER(RESET=X@, PRESET=D!, INPUT_PLUS=1, OUTPUT=A%)", "X@ = C% = 0", "C% = 1")
    assert logged(task) == []
    run_scans(task, 2, first=2)
    assert (task.value("A%"), logged(task)) == (32767, [(40, 7002)])
