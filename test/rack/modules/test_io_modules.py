"""Analog, resolver and pulsetach modules, common memory as plain registers: who may write what, what STOP ALL keeps."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.modules.registry import SUPPORTED
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import Place, ViewSpec
from rack.helpers import rack_at, run_for

DIRECTIONS = {
    "57C402": "o",
    "57C403": "o",
    "57C408": "io",
    "57C409": "iiooioo",
    "57C410": "oooo",
    "57C411": "iiioo",
    "57C419": "iioo",
    "57C421": "iioooooi",
}
"""The registers of each module in order: inputs (i) and outputs (o)."""


def built(folder: Path, model: str, points: str, task: str = "10 CALL SCAN_LOOP(TICKS=1)\n20 END\n") -> Rack:
    (folder / "T.BLK").write_text(task)
    slots = f"  0: {{module: 57C435, tasks: {{T: {{priority: 8}}}}}}\n  4: {{module: {model}}}\n"
    (folder / "rack.yaml").write_text(f"rack: PM1\nslots:\n{slots}common:\n{points}")
    return rack_at(folder / "rack.yaml")


@pytest.mark.parametrize("model", DIRECTIONS)
def test_each_register_is_written_by_who_may_write_it(tmp_path, model):
    expected = DIRECTIONS[model]
    points = "".join(f"  R{number}%: {{slot: 4, register: {number}}}\n" for number in range(len(expected)))
    for number, letter in enumerate(expected):
        task = f"10 COMMON R{number}%\n20 CALL SCAN_LOOP(TICKS=1)\n30 R{number}% = 8\n40 END\n"
        if letter == "i":
            with pytest.raises(RackError) as refused:
                built(tmp_path, model, points, task)
            assert {item.code for _, items in refused.value.findings for item in items} == {"AMX4017"}
        else:
            rack = run_for(built(tmp_path, model, points, task), 0.005)
            assert rack.value(f"R{number}%") == 8
    assert SUPPORTED[model].models[model]
    beyond = f"  X%: {{slot: 4, register: {len(expected)}}}\n"
    (tmp_path / "rack.yaml").write_text(
        f"rack: A\nslots:\n  0: {{module: 57C435}}\n  4: {{module: {model}}}\ncommon:\n{beyond}"
    )
    assert [item.code for item in load(tmp_path / "rack.yaml").diagnostics] == ["AMX6421"]


@pytest.mark.parametrize("model", DIRECTIONS)
def test_stop_all_clears_outputs_and_keeps_inputs(tmp_path, model):
    expected = DIRECTIONS[model]
    rack = run_for(built(tmp_path, model, ""))
    view = rack.memory.view("SLOT:4%")
    rack.write_view(view, [(number, 9) for number in range(len(expected))], 1)
    rack.operations.stop_all("test")
    assert rack.memory.present(view) == [9 if letter == "i" else 0 for letter in expected]


def test_ioread_and_iowrite_follow_the_registers(tmp_path):
    task = """\
