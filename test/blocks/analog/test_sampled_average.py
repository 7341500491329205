import statistics
from fractions import Fraction
from math import trunc

import pytest
from compile.support import lines, run_scans, scan_in_steps, task_of
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from automax_ros.runtime.tasks.task import Task
from blocks.support import int16, repeatable, run

CLEARED = {"data_valid": False, "max_value": -32768, "min_value": 32767, "output": 0}


def shown(output, highest, lowest, *, valid):
    return {"data_valid": valid, "max_value": highest, "min_value": lowest, "output": output}


def test_updates_once_every_required_samples_scans():
    """The first update comes on scan RS; between updates OUTPUT, MAX_VALUE and MIN_VALUE keep their values."""
    block = run("SAMPLED_AVERAGE", required_samples=3)
    found = [block.scan(input=value) for value in (10, 20, 60, 7, 8, 9, -1)]
    assert found == [
        CLEARED,
        CLEARED,
        shown(30, 60, 10, valid=True),
        shown(30, 60, 10, valid=False),
        shown(30, 60, 10, valid=False),
        shown(8, 9, 7, valid=True),
        shown(8, 9, 7, valid=False),
    ]


@pytest.mark.parametrize(("samples", "output"), [([1, 2], 1), ([-1, -2], -1), ([1, -2], 0), ([-1, 2], 0)])
def test_the_quotient_truncates_toward_zero(samples, output):
    block = run("SAMPLED_AVERAGE", required_samples=2)
    assert [block.scan(input=value)["output"] for value in samples] == [0, output]


def test_one_sample_updates_every_scan():
    block = run("SAMPLED_AVERAGE", required_samples=1)
    for value in (5, -32768, 32767):
        assert block.scan(input=value) == shown(value, value, value, valid=True)


@pytest.mark.parametrize("samples", [0, -1, -32768])
def test_a_variable_of_zero_or_less_counts_as_one(samples):
    block = run("SAMPLED_AVERAGE")
    for value in (3, 4):
        assert block.scan(input=value, required_samples=samples) == shown(value, value, value, valid=True)


def test_reset_drops_the_samples_of_the_window():
    """The window that it ends holds a greater and a smaller sample than the next one."""
    block = run("SAMPLED_AVERAGE", required_samples=3)
    for value in (100, 200, 300, 900, -900):
        block.scan(input=value)
    assert block.scan(input=1000, reset=True) == CLEARED
    assert block.scan(input=1000, reset=True) == CLEARED
    assert [block.scan(input=value) for value in (4, 6)] == [CLEARED, CLEARED]
    assert block.scan(input=5) == shown(5, 6, 4, valid=True)


def test_reset_on_the_scan_of_an_update_wins():
    block = run("SAMPLED_AVERAGE", required_samples=2)
    block.scan(input=100)
    assert block.scan(input=100, reset=True) == CLEARED
    assert block.scan(input=10) == CLEARED
    assert block.scan(input=20) == shown(15, 20, 10, valid=True)


def test_the_longest_window():
    """32767 samples of -32768: the sum stays within 32 bit."""
    block = run("SAMPLED_AVERAGE", required_samples=32767)
    results = [block.scan(input=-32768) for _ in range(32767)]
    assert results[-2] == CLEARED
    assert results[-1] == shown(-32768, -32768, -32768, valid=True)


def test_a_number_that_grows_inside_a_window_lengthens_it():
    block = run("SAMPLED_AVERAGE")
    wanted = [2, 4, 4, 4, 4]
    found = [block.scan(input=value, required_samples=n) for value, n in zip((1, 2, 3, 10, 0), wanted, strict=True)]
    assert [result["data_valid"] for result in found] == [False, False, False, True, False]
    assert found[3] == shown(4, 10, 1, valid=True)


def test_a_number_that_falls_below_the_samples_taken_ends_the_window():
    """It is compared with the samples taken so far (decision); the average stays an average of what was read."""
    block = run("SAMPLED_AVERAGE")
    for _ in range(5):
        assert block.scan(input=10, required_samples=10) == CLEARED
    assert block.scan(input=10, required_samples=3) == shown(10, 10, 10, valid=True)
    assert [block.scan(input=7, required_samples=3)["data_valid"] for _ in range(3)] == [False, False, True]


@pytest.mark.parametrize("samples", [32768, 40000])
def test_required_samples_out_of_range(samples):
    with pytest.raises(InstanceError, match="REQUIRED_SAMPLES"):
        run("SAMPLED_AVERAGE", required_samples=samples)


def test_input_must_be_a_variable():
    with pytest.raises(InstanceError, match="SAMPLED_AVERAGE: INPUT must be a variable"):
        run("SAMPLED_AVERAGE", required_samples=2, input=5)


@repeatable
@given(st.integers(1, 9), st.lists(st.tuples(st.sampled_from([False] * 9 + [True]), int16), max_size=50))
def test_against_a_list_of_samples(required, rows):
    block = run("SAMPLED_AVERAGE", required_samples=required)
    samples, expected = [], dict(CLEARED)
    for reset, value in rows:
        expected["data_valid"] = False
        if reset:
            samples, expected = [], dict(CLEARED)
        else:
            samples.append(value)
        if len(samples) == required:
            average = trunc(statistics.mean(map(Fraction, samples)))
            expected = shown(average, max(samples), min(samples), valid=True)
            samples = []
        assert block.scan(input=value, reset=reset) == expected


@repeatable
@given(st.lists(st.tuples(st.integers(-1, 6), int16), min_size=1, max_size=50))
def test_an_average_lies_between_minimum_and_maximum_whatever_the_number_does(rows):
    """Truncation toward zero leaves no range of whole numbers."""
    block = run("SAMPLED_AVERAGE")
    since = 0
    for required, value in rows:
        result = block.scan(input=value, required_samples=required)
        since += 1
        assert result["data_valid"] is (since >= max(required, 1))
        if result["data_valid"]:
            since = 0
            assert result["min_value"] <= result["output"] <= result["max_value"]


@pytest.mark.parametrize("scan", [Task.scan, scan_in_steps])
def test_a_variable_number_in_a_task(scan):
    text = lines(
        "A% = A% + 2",
        "CALL SAMPLED_AVERAGE(REQUIRED_SAMPLES=T%(1), INPUT=A%, RESET=X@, OUTPUT=B%, DATA_VALID=Y@)",
        "IF Y@ THEN C% = C% + 1",
        "T%(1) = 3",
    )
    task, _ = task_of(text)
    task.run()
    found = []
    for number in range(1, 8):
        scan(task, number)
        found.append((task.value("B%"), task.value("C%")))
    # The first scan has 0 samples to average, which is 1; then 4, 6, 8 and 10, 12, 14.
    assert found == [(2, 1), (2, 1), (2, 1), (6, 2), (6, 2), (6, 2), (12, 3)]


def test_maximum_and_minimum_in_a_task_before_the_first_update():
    text = lines("CALL SAMPLED_AVERAGE(REQUIRED_SAMPLES=3, INPUT=A%, OUTPUT=B%, MAX_VALUE=C%, MIN_VALUE=T%(2))")
    task, _ = task_of(text)
    run_scans(task, 2)
    assert (task.value("C%"), task.value("T%")[2]) == (-32768, 32767)
    run_scans(task, 1, first=3)
    assert (task.value("C%"), task.value("T%")[2]) == (0, 0)
