import struct

import pytest
from compile.support import OTHER, ran, run_scans, task_of
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import repeatable, run


def packed(*numbers):
    """OUTPUT with these inputs TRUE."""
    return run("PACK_BITS").scan(**{f"input{number}": True for number in numbers})["output"]


@pytest.mark.parametrize("number", range(15))
def test_the_weight_of_each_bit(number):
    assert packed(number) == 2**number


def test_bit_15_is_the_sign():
    assert packed(15) == -32768
    assert packed(*range(16)) == -1
    assert packed(*range(15)) == 32767


def test_inputs_that_are_not_programmed_are_false():
    assert packed() == 0
    assert run("PACK_BITS").scan(input3=True, input1=False) == {"output": 8}


def test_nothing_stays_from_the_scan_before():
    block = run("PACK_BITS")
    assert [block.scan(input4=state)["output"] for state in (True, False, True)] == [16, 0, 16]


@repeatable
@given(st.lists(st.booleans(), min_size=16, max_size=16))
def test_against_struct(states):
    """The bits as the digits of a 16-bit two's complement word, bit 15 first."""
    digits = "".join(str(int(state)) for state in reversed(states))
    (word,) = struct.unpack(">h", int(digits, 2).to_bytes(2, "big"))
    assert run("PACK_BITS").scan(**{f"input{n}": state for n, state in enumerate(states)}) == {"output": word}


def test_any_order_inverted_and_constant_inputs():
    task = ran("X@ = TRUE", "CALL PACK_BITS(INPUT15=-Y@, INPUT2=X@, OUTPUT=A%, INPUT0=-X@, INPUT5=TRUE, INPUT6=OFF)")
    assert task.value("A%") == -32768 + 4 + 32


def test_bits_of_common_memory_as_they_were_latched():
    text = "10 COMMON A@, B@(3), WORD%\n20 CALL SCAN_LOOP(TICKS=4)\n30 A@ = FALSE \\ B@(2) = TRUE\n"
    text += "40 CALL PACK_BITS(INPUT0=A@, INPUT1=B@(2), OUTPUT=WORD%)\n50 END\n"
    task, memory = task_of(text, **{"A@": True})
    run_scans(task, 1)
    assert memory.read_now(memory.view("WORD%")) == 3
    memory.write_from_outside(memory.view("A@"), False, OTHER)
    run_scans(task, 1, first=2)
    assert memory.read_now(memory.view("WORD%")) == 2
