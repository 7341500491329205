"""Digital modules: points as words and bits, what a task may write, what is wrong with a place."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rack.helpers import rack_at, written_in

from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.loader import load

HEAD = """\
rack: PM1
slots:
  0: {module: 57C435, tasks: {PANEL: {priority: 8}}}
  5: {module: 57C419}
  6: {module: 57C403}
  7: {module: 57C408}
common:
"""
POINTS = """\
  BUTTONS%: {slot: 5, register: 0}
  START_PB@: {slot: 5, register: 0, bit: 3, ros: in}
  LAMPS%: {slot: 6, register: 0}
  LAMP@: {slot: 6, register: 0, bit: 15}
  FMCR@: {slot: 7, register: 1, bit: 0}
"""
PANEL = """\
10 COMMON BUTTONS%, START_PB@, LAMPS%, LAMP@, FMCR@
20 LOCAL SEEN%, OUTSIDE%
100 CALL SCAN_LOOP(TICKS=1)
110 SEEN% = BUTTONS%
120 OUTSIDE% = IOREAD%(5, 0)
130 LAMP@ = START_PB@
140 CALL AND(INPUT1=START_PB@, INPUT2=START_PB@, OUTPUT=FMCR@)
150 END
"""


def written(folder: Path, points: str, panel: str = "10 CALL SCAN_LOOP(TICKS=1)\n20 END\n") -> Path:
    return written_in(folder, HEAD + points, PANEL=panel)


def codes(folder: Path, points: str) -> list[str]:
    return [item.code for item in load(written(folder, points)).diagnostics]


def built(folder: Path, points: str, panel: str) -> Rack:
    return rack_at(written(folder, points, panel))


@given(st.lists(st.integers(-32768, 32767), min_size=1, max_size=4))
@settings(deadline=None, derandomize=True, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_task_reads_a_push_button_through_its_word_and_its_bit(tmp_path, pressed):
    rack = built(tmp_path, POINTS, PANEL)
    rack.start()
    task = rack.task("PANEL")
    for number, word in enumerate(pressed, 1):
        rack.write("BUTTONS%", word)
        rack.run(0.0055)
        button = bool(word >> 3 & 1)
        assert (task.value("SEEN%"), task.value("OUTSIDE%")) == (word, word)
        assert (rack.value("START_PB@"), rack.value("LAMP@"), rack.value("FMCR@")) == (button, button, button)
        assert rack.value("LAMPS%") == (-32768 if button else 0)
        assert rack.now_ns == number * 5_500_000
    rack.write("START_PB@", False)
    assert rack.value("BUTTONS%") == pressed[-1] & ~8


@pytest.mark.parametrize(
    "statement",
    [
        "110 START_PB@ = TRUE",
        "110 BUTTONS% = 5",
        "110 FOR BUTTONS% = 1 TO 3\n111 NEXT BUTTONS%",
        "110 CALL AND(INPUT1=LAMP@, INPUT2=LAMP@, OUTPUT=START_PB@)",
    ],
)
def test_a_task_that_writes_an_input_point_is_an_error(tmp_path, statement):
    panel = f"10 COMMON BUTTONS%, START_PB@, LAMP@\n100 CALL SCAN_LOOP(TICKS=1)\n{statement}\n150 END\n"
    with pytest.raises(RackError) as refused:
        built(tmp_path, POINTS, panel)
    assert "AMX4017" in {item.code for _, items in refused.value.findings for item in items}


@pytest.mark.parametrize(
    ("point", "code"),
    [
        ("A@: {slot: 5, register: 1, bit: 15}", None),
        ("A!: {slot: 5, register: 0}", None),
        ("A%: {slot: 7, register: 0, preset: 5, unit: V, ros: in}", None),
        ("A@: {slot: 1, register: 0, bit: 0}", "AMX6420"),
        ("A@: {slot: 0, register: 0, bit: 0}", "AMX6420"),
        ("A%: {slot: 16, register: 0}", "AMX6421"),
        ("A@: {slot: 6, register: 1, bit: 0}", "AMX6421"),
        ("A@: {slot: 5, register: -1, bit: 0}", "AMX6421"),
        ("A@: {slot: 5, register: 0, bit: 16}", "AMX6421"),
        ("A!: {slot: 5, register: 1}", "AMX6421"),
        ("A!: {slot: 6, register: 0}", "AMX6421"),
        ("A@: {slot: 5, register: 0}", "AMX6009"),
        ("A%: {slot: 5}", "AMX6009"),
        ("A%: {register: 0}", "AMX6009"),
        ("A%: {slot: five, register: 0}", "AMX6008"),
        ("A%: {slot: 5, register: 0, bit: 1}", "AMX6422"),
        ("A: {slot: 5, register: 0}", "AMX6422"),
        ("A$: {slot: 5, register: 0}", "AMX6422"),
        ("A%(1): {slot: 5, register: 0}", "AMX6422"),
        ("A%: {slot: 5, register: 0, non_volatile: true}", "AMX6422"),
        ("FORCINGSTATUS@: {slot: 5, register: 0, bit: 0}", "AMX6410"),
    ],
)
def test_a_place_is_right_or_has_its_problem(tmp_path, point, code):
    found = codes(tmp_path, f"  {point}\n")
    assert set(found) == ({code} if code else set())


KINDS = (
    "A{n}@: {{slot: 5, register: {r}, bit: 2}}",
    "A{n}%: {{slot: 5, register: {r}}}",
    "A{n}!: {{slot: 5, register: 0}}",
)


@pytest.mark.parametrize(("one", "other"), list(product(range(5), repeat=2)))
def test_only_a_word_and_its_bits_may_share(tmp_path, one, other):
    """0, 1: a bit of register 0 or 1; 2, 3: the word 0 or 1; 4: both registers as one number."""
    texts = [
        KINDS[0].format(n=number, r=kind) if kind < 2 else KINDS[min(kind // 2, 2)].format(n=number, r=kind - 2)
        for number, kind in enumerate((one, other))
    ]
    bits, words = {one, other} & {0, 1}, {one, other} & {2, 3, 4}
    same = one == other or (len(words) == 2 and 4 in words)
    found = codes(tmp_path, "".join(f"  {text}\n" for text in texts))
    assert found == (["AMX6423"] if same else []), (texts, bits)


def test_registers_have_no_topic_and_cannot_be_declared(tmp_path):
    rack = built(tmp_path, POINTS, PANEL)
    banks = [variable for variable in rack.config.variables if variable.bank is not None]
    assert [(item.name, item.dimensions) for item in banks] == [("SLOT:5%", (4,)), ("SLOT:6%", (1,)), ("SLOT:7%", (2,))]
    assert codes(tmp_path, "  SLOT:5%(1): {}\n") != []
