"""A rack file becomes the rack it describes."""

import dataclasses

import pytest
from rack.helpers import HEAD, codes, common, good, loaded

from automax_ros.core.diagnostics import render
from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType
from automax_ros.rackfile.modules.common_memory import CommonMemoryConfig

TWO_PROCESSORS = """\
rack: LINE1
operator: true
slots:
  0: {module: 57C413B}
  2: {module: 57C431, tick_ms: 0.5, tasks: {SECT: {file: line.blk, priority: 11}}}
  1:
    module: 57C435
    tasks:
      LINE: {priority: 5}
      DRAW: {file: LINE.BLK, priority: 4}
common:
  LINE_SPEED%: {ros: in, unit: fpm, description: 'line speed: reference', rate_limit_hz: 20}
  TOTAL!: {non_volatile: on, preset: -2147483648}
  GAIN:
"""


def test_modules_stand_in_the_order_of_slots_with_their_ticks_and_tasks(tmp_path):
    (tmp_path / "line.blk").write_text("10 END\n")
    rack = good(tmp_path, TWO_PROCESSORS)
    assert (rack.name, rack.namespace, rack.operator) == ("LINE1", "line1", True)
    assert rack.modules[0] == CommonMemoryConfig(
        slot=0, model="57C413", name="common_memory", line=4, common_registers=65536, has_battery=True
    )
    assert [(item.slot, item.model, item.tick_ns) for item in rack.task_modules] == [
        (1, "57C435", 5_500_000),
        (2, "57C431", 500_000),
    ]
    tasks = [(task.name, task.file.name, task.priority, task.line) for task in rack.task_modules[0].tasks]
    assert tasks == [("LINE", "LINE.BLK", 5, 9), ("DRAW", "LINE.BLK", 4, 10)]
    assert rack.task_modules[1].tasks[0].file == tmp_path / "line.blk"


def test_text_and_path_are_kept_for_the_recording(tmp_path):
    (tmp_path / "line.blk").write_text("10 END\n")
    rack = good(tmp_path, TWO_PROCESSORS)
    assert rack.text == TWO_PROCESSORS
    assert rack.path == tmp_path / "rack.yaml"


def test_options_of_variables(tmp_path):
    (tmp_path / "line.blk").write_text("10 END\n")
    speed, total, gain = good(tmp_path, TWO_PROCESSORS).variables
    assert (speed.name, speed.type, speed.direction) == ("LINE_SPEED%", DataType.INTEGER, Direction.IN)
    assert (speed.rate_limit_hz, speed.unit, speed.description) == (20.0, "fpm", "line speed: reference")
    assert (total.non_volatile, total.preset, total.direction) == (True, -2147483648, Direction.OUT)
    assert (gain.type, gain.preset, gain.non_volatile, gain.line) == (DataType.REAL, None, False, 14)


def test_configuration_cannot_be_changed(tmp_path):
    rack = good(tmp_path, HEAD)
    with pytest.raises(dataclasses.FrozenInstanceError):
        rack.name = "OTHER"


@pytest.mark.parametrize(
    ("line", "dimensions", "elements", "registers"),
    [
        ("A%:", (), 1, 1),
        ("A%(10):", (11,), 11, 11),
        ("A!(6,3):", (7, 4), 28, 56),
        ("A[1, 2, 3, 0]:", (2, 3, 4, 1), 24, 48),
        ("A@(16):", (17,), 17, 2),
        ("A$:5(1):", (2,), 2, 6),
    ],
)
def test_subscripts_count_from_0_and_types_take_registers(tmp_path, line, dimensions, elements, registers):
    variable = common(tmp_path, line)
    assert (variable.dimensions, variable.elements, variable.registers) == (dimensions, elements, registers)
    assert variable.is_array == bool(dimensions)


@pytest.mark.parametrize(("line", "length"), [("A$:", 31), ("A$:50:", 50), ("A$:10(20):", 10), ("A%:", 0)])
def test_length_of_strings(tmp_path, line, length):
    assert common(tmp_path, line).length == length


@pytest.mark.parametrize("word", ["NO", "ON_1", "Y", "NULL", "E1", "_X"])
def test_words_that_yaml_would_turn_into_values_stay_names(tmp_path, word):
    assert common(tmp_path, f"{word}:").name == word


@pytest.mark.parametrize(
    ("line", "preset"),
    [
        ("A%: {preset: -32768}", -32768),
        ("A!: {preset: +7}", 7),
        ("A: {preset: 3}", 3.0),
        ("A: {preset: .5e1}", 5.0),
        ("A: {preset: 0.1}", 0.10000000149011612),
        ("A@: {preset: on}", True),
        ("A@: {preset: 1}", True),
        ("A%: {preset: 100.0}", 100),
        ("A: {preset: 1e-25}", 0.0),
        ("A@: {preset: FALSE}", False),
        ("A$: {preset: 007}", "007"),
        ("A$: {preset: ''}", ""),
        ("A%(2): {preset: 4}", 4),
        ("A%(2): {preset: [1, 2, 3]}", (1, 2, 3)),
        ("A@(1): {preset: [on, off]}", (True, False)),
    ],
)
def test_presets_have_the_variables_type(tmp_path, line, preset):
    value = common(tmp_path, line).preset
    assert value == preset
    assert type(value) is type(preset)


def test_preset_of_an_array_holds_for_every_element(tmp_path):
    assert common(tmp_path, "A%(1,2): {preset: 4}").presets == (4,) * 6
    assert common(tmp_path, "A%: {preset: 4}").presets == (4,)
    assert common(tmp_path, "A%:").presets == ()


