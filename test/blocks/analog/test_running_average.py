from collections import deque
from fractions import Fraction
from math import trunc

import pytest
from compile.support import OTHER, lines, run_scans, scan_in_steps, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from automax_ros.runtime.tasks.task import Task
from blocks.support import int16, repeatable, run

CLEARED = {"data_valid": False, "max_value": -32768, "min_value": 32767, "output": 0}


def outputs(block, values, **inputs):
    return [block.scan(input=value, **inputs)["output"] for value in values]


def test_averages_the_last_scans():
    """Samples not yet taken count as 0 (decision)."""
    block = run("RUNNING_AVERAGE", required_samples=4)
    assert outputs(block, [40, 80, 120, 160, 200, 0, 0, 0, 0]) == [10, 30, 60, 100, 140, 120, 90, 50, 0]


@pytest.mark.parametrize(("samples", "output"), [([1, 2], 1), ([-1, -2], -1), ([1, -2], 0), ([-1, 2], 0)])
def test_the_quotient_truncates_toward_zero(samples, output):
    assert outputs(run("RUNNING_AVERAGE", required_samples=2), samples)[-1] == output


def test_one_sample_follows_the_input():
    block = run("RUNNING_AVERAGE", required_samples=1)
    assert block.scan(input=-32768) == {
        "data_valid": True,
        "max_value": -32768,
        "min_value": -32768,
        "output": -32768,
    }
    assert outputs(block, [5, -7, 32767]) == [5, -7, 32767]


def test_data_is_valid_once_the_required_samples_were_read():
    block = run("RUNNING_AVERAGE", required_samples=3)
    assert [block.scan(input=1)["data_valid"] for _ in range(5)] == [False, False, True, True, True]
    assert block.scan(input=1, reset=True)["data_valid"] is False
    assert [block.scan(input=1)["data_valid"] for _ in range(4)] == [False, False, True, True]


def test_maximum_and_minimum_since_reset_not_of_the_window():
    block = run("RUNNING_AVERAGE", required_samples=2)
    found = []
    for value in (5, -3, 9, 0, 0, 0):
        result = block.scan(input=value)
        found.append((result["max_value"], result["min_value"]))
    assert found == [(5, 5), (5, -3), (9, -3), (9, -3), (9, -3), (9, -3)]
    assert block.scan(input=100, reset=True) == CLEARED
    result = block.scan(input=-1)
    assert (result["max_value"], result["min_value"]) == (-1, -1)


def test_reset_clears_the_samples_and_takes_none():
    block = run("RUNNING_AVERAGE", required_samples=4)
    outputs(block, [1000, 1000, 1000, 1000])
    assert block.scan(input=1000, reset=True) == CLEARED
    assert block.scan(input=1000, reset=True) == CLEARED
    assert outputs(block, [40, 40, 40, 40, 40]) == [10, 20, 30, 40, 40]


def test_reset_in_the_first_scan():
    block = run("RUNNING_AVERAGE", required_samples=2)
    assert block.scan(input=7, reset=True) == CLEARED
    assert outputs(block, [8, 8]) == [4, 8]


@pytest.mark.parametrize("value", [32767, -32768])
def test_the_largest_storage(value):
    """16383 samples of two bytes each; their sum stays within 32 bit."""
    block = run("RUNNING_AVERAGE", required_samples=16383)
    results = [block.scan(input=value) for _ in range(16384)]
    assert results[0]["output"] == trunc(Fraction(value, 16383))
    assert [result["data_valid"] for result in results[-3:]] == [False, True, True]
    assert [result["output"] for result in results[-2:]] == [value, value]
    assert block.scan(input=0)["output"] == trunc(Fraction(value * 16382, 16383))
    assert block.error == 0


@pytest.mark.parametrize("samples", [0, -1, 32768])
def test_required_samples_out_of_range(samples):
    with pytest.raises(InstanceError, match="REQUIRED_SAMPLES must lie between 1 and 32767"):
        run("RUNNING_AVERAGE", required_samples=samples)


def test_required_samples_must_be_a_literal_and_input_a_variable():
    with pytest.raises(InstanceError, match="RUNNING_AVERAGE: REQUIRED_SAMPLES must be a literal"):
        run("RUNNING_AVERAGE", required_samples=2).scan(input=5, required_samples=3)
    with pytest.raises(InstanceError, match="RUNNING_AVERAGE: INPUT must be a variable"):
        run("RUNNING_AVERAGE", required_samples=2, input=5)


@repeatable
@given(st.integers(1, 12), st.lists(st.tuples(st.sampled_from([False] * 9 + [True]), int16), max_size=50))
def test_against_a_deque(required, rows):
    block = run("RUNNING_AVERAGE", required_samples=required)
    window, seen = deque([0] * required, maxlen=required), []
    for reset, value in rows:
        result = block.scan(input=value, reset=reset)
        if reset:
            window, seen = deque([0] * required, maxlen=required), []
            assert result == CLEARED
            continue
        window.append(value)
        seen.append(value)
        assert result == {
            "data_valid": len(seen) >= required,
            "max_value": max(seen),
            "min_value": min(seen),
            "output": trunc(Fraction(sum(window), required)),
        }


@pytest.mark.parametrize("scan", [Task.scan, scan_in_steps])
def test_each_block_of_a_task_has_samples_of_its_own(scan):
    text = lines(
        "A% = A% + 10",
        "CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=2, INPUT=A%, OUTPUT=B%, DATA_VALID=X@)",
        "CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=5, INPUT=A%, OUTPUT=C%, DATA_VALID=Y@)",
    )
    task, _ = task_of(text)
    task.run()
    found = []
    for number in range(1, 6):
        scan(task, number)
        found.append((task.value("B%"), task.value("C%"), task.value("X@"), task.value("Y@")))
    assert found == [
        (5, 2, False, False),
        (15, 6, True, False),
        (25, 12, True, False),
        (35, 20, True, False),
        (45, 30, True, True),
    ]


def test_a_task_put_into_run_again_has_no_samples():
    text = lines(
        "CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=4, INPUT=A%, OUTPUT=B%, MAX_VALUE=C%)",
        declare="COMMON A% \\ LOCAL B%, C%",
    )
    task, memory = task_of(text, **{"A%": 1000})
    run_scans(task, 6)
    assert (task.value("B%"), task.value("C%")) == (1000, 1000)
    memory.write_from_outside(0, 40, OTHER)
    run_scans(task, 2)
    assert (task.value("B%"), task.value("C%")) == (20, 40)


def test_a_snapshot_holds_the_samples():
    """State counts: a task restored from a snapshot goes on as if nothing had happened."""
    text = lines("A% = A% + 100", "CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=3, INPUT=A%, OUTPUT=B%)")
    first, second = task_of(text)[0], task_of(text)[0]
    run_scans(first, 5)
    second.run()
    second.restore(first.snapshot())
    for task in (first, second):
        run_scans(task, 2, first=6)
    assert first.value("B%") == second.value("B%") == 600
