"""Registers of modules: words and bits that show the same registers, the backplane, a module's private image."""

from __future__ import annotations

import pytest
from compile.support import OTHER, WRITER, compiled_of, lines, repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import DataType
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.private_image import LocalMemory, PrivateImage
from automax_ros.runtime.memory.registers import Backplane, Bank
from automax_ros.runtime.memory.views import Place, ViewSpec
from automax_ros.runtime.tasks.task import Task

BANK = 0
SPECS = (
    ViewSpec("SLOT:5%", DataType.INTEGER, elements=4, is_array=True),
    ViewSpec("WORD%", DataType.INTEGER, place=Place(BANK, 1)),
    ViewSpec("LOW@", DataType.BOOLEAN, place=Place(BANK, 1, 0)),
    ViewSpec("HIGH@", DataType.BOOLEAN, place=Place(BANK, 1, 15)),
    ViewSpec("LONG!", DataType.DOUBLE, place=Place(BANK, 2)),
    ViewSpec("LONGBIT@", DataType.BOOLEAN, place=Place(BANK, 3, 4)),
    ViewSpec("PLAIN%", DataType.INTEGER),
)
WORD, LOW, HIGH, LONG, LONGBIT, PLAIN = range(1, 7)


class Bits:
    """The registers said once more: 64 bits, each by itself."""

    def __init__(self):
        self.bits = [0] * 64

    def places(self, view: int, element: int) -> list[int]:
        """The bits that a view shows, lowest first."""
        if view == BANK:
            return [16 * element + bit for bit in range(16)]
        place = SPECS[view].place
        if place.bit is not None:
            return [16 * place.register + place.bit]
        first = 16 * place.register
        if SPECS[view].type is DataType.DOUBLE:
            return [*range(first + 16, first + 32), *range(first, first + 16)]
        return list(range(first, first + 16))

    def write(self, view: int, element: int, value: int) -> None:
        for number, place in enumerate(self.places(view, element)):
            self.bits[place] = int(value) >> number & 1

    def read(self, view: int, element: int) -> int | bool:
        found = [self.bits[place] for place in self.places(view, element)]
        if len(found) == 1:
            return bool(found[0])
        number = sum(bit << position for position, bit in enumerate(found))
        return number - (1 << len(found)) if found[-1] else number


INTEGERS = st.integers(-32768, 32767)
WRITES = st.one_of(
    st.tuples(st.just(BANK), st.integers(0, 3), INTEGERS),
    st.tuples(st.just(WORD), st.just(0), INTEGERS),
    st.tuples(st.sampled_from([LOW, HIGH, LONGBIT]), st.just(0), st.booleans()),
    st.tuples(st.just(LONG), st.just(0), st.integers(-(2**31), 2**31 - 1)),
)


@given(st.lists(WRITES, max_size=12))
@repeatable(200)
def test_words_bits_and_registers_show_the_same_bits(writes):
    memory, model = CommonMemory(SPECS), Bits()
    memory.keep_log()
    follower: dict[tuple[int, int], object] = {(view, element): value for view, element, value in memory.image()}
    for view, element, value in writes:
        memory.write_now(view, value, WRITER, element)
        model.write(view, element, value)
        for entry in memory.drain():
            follower[entry.view, entry.element] = entry.value
        for other, spec in enumerate(SPECS[:PLAIN]):
            for part in range(spec.elements):
                seen = memory.read_now(other, part)
                assert (seen, type(seen)) == (model.read(other, part), type(model.read(other, part)))
        assert follower == {(view, element): value for view, element, value in memory.image()}


def test_what_shows_the_same_registers_is_in_the_log_once():
    memory = CommonMemory(SPECS)
    memory.keep_log()
    memory.commit([(WORD, -32767)], WRITER)
    assert [(entry.sequence, entry.kind, entry.view, entry.element, entry.value) for entry in memory.drain()] == [
        (1, WriteKind.COMMIT, WORD, 0, -32767),
        (2, WriteKind.COMMIT, BANK, 1, -32767),
        (3, WriteKind.COMMIT, LOW, 0, True),
        (4, WriteKind.COMMIT, HIGH, 0, True),
    ]
    memory.write_now(WORD, -32767, WRITER)
    memory.write_now(PLAIN, 3, WRITER)
    assert [entry.view for entry in memory.drain()] == [WORD, PLAIN]


def test_a_word_and_its_bits_are_latched_apart():
    """3.3: a block that writes the word does not change its named bits in the same scan."""
    text = lines(
        "CALL MOVE(INPUT1=3, OUTPUT1=WORD%)",
        "CALL AND(INPUT1=LOW@, OUTPUT=SEEN@)",
        declare="COMMON WORD%, LOW@, SEEN@",
    )
    compiled = compiled_of(text)
    specs = (*SPECS[:3], ViewSpec("SEEN@", DataType.BOOLEAN))
    views = {spec.name: view for view, spec in enumerate(specs)}
    from automax_ros.compile.compiler import compile_program

    memory = CommonMemory(specs)
    task = Task(compile_program(compiled.program, views), memory, writer=WRITER)
    task.run()
    task.scan(0)
    assert (memory.read_now(WORD), memory.read_now(LOW), memory.read_now(3)) == (3, True, False)
    task.scan(1)
    assert memory.read_now(3) is True