@pytest.mark.parametrize(
    "line",
    [
        "A%: {preset: 32768}",
        "A%: {preset: '5'}",
        "A%: {preset: 0x10}",
        "A%: {preset: 010}",
        "A%: {preset: true}",
        "A!: {preset: 2147483648}",
        "A: {preset: .nan}",
        "A: {preset: 1e19}",
        "A$:3: {preset: four}",
        "A%: {preset: [1]}",
        "A%(2): {preset: [1, 2]}",
        "A%(2): {preset: [1, 2, x]}",
        "A%: {preset: }",
    ],
)
def test_presets_outside_the_type_are_refused(tmp_path, line):
    assert codes(tmp_path, f"{HEAD}common:\n  {line}\n") == ["AMX6406"]


def test_direction_is_out_for_the_first_200_simple_commons_and_closed_for_arrays(tmp_path):
    lines = ["  ARRAY%(3):"] + [f"  V{number}%:" for number in range(201)]
    result = loaded(tmp_path, HEAD + "common:\n" + "\n".join(lines) + "\n")
    directions = [item.direction for item in result.config.variables]
    assert directions == [Direction.CLOSED] + [Direction.OUT] * 200 + [Direction.CLOSED]
    assert [(item.code, item.span.line) for item in result.diagnostics] == [("AMX6412", 206)]


def test_all_errors_come_in_one_pass_in_the_order_of_the_file(tmp_path):
    text = (
        "rack: L-1\nslots:\n  0: {module: 57C435, tick_ms: 3.3, tasks: {A: {priority: 1}}}\ncommon:\n  IF:\n  A%: 5\n"
    )
    places = [(item.code, item.span.line) for item in loaded(tmp_path, text).diagnostics]
    assert places == [
        ("AMX6100", 1),
        ("AMX6210", 3),
        ("AMX6306", 3),
        ("AMX6302", 3),
        ("AMX6401", 5),
        ("AMX6008", 6),
    ]


def test_message_names_file_line_column_and_the_earlier_place(tmp_path):
    result = loaded(tmp_path, "rack: A\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435}\n  1: {module: 57C431}\n")
    lines = render(result.diagnostics[0], result.source).splitlines()
    assert lines[0] == f"{tmp_path}/rack.yaml:5:3: error[AMX6201]: slot 1 already holds processor 57C435 (line 4)"
    assert lines[3] == f"{tmp_path}/rack.yaml:4:3: note: first defined here"


def test_warnings_do_not_refuse_a_rack(tmp_path):
    result = loaded(tmp_path, HEAD + "common:\n  A%:\n  A@:\n")
    assert [item.code for item in result.diagnostics] == ["AMX6403"]
    assert [item.name for item in result.config.variables] == ["A%", "A@"]


def test_lower_case_names_are_read_in_upper_case_with_one_warning(tmp_path):
    text = "rack: line1\nslots:\n  0: {module: 57c435, tasks: {line: {priority: 5}}}\ncommon:\n  speed%:\n"
    result = loaded(tmp_path, text)
    assert [item.code for item in result.diagnostics] == ["AMX6411"]
    assert (result.config.name, result.config.variables[0].name) == ("LINE1", "SPEED%")
    assert result.config.task_modules[0].tasks[0].name == "LINE"


def test_letters_beyond_ascii_are_not_made_to_fit(tmp_path):
    assert codes(tmp_path, HEAD + "common:\n  STRA\u00dfE%:\n") == ["AMX6400"]


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "---\n...\n"])
def test_empty_file_lacks_its_keys(tmp_path, text):
    assert codes(tmp_path, text) == ["AMX6009"]


def test_files_of_other_editors_are_read(tmp_path):
    path = tmp_path / "rack.yaml"
    (tmp_path / "LINE.BLK").write_text("10 END\n")
    path.write_bytes(b"\xef\xbb\xbf" + HEAD.replace("\n", "\r\n").encode())
    from automax_ros.rackfile.loader import load

    assert load(str(path)).config.name == "LINE1"


def test_predefined_commons_are_simple_booleans(tmp_path):
    names = ["AUTORUNSTATUS", "FORCINGSTATUS", *(f"BATTERYSTATUS{slot}" for slot in range(5))]
    lines = "".join(f"  {name}@:\n" for name in names)
    assert len(good(tmp_path, HEAD + "common:\n" + lines).variables) == 7
    for name in names:
        for faulty in (f"{name}%:", f"{name}@(3):", f"{name}@: {{preset: on}}", f"{name}@: {{ros: in}}"):
            assert codes(tmp_path, f"{HEAD}common:\n  {faulty}\n") == ["AMX6410"]
    assert common(tmp_path, "BATTERYSTATUS5%:").type is DataType.INTEGER


@pytest.mark.parametrize(
    ("memory", "line", "fits"),
    [
        ("57C413", "A%(32767,1):", True),
        ("57C413", "A%(32768,1):", False),
        ("57C423", "A!(32767,1):", True),
        ("57C423", "A!(32768,1):", False),
    ],
)
def test_commons_fit_into_the_registers_of_their_module(tmp_path, memory, line, fits):
    text = f"rack: A\nslots:\n  0: {{module: {memory}}}\n  1: {{module: 57C435}}\ncommon:\n  {line}\n"
    assert codes(tmp_path, text) == ([] if fits else ["AMX6409"])


def test_loading_twice_gives_the_same(tmp_path):
    assert loaded(tmp_path, HEAD) == loaded(tmp_path, HEAD)
