"""Recordings of racks with I/O modules: words, bits and registers replay as they were, for edited tasks too."""

from __future__ import annotations

import pytest

from automax_ros.rack.rack import Rack
from replay.replays import edited, recorded, replayed

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}, WORK: {priority: 8}}}
  5: {module: 57C419}
  6: {module: 57C403}
common:
  BUTTONS%: {slot: 5, register: 0, ros: in}
  START@: {slot: 5, register: 0, bit: 3}
  LAMPS%: {slot: 6, register: 0}
  RED@: {slot: 6, register: 0, bit: 0}
  GREEN@: {slot: 6, register: 0, bit: 1}
  SEEN%: {}
  ODD@: {}
"""
SPEED = """\
10 COMMON BUTTONS%, START@, LAMPS%, ODD@
20 LOCAL N%, M%
100 CALL SCAN_LOOP(TICKS=1)
110 N% = IOREAD%(5, 0) + IOREAD%(9, 0)
120 CALL AND(INPUT1=START@, INPUT2=START@, OUTPUT=ODD@)
130 CALL MULTIPLY_DIVIDE(INPUT1=BUTTONS%, INPUT2=3, INPUT3=2, OUTPUT=LAMPS%)
140 END
"""
WORK = """\
10 COMMON RED@, GREEN@, LAMPS%, SEEN%
20 LOCAL K%
100 CALL SCAN_LOOP(TICKS=2)
110 GREEN@ = NOT RED@
120 IF RED@ THEN IOWRITE 6, 0, 12
130 SEEN% = LAMPS% + IOREAD%(6, 0)
140 END
"""


def pressing(rack: Rack, number: int) -> None:
    rack.write("BUTTONS%", number * 2731 % 65536 - 32768)
    if number % 7 == 3:
        rack.force("ODD@", number % 2 == 0)
    if number % 7 == 6:
        rack.unforce("ODD@")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("registers") / "rack", pressing, yaml=YAML, SPEED=SPEED, WORK=WORK)


@pytest.mark.parametrize(("from_ms", "more_than"), [(0, 500), (150, 0), (700, 0), (1500, 0)])
def test_registers_replay_bit_for_bit_from_any_place(bag, from_ms, more_than):
    report = replayed(bag, from_ns=from_ms * 10**6)
    assert report.identical
    assert report.scans > more_than


def test_a_task_that_only_looks_different_is_identical(bag):
    same = edited(WORK, ("SEEN% = LAMPS% + IOREAD%(6, 0)", "SEEN% = IOREAD%(6, 0) + LAMPS%"))
    assert replayed(bag, {"WORK": same}).identical


def test_an_edited_task_reads_its_own_bits_in_the_word(bag, tmp_path):
    """What the edited task writes to a bit it finds in the word and in the register: as in a run of its own."""
    changed = edited(WORK, ("GREEN@ = NOT RED@", "GREEN@ = RED@"))
    report = replayed(bag, {"WORK": changed})
    found = {item.name: item.first for item in report.differences}
    assert {"GREEN@", "SEEN%"} <= set(found)
    alone = recorded(tmp_path / "rack", pressing, yaml=YAML, SPEED=SPEED, WORK=changed)
    assert replayed(alone).identical
    back = {item.name for item in replayed(alone, {"WORK": WORK}).differences}
    assert {"GREEN@", "SEEN%"} <= back


BITS = edited(YAML, ("  LAMPS%: {slot: 6, register: 0}\n", ""))
BIT_SPEED = (
    "10 COMMON RED@, ODD@\n20 CALL SCAN_LOOP(TICKS=1)\n30 CALL AND(INPUT1=RED@, INPUT2=RED@, OUTPUT=ODD@)\n40 END\n"
)
BIT_WORK = """\
10 COMMON RED@, GREEN@, SEEN%
20 LOCAL N%
100 CALL SCAN_LOOP(TICKS=2)
110 N% = N% + 1
120 IOWRITE 6, 0, N%
130 GREEN@ = NOT RED@
140 SEEN% = IOREAD%(6, 0)
150 END
"""


def forcing_bits(rack: Rack, number: int) -> None:
    if number == 3:
        rack.force("RED@", True)
    if number == 15:
        rack.unforce("RED@")


def test_a_forced_bit_holds_in_its_register_and_nothing_else_does(tmp_path):
    bag = recorded(tmp_path / "rack", forcing_bits, yaml=BITS, SPEED=BIT_SPEED, WORK=BIT_WORK)
    for from_ms in (0, 750):
        assert replayed(bag, from_ns=from_ms * 10**6).identical
    range_ns = {"from_ns": 400 * 10**6, "to_ns": 1400 * 10**6}
    assert replayed(bag, {"WORK": edited(BIT_WORK, ("0, N%", "0, N% / 2 * 2"))}, **range_ns).identical
    assert not replayed(bag, {"WORK": edited(BIT_WORK, ("0, N%", "0, N% / 8 * 8"))}, **range_ns).identical
