import itertools

import pytest
from compile.support import logged, ran
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run


def select(pairs):
    """Output and error of one scan with these (INPUT, SELECT) pairs from channel 1 on."""
    inputs = {}
    for channel, (value, chosen) in enumerate(pairs, 1):
        inputs[f"input{channel}"], inputs[f"select{channel}"] = value, chosen
    block = run("SELECT")
    return block.scan(**inputs)["output"], block.error


@pytest.mark.parametrize("chosen", list(itertools.product((False, True), repeat=4)))
def test_the_sum_of_the_selected_inputs(chosen):
    """Inputs whose sums are all different."""
    values = (1000, -200, 30, -4)
    expected = sum(value for value, state in zip(values, chosen, strict=True) if state)
    assert select(zip(values, chosen, strict=True)) == (expected, 0)


@pytest.mark.parametrize("count", range(1, 9))
def test_nothing_selected_gives_0(count):
    assert select([(1234, False)] * count) == (0, 0)


@pytest.mark.parametrize("count", range(1, 9))
def test_as_many_channels_as_are_programmed(count):
    assert select([(n, True) for n in range(1, count + 1)]) == (sum(range(1, count + 1)), 0)


@pytest.mark.parametrize(
    ("pairs", "output", "error"),
    [
        ([(32767, True), (1, True)], 32767, 7001),
        ([(-32768, True), (-1, True)], -32768, 7001),
        ([(32767, True)] * 8, 32767, 7001),
        ([(-32768, True)] * 8, -32768, 7001),
        ([(32767, True), (1, False)], 32767, 0),
        # Intermediate sums have 32 bits.
        ([(32767, True), (32767, True), (-32768, True), (1, True)], 32767, 0),
        ([(-32768, True), (-32768, True), (32767, True), (1, True)], -32768, 0),
    ],
)
def test_a_final_sum_beyond_16_bit_is_clamped_and_logged(pairs, output, error):
    assert select(pairs) == (output, error)


@repeatable
@given(st.lists(st.tuples(int16, st.booleans()), min_size=1, max_size=8))
def test_against_whole_numbers(pairs):
    exact = sum(value for value, state in pairs if state)
    output = min(max(exact, -32768), 32767)
    assert select(pairs) == (output, 0 if output == exact else 7001)


@pytest.mark.parametrize(
    "channels",
    [
        "INPUT1=A%,SELECT1=X@, INPUT2=B%,SELECT2=Y@, INPUT3=30,SELECT3=-Y@, INPUT4=4,SELECT4=TRUE",
        "INPUT2=B%,SELECT2=Y@, INPUT4=4,SELECT4=TRUE, SELECT3=-Y@,INPUT3=30, INPUT1=A%,SELECT1=X@",
    ],
)
def test_the_order_of_entry_does_not_matter(channels):
    task = ran("A% = 1000 \\ B% = 200 \\ X@ = TRUE", f"CALL SELECT({channels}, OUTPUT=T%(1))")
    assert task.value("T%")[1] == 1034


def test_a_clamp_is_logged_once_per_scan_with_its_line():
    task = ran("A% = 32767", "CALL SELECT(INPUT1=A%, SELECT1=TRUE, INPUT2=A%, SELECT2=TRUE, OUTPUT=B%)", scans=2)
    assert (task.value("B%"), task.errors.count) == (32767, 2)
    assert set(logged(task)) == {(40, 7001)}