10 LOCAL SEEN%, GONE%
20 CALL SCAN_LOOP(TICKS=1)
30 IOWRITE 4, 2, 11
40 IOWRITE 4, 0, 12
50 SEEN% = IOREAD%(4, 2)
60 GONE% = IOREAD%(4, 7)
70 GONE% = GONE% + IOREAD%(5, 0)
80 END
"""
    rack = run_for(built(tmp_path, "57C409", "", task), 0.005)
    done = rack.task("T")
    assert (done.value("SEEN%"), done.value("GONE%")) == (11, 0)
    log = done.errors
    assert log.count == 3
    assert [(entry.line, entry.hardware) for entry in (log.first, log.second, log.last)] == [
        (40, "31"),
        (60, "31"),
        (70, "31"),
    ]
    assert rack.stop_reason is None


def test_a_point_lies_on_inputs_or_on_outputs(tmp_path):
    text = "rack: A\nslots:\n  0: {module: 57C435}\n  4: {module: 57C421}\ncommon:\n  X!: {slot: 4, register: %d}\n"
    found = []
    for register in range(7):
        (tmp_path / "rack.yaml").write_text(text % register)
        found.append([item.code for item in load(tmp_path / "rack.yaml").diagnostics])
    assert found == [[], ["AMX6421"], [], [], [], [], ["AMX6421"]]


def test_a_real_has_no_place_on_these_modules(tmp_path):
    text = "rack: A\nslots:\n  0: {module: 57C435}\n  4: {module: 57C413}\ncommon:\n  X: {slot: 4, register: 0}\n"
    (tmp_path / "rack.yaml").write_text(text)
    assert [item.code for item in load(tmp_path / "rack.yaml").diagnostics] == ["AMX6422"]


@pytest.mark.parametrize("value", [0.0, 1.5, -2.25e18, 9.2233717e18, 3.1415927, -1e-19])
def test_two_registers_hold_a_real(value):
    views = (ViewSpec("B%", DataType.INTEGER, 2, is_array=True), ViewSpec("X", DataType.REAL, place=Place(0, 0)))
    memory = CommonMemory(views)
    stored = stored_real(value)[0]
    memory.write_from_outside(1, value, 0)
    high, low = (int(word) & 0xFFFF for word in memory.present(0))
    other = CommonMemory(views)
    other.write_now(0, (high ^ 0x8000) - 0x8000, 0, 0)
    other.write_now(0, (low ^ 0x8000) - 0x8000, 0, 1)
    assert other.read_now(1) == memory.read_now(1) == stored


def test_bits_that_are_no_real_show_as_one():
    views = (ViewSpec("B%", DataType.INTEGER, 2, is_array=True), ViewSpec("X", DataType.REAL, place=Place(0, 0)))
    memory = CommonMemory(views)
    for word, shown in ((0x7FC0, 0.0), (0x7F80, stored_real(1e30)[0]), (0xFF80 - 0x10000, stored_real(-1e30)[0])):
        memory.write_now(0, word, 0, 0)
        assert memory.read_now(1) == shown


@pytest.mark.parametrize(("slot", "codes"), [(2, []), (3, ["AMX6208"]), (14, []), (15, ["AMX6208"])])
def test_common_memory_stands_in_even_slots(tmp_path, slot, codes):
    text = f"rack: A\nslots:\n  0: {{module: 57C413}}\n  1: {{module: 57C435}}\n  {slot}: {{module: 57C423}}\n"
    (tmp_path / "rack.yaml").write_text(text)
    assert [item.code for item in load(tmp_path / "rack.yaml").diagnostics] == codes


def test_user_registers_take_either_direction(tmp_path):
    """Both models have 65536 registers there; what is ``ros: in`` is an input, and STOP ALL clears all of them."""
    points = "  OUT%: {slot: 4, register: 65535}\n  IN@: {slot: 4, register: 0, bit: 15, ros: in}\n"
    task = "10 COMMON OUT%, IN@\n20 CALL SCAN_LOOP(TICKS=1)\n30 IF IN@ THEN OUT% = OUT% + 1\n40 END\n"
    rack = run_for(built(tmp_path, "57C423", points, task))
    rack.write("IN@", True)
    rack.run(0.0165)
    assert (rack.value("OUT%"), rack.value("SLOT:4%", 0)) == (3, -32768)
    rack.operations.stop_all("test")
    assert (rack.value("OUT%"), rack.value("IN@")) == (0, False)
    with pytest.raises(RackError):
        built(tmp_path, "57C423", points, task.replace("OUT% = OUT% + 1", "IN@ = FALSE"))


def test_two_common_memories_have_names_of_their_own(tmp_path):
    text = "rack: A\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435}\n  2: {module: 57C413}\n"
    (tmp_path / "rack.yaml").write_text(text)
    config = load(tmp_path / "rack.yaml").config
    assert [module.name for module in config.modules] == ["common_memory", "processor_1", "common_memory_2"]
    assert config.common_memory_slot == 0
