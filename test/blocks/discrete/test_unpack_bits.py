import struct

import pytest
from compile.support import lines, run_scans, task_of
from hypothesis import given

from blocks.support import int16, repeatable, run


def true_outputs(value):
    """The numbers of the outputs that are TRUE."""
    result = run("UNPACK_BITS").scan(input=value)
    return [number for number in range(16) if result[f"output{number}"]]


@pytest.mark.parametrize(
    ("value", "numbers"),
    [
        (0, []),
        (1, [0]),
        (0x4000, [14]),
        (-32768, [15]),
        (-1, list(range(16))),
        (32767, list(range(15))),
        (-2, list(range(1, 16))),
        (0x1234, [2, 4, 5, 9, 12]),
    ],
)
def test_the_bits_of_a_word(value, numbers):
    assert true_outputs(value) == numbers


@repeatable
@given(int16)
def test_against_struct(value):
    """The bits as the digits of a 16-bit two's complement word, bit 15 first."""
    digits = f"{int.from_bytes(struct.pack('>h', value), 'big'):016b}"
    result = run("UNPACK_BITS").scan(input=value)
    assert result == {f"output{15 - place}": digit == "1" for place, digit in enumerate(digits)}


@repeatable
@given(int16)
def test_packing_what_was_unpacked_gives_the_word_back(value):
    bits = run("UNPACK_BITS").scan(input=value)
    again = run("PACK_BITS").scan(**{name.replace("output", "input"): state for name, state in bits.items()})
    assert again == {"output": value}


def test_outputs_may_be_left_out_and_come_in_any_order():
    text = lines("C% = C% - 3", "CALL UNPACK_BITS(INPUT=C%, OUTPUT15=X@, OUTPUT0=Y@)")
    task, _ = task_of(text)
    seen = []
    for number in (1, 2):
        run_scans(task, 1, first=number)
        seen.append((task.value("X@"), task.value("Y@")))
    assert seen == [(True, True), (True, False)]


def test_a_constant_input():
    text = lines("CALL UNPACK_BITS(INPUT=-32767, OUTPUT15=X@, OUTPUT0=Y@)")
    task, _ = task_of(text)
    run_scans(task, 1)
    assert (task.value("X@"), task.value("Y@")) == (True, True)