def test_a_forced_bit_stays_when_its_word_is_written():
    memory = CommonMemory(SPECS)
    memory.force(LOW, True)
    memory.write_now(WORD, 0, WRITER)
    assert (memory.read_now(LOW), memory.read_now(HIGH), memory.read_now(BANK, 1)) == (True, False, 0)


def test_the_register_of_a_forced_bit_shows_it_whatever_is_written_there():
    """Else an output would be off, and IOREAD% read it so, while its common and the operator see it on."""
    memory = CommonMemory(SPECS)
    memory.keep_log()
    memory.force(LONGBIT, True)
    assert [(entry.view, entry.kind) for entry in memory.drain()] == [
        (LONGBIT, WriteKind.FORCE),
        (BANK, WriteKind.OUTSIDE),
        (LONG, WriteKind.OUTSIDE),
    ], "a replay holds what is forced, and nothing else"
    memory.write_now(BANK, 3, WRITER, 3)
    assert (memory.read_now(BANK, 3), memory.read_now(LONG), memory.read_now(LONGBIT)) == (0x13, 0x13, True)
    memory.release(LONGBIT)
    memory.force(LONG, 0x10005)
    memory.write_now(BANK, 7, WRITER, 2)
    memory.clear()
    assert (memory.read_now(BANK, 2), memory.read_now(BANK, 3), memory.read_now(LONG)) == (1, 5, 0x10005)


def test_stop_all_keeps_what_a_module_keeps():
    memory = CommonMemory(SPECS)
    memory.write_now(WORD, 5, OTHER)
    memory.write_now(PLAIN, 5, OTHER)
    memory.clear(kept=memory.registers.showing(BANK, range(2)))
    assert (memory.read_now(WORD), memory.read_now(LOW), memory.read_now(BANK, 1), memory.read_now(PLAIN)) == (
        5,
        True,
        5,
        0,
    )
    memory.clear()
    assert all(value == SPECS[view].type.zero for view, _, value in memory.image())


@pytest.fixture
def backplane() -> Backplane:
    return Backplane([Bank(5, BANK, 4, range(2, 4))])


@pytest.mark.parametrize(
    ("slot", "register", "readable", "writable"),
    [
        (5, 0, True, False),
        (5, 1, True, False),
        (5, 2, True, True),
        (5, 3, True, True),
        (5, 4, False, False),
        (5, -1, False, False),
        (6, 0, False, False),
    ],
)
def test_a_register_answers_or_is_a_bus_error(backplane, slot, register, readable, writable):
    text = lines(f"A% = IOREAD%({slot}, {register})", f"IOWRITE {slot}, {register}, 7")
    memory = CommonMemory(SPECS)
    if readable:
        memory.write_now(BANK, -5, OTHER, register)
    task = Task(compiled_of(text), memory, backplane=backplane)
    task.record_scans()
    task.run()
    record = task.scan(0)
    assert task.value("A%") == (-5 if readable else 0)
    assert record.errors == [*([] if readable else [(30, 7031)]), *([] if writable else [(40, 7031)])]
    assert record.reads == ([(BANK, register, -5)] if readable else []), "a replay must find what was read"
    assert record.writes == ([(BANK, register, 7)] if writable else [])
    if writable:
        assert memory.read_now(BANK, register) == 7


def test_iowrite_keeps_the_low_16_bits():
    memory = CommonMemory(SPECS)
    task = Task(
        compiled_of(lines("D! = 98304", "IOWRITE 5, 2, D!")), memory, backplane=Backplane([Bank(5, 0, 4, range(4))])
    )
    task.run()
    task.scan(0)
    assert memory.read_now(BANK, 2) == -32768


def test_a_private_image_is_a_copy_until_it_is_copied_out():
    common = CommonMemory(SPECS)
    common.keep_log()
    common.write_now(WORD, 3, OTHER)
    common.drain()
    image = PrivateImage(SPECS, common)
    assert image.read_now(WORD) == 0
    image.take([(WORD, 0), (BANK, 1), (LOW, 0), (HIGH, 0)])
    assert (image.read_now(WORD), image.read_now(LOW), image.read_now(BANK, 1)) == (3, True, 3)
    image.commit([(PLAIN, 9), (LOW, False)], WRITER)
    assert (image.latch(image.plan([WORD, PLAIN])), common.read_now(PLAIN), common.drain()) == ((2, 9), 0, [])
    image.give([(PLAIN, 0), (WORD, 0)], WRITER)
    assert [(entry.kind, entry.view, entry.value) for entry in common.drain()][:2] == [
        (WriteKind.COMMIT, PLAIN, 9),
        (WriteKind.COMMIT, WORD, 2),
    ]
    image.give([(PLAIN, 0), (WORD, 0)], WRITER)
    assert common.drain() == []


def test_a_task_runs_on_local_memory_and_a_force_holds_there_too():
    text = lines("CALL MOVE(INPUT1=5, OUTPUT1=PLAIN%)", "A% = PLAIN%", declare="COMMON PLAIN%\n11 LOCAL A%")
    common = CommonMemory([SPECS[PLAIN]])
    memory = LocalMemory(common, {0})
    task = Task(compiled_of(text), memory)
    task.run()
    task.scan(0)
    task.scan(1)
    assert (task.value("A%"), common.read_now(0)) == (5, 0)
    common.force(0, 8)
    memory.image.take([(0, 0)])
    task.scan(2)
    assert (task.value("A%"), memory.image.read_now(0)) == (8, 8)
