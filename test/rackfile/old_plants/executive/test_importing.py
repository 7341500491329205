"""Racks of an Executive as rack files: the sample as it should come out, and everything that does not fit."""

from __future__ import annotations

import random
import shutil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.user_error import UserError
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.loader import load, load_stored
from automax_ros.rackfile.model.config import IoPoint
from automax_ros.rackfile.old_plants.executive.fields import field_choice
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import chosen_rack
from automax_ros.rackfile.old_plants.executive.importing import Choices, import_rack
from automax_ros.rackfile.old_plants.executive.ladder import MOST_DECLARED
from rackfile.old_plants.executive.disks import (
    CARD,
    GONE,
    SAMPLE,
    SCAN,
    STRING,
    SWVAR,
    TASKS,
    WIND1,
    card,
    memory,
    point,
    processor,
    rack,
    table,
    task,
)  # fmt: skip

PARTS = {1: "57C413", 2: "57C435", 3: "57C431", 10: "57C404", 20: "57C419", 21: "57C403", 22: "57C409", 40: "57552"}
"""The invented part codes of the sample."""
EXPECTED = """\
rack: WIND1
executive: 3.3
slots:
  0: {module: 57C413}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      LINE: {priority: 5, critical: true}
  2:
    module: 57C431
    tick_ms: 2.5
    tasks:
      SECT1: {priority: 6}
  4: {module: 57C404, network: A, drop: 0}
  6: {module: 57C419}
  7: {module: 57C403}
  8: {module: 57C409}
  10:
    module: 57552
    tasks:
      WIND_A: {drive: A}
common:
  LINE_REF%: {description: "LINE REFERENCE, COUNTS"}
  CORE_DIA: {non_volatile: true, description: "CORE DIAMETER, INCHES"}
  TOTAL!: {non_volatile: true, description: FEET SINCE START}
  NOTE$:50: {description: SHIFT NOTE}
  TABLE%(10): {description: "TENSION TABLE, 11 VALUES"}
  START_PB@: {slot: 6, register: 0, bit: 3, description: START}
  LAMP@: {slot: 7, register: 0, bit: 0, description: RUNNING}
  PRESSURE%: {slot: 8, register: 0, description: DRUCK F\u00dcR WALZE}
  NET_SPD%: {slot: 4, drop: 1, register: 32, description: LINE SPEED FOR ALL DROPS}
  CCLK@: {slot: 10, register: 2000, bit: 6, description: COMMON CLOCK ON}
  TORQUE%: {slot: 10, register: 100, description: TORQUE REFERENCE}
  WIND_REF%: {slot: 10, register: 302, description: FROM LINE TASK}
"""
"""What a person makes of the sample."""


def imported(folder, **choices):
    findings = Findings()
    made = import_rack(chosen_rack(folder, None), Choices(**choices), findings)
    return made, [(item.code, item.place, item.message) for item in findings.items]


def errors_of(made):
    return [item for item in made.diagnostics if item.severity is Severity.ERROR]


def config_of(text):
    result = load_stored(SourceText("rack.yaml", text), WIND1 / "rack.yaml")
    assert result.config is not None, result.diagnostics
    return result.config


def shape(config):
    """All that a rack file says, without the lines in which it does."""
    modules = [
        (item.slot, item.model, item.tick_ns, getattr(item, "network", None), getattr(item, "drop", None),
         [(task.name, task.priority, task.critical, task.drive, str(task.file.name)) for task in item.tasks])
        for item in config.modules
    ]  # fmt: skip
    commons = [
        (item.name, item.dimensions, item.length, item.point, item.non_volatile, item.description)
        for item in config.declared
    ]
    return config.name, config.executive, modules, commons


def test_the_sample_becomes_what_a_person_makes_of_it():
    made, told = imported(SAMPLE, parts=PARTS, executive=33)
    assert shape(config_of(made.text)) == shape(config_of(EXPECTED))
    assert (made.tasks, made.commons, errors_of(made)) == (3, 12, [])
    assert sorted(made.sources) == ["LINE.BLK", "SECT1.BLK", "WIND_A.BLK"]
    for name, data in made.sources.items():
        assert data == (WIND1 / name).read_bytes().replace(b"\r\n", b"\n").removesuffix(b"\x1a")
    assert {code for code, *_ in told} == {"AMX6791", "AMX6792", "AMX6795"}
    assert ("AMX6791", "$CARD.DBF record 8", "record 8 is marked as deleted and left out") in told
    assert "OLD_LAMP" not in made.text
    assert "# $PARAM.DBF record 1: slot 10, drive A, type 1, data (form not found)" in made.text
    assert "# system MILL: PAPER MILL 2; customer MUSTER; engineer R. DOE" in made.text


def test_the_sample_checks_without_errors(tmp_path):
    made, _ = imported(SAMPLE, parts=PARTS)
    for name, data in {**made.sources, "rack.yaml": made.text.encode()}.items():
        (tmp_path / name).write_bytes(data)
    config = load(tmp_path / "rack.yaml").config
    found = [item.code for checked in check_tasks(config) for item in checked.result.diagnostics]
    assert found == ["AMX4097"]


def test_without_part_codes_modules_are_found_out_or_stand_as_comments():
    made, told = imported(SAMPLE)
    config = config_of(made.text)
    found = [(0, "57C413"), (1, "57C435"), (2, "57C435"), (4, "57C404"), (10, "57552")]
    assert [(module.slot, module.model) for module in config.modules] == found
    assert [place for code, place, _ in told if code == "AMX6794"] == [f"$CARD.DBF record {n}" for n in range(1, 8)] + [
        "$CARD.DBF record 9"
    ]
    points = {item.name: item.point for item in config.declared}
    assert (points["START_PB@"], points["NET_SPD%"]) == (None, IoPoint(4, 64 + 32))
    assert (
        "  # 7: {module: }                    # $CARD.DBF record 6: LAMPS; part code 21; which module it is"
        in made.text
    )
    line = next(line for line in made.text.splitlines() if line.startswith("  START_PB@:"))
    assert "# $SWVAR.DBF record 6: slot 6, register 0, bit 3; the module in its slot is not known" in line


READS_REF = SCAN.format("REF%")


@pytest.fixture
def plant(tmp_path):
    """A rack whose Processor runs LINE, with what a test puts into it."""

    def make(cards=(), tasks=(), variables=(), files=None, line=READS_REF):
        everything = {"LINE.BLK": line, **(files or {})}
        return rack(
            tmp_path / "PM1", [card(0, 1), processor(), *cards], [task("LINE"), *tasks],
            [memory("REF"), *variables], everything,
        )  # fmt: skip

    return make


def test_a_code_is_found_out_by_another_slot_and_by_a_number_in_a_description(plant):
    cards = [card(5, 20, DESC="INPUTS, B/M 57C419A"), card(6, 20), card(7, 21), card(8, 30, DESC="57C416 RIO")]
    made, told = imported(plant(cards, variables=[point("A", 6, 0, 3), point("B", 7, 1)]))
    slots = {module.slot: module.model for module in config_of(made.text).modules}
    assert slots == {0: "57C413", 1: "57C435", 5: "57C419", 6: "57C419"}
    assert "slot 6: part code 20 is taken for a 57C419: as in slot 5, which has the same code" in [t[2] for t in told]
    assert "# 8: {module: 57C416}" in made.text
    assert "the remote I/O module is not emulated" in made.text
    assert ("AMX6795", "$CARD.DBF record 6", "record 6: the emulator has no 57C416") in told
    assert made.known == {1: "57C413", 2: "57C435", 20: "57C419", 30: "57C416"}


@pytest.mark.parametrize(
    ("points", "written", "model"),
    [
        ([point("A", 7, 2000, 6)], "", "57552"),
        ([point("A", 7, 305)], "", "57552"),
        ([point("A", 7, 4136)], "", "57C406"),
        ([point("A", 7, 7)], "", "57C421"),
        ([point("A", 7, 3)], "A%", None),
        ([point("A", 7, 5000)], "", None),
    ],
)
def test_registers_find_out_a_module_if_only_one_has_them(plant, points, written, model):
    line = SCAN.format("A%").replace("30", "30 A% = 1\n40") if written else SCAN.format("REF%")
    made, _ = imported(plant([card(7, 99)], variables=points, line=line))
    assert {module.slot: module.model for module in config_of(made.text).modules}.get(7) == model


def test_a_module_by_slot_beats_its_code_and_says_nothing(plant):
    folder = plant([card(5, 20), card(6, 20)])
    made, told = imported(folder, parts={20: "57C419"}, modules={6: "57C403"})
    slots = {module.slot: module.model for module in config_of(made.text).modules}
    assert (slots[5], slots[6]) == ("57C419", "57C403")
    assert [place for code, place, _ in told if code == "AMX6794"] == ["$CARD.DBF record 1", "$CARD.DBF record 2"]


def test_a_part_code_and_a_task_that_do_not_exist_are_told(plant):
    _, told = imported(plant(), parts={77: "57C419"}, drives={"NIL": "A"})
    assert ("AMX6794", "$CARD.DBF", "--part 77: no module has this code") in told
    assert ("AMX6794", "$TASKS.DBF", "--drive 'NIL': there is no such task") in told


@pytest.mark.parametrize(
    ("high", "low", "ms", "told_of"),
    [
        (21, 124, 5.5, ""),
        (1, 244, 0.5, ""),
        (39, 16, 10, ""),
        (21, 0, 5.5, "does not agree"),
        (2, 0, 5.5, "which is not a tick"),
        (None, None, 5.5, "WIRE_NOTE1 is blank"),
    ],
)
def test_ticks(tmp_path, high, low, ms, told_of):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor(WIRE_NOTE1=high, WIRE_NOTE2=low)], [task("LINE")], [],
                  {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    made, told = imported(folder)
    assert config_of(made.text).task_modules[0].tick_ns == ms * 1_000_000
    notes = [message for code, _, message in told if code == "AMX6792" and "WIRE_NOTE" in message]
    assert [told_of in message for message in notes] == [True] * bool(told_of)


def test_each_of_the_twenty_ticks_has_a_high_byte_of_its_own():
    """Which is why WIRE_NOTE2, whose meaning no page says, is not needed."""
    assert len({500 * number // 256 for number in range(1, 21)}) == 20


def test_what_has_no_place_stands_as_a_comment_with_file_and_record(plant):
    cards = [card(9, 50, DESC="GATEWAY"), {**card(3, 20), "REM_DROP": 2, "MAST_SLOT": 9}]
    variables = [
        {**point("FAR", 3, 1, 4), "MAST_SLOT": 9, "REM_DROP": 2},
        point("NOWHERE", 13, 0),
        memory("STEP", 8),
        memory("9LIVES"),
        memory("REF"),
    ]
    made, told = imported(plant(cards, variables=variables, line=SCAN.format("REF%, FAR@")))
    commons = {item.name: item.point for item in config_of(made.text).declared}
    assert commons == {"REF%": None, "FAR@": None, "NOWHERE%": None}
    lines = made.text.splitlines()
    assert "  FAR@: {}                           # $SWVAR.DBF record 2: slot 9, drop 2, slot there 3, register 1, bit 4; it is on remote I/O or a gateway" in lines  # fmt: skip # noqa: E501
    assert any(line.startswith("  # STEP: {}") and "record 4: STEP is a word of the language" in line for line in lines)
    assert any(line.startswith("  # 9LIVES%: {}") and "and no digit first" in line for line in lines)
    assert any(line.startswith("  # REF%: {}") and "record 6: the name is defined before" in line for line in lines)
    assert "  # $CARD.DBF record 4: module on remote I/O: mast_slot 9, drop 2, slot 3, part 20" in lines
    assert ("AMX6795", "$CARD.DBF record 4", "record 4: a module on remote I/O: the emulator has no remote I/O") in told


def test_a_point_that_its_module_does_not_have_becomes_a_plain_common(plant):
    """The reader of rack files says so: the importer has no rules of its own."""
    points = [point("A", 5, 9), point("B", 5, 0, 3), point("C", 5, 0, 3)]
    made, told = imported(plant([card(5, 20)], variables=points), parts={20: "57C419"})
    points = {item.name: item.point for item in config_of(made.text).declared}
    assert points == {"REF%": None, "A%": None, "B@": IoPoint(5, 0, 3), "C@": None}
    assert ("AMX6795", "$SWVAR.DBF record 2", "A% becomes a plain common of the rack file: register of I/O point A% is 9; it must be 0 to 3") in told  # fmt: skip # noqa: E501
    assert errors_of(made) == []


def test_types_are_those_that_tasks_declare_and_else_a_guess_that_is_told(plant):
    variables = [memory("FAST", 16), memory("SLOW", 8), memory("ODD", 7), memory("LOST", 6), memory("TEXT", STRING)]
    made, told = imported(plant(variables=variables, line=SCAN.format("REF%, FAST, ODD@")))
    names = [item.name for item in config_of(made.text).declared]
    assert names == ["REF%", "FAST", "SLOW", "ODD@", "TEXT$"]
    messages = {place: message for code, place, message in told if code == "AMX6792"}
    assert messages["$SWVAR.DBF record 2"] == "type code 16 is not known: taken for REAL, since LINE.BLK declares FAST"
    assert messages["$SWVAR.DBF record 3"].startswith("type code 8 is not known: taken for REAL by the row of powers")
    assert (
        messages["$SWVAR.DBF record 4"] == "type code 7 is not known: taken for BOOLEAN, since LINE.BLK declares ODD@"
    )
    assert messages["$SWVAR.DBF record 5"] == "type code 6 is not known, and no task declares one of its variables"
    assert "  # LOST: {}" in made.text


def test_a_string_without_a_length_gets_the_default_of_the_languages(plant):
    made, told = imported(plant(variables=[memory("A", STRING, CARD_TYPE=0), memory("B", STRING, CARD_TYPE=50)]))
    assert {item.name: item.length for item in config_of(made.text).declared} == {"REF%": 0, "A$": 31, "B$": 50}
    assert [message for *_, message in told if "31" in message] == [
        "A$ has no length of its own: it gets the default of tasks, 31; the Executive prints 32"
    ]


def test_tasks_that_are_not_run_stand_as_comments_and_ladder_becomes_a_stub(plant):
    tasks = [task("GONE", priority=6), task("TEST", priority=7, UTILITY=True), task("HEAD", kind="INC"),
             task("LOGIC", priority=8, kind="PC", DESC="INTERLOCKS"), task("LINE", priority=9)]  # fmt: skip
    files = {"TEST.BLK": SCAN.format("REF%"), "HEAD.INC": "LOCAL X%\n", "LOGIC.PC": b"\x00\x07PB_ON\x00\xffREF\x00NIL"}
    variables = [memory("PB_ON", 64), memory("OTHER")]
    made, told = imported(plant(tasks=tasks, files=files, variables=variables))
    assert [task.name for _, task in config_of(made.text).placed_tasks] == ["LINE", "LOGIC"]
    left_out = {place: message for code, place, message in told if code == "AMX6787"}
    assert left_out == {
        "$TASKS.DBF record 3": "task TEST is left out: a test task, which is not loaded with the others",
        "$TASKS.DBF record 4": "task HEAD is left out: an include file: it is written into the tasks that include it",
    }
    lost = [(place, message) for code, place, message in told if code == "AMX6789"]
    assert lost == [
        ("$TASKS.DBF record 6", "task LINE is defined before, by record 1: this one is left out"),
        ("$TASKS.DBF record 2", "task GONE is lost: GONE.BLK is not in the folder"),
    ]
    stub = made.sources["LOGIC.BAS"].decode()
    assert "COMMON REF%, PB_ON@\n" in stub
    assert "OTHER%" not in stub
    assert "LOGIC: {file: LOGIC.BAS, priority: 8} # a stub of LOGIC.PC: INTERLOCKS" in made.text
    assert sorted(made.sources) == ["LINE.BLK", "LOGIC.BAS"]


@pytest.mark.parametrize(
    ("tasks", "drives", "expected"),
    [
        ([task("WA", 10, 0)], {}, {"WA": "A"}),
        ([task("WA", 10, 0)], {"WA": "B"}, {"WA": "B"}),
        ([task("WB", 10, 1), task("WA", 10, 0)], {}, {"WA": "A", "WB": "B"}),
    ],
)
def test_drives_of_udc_tasks(plant, tasks, drives, expected):
    files = {f"{name}.BLK": SCAN.format("REF%") for name in expected}
    made, told = imported(plant([card(10, 40)], tasks, files=files), drives=drives)
    assert {task.name: task.drive for _, task in config_of(made.text).placed_tasks if task.drive} == expected
    guessed = [message for code, _, message in told if code == "AMX6792" and "drive" in message]
    assert len(guessed) == (0 if drives else len(tasks))


def test_fields_that_the_user_names(tmp_path):
    fields = [("SIGNAL", "C", 16), ("KIND", "N", 3), *[item for item in SWVAR if item[0] not in ("NAME", "REGISTER")],
              ("ADDR", "N", 5), ("RESERVED", "N", 2)]  # fmt: skip
    folder = rack(tmp_path / "PM1", [card(0, 1), processor(), card(5, 20)], [task("LINE")], [],
                  {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    rows = [{**point("REF", 5, 0), "SIGNAL": "REF", "ADDR": 1, "RESERVED": 4}]
    (folder / "$SWVAR.DBF").write_bytes(table(fields, rows))
    made, told = imported(folder, parts={20: "57C419"})
    assert ("AMX6789", "$SWVAR.DBF", "no field is known to be the name: the 1 records cannot be used") in told
    assert made.commons == 0
    choices = [field_choice("name=signal"), field_choice("SWVAR.register=ADDR")]
    made, told = imported(folder, parts={20: "57C419"}, fields=choices)
    assert config_of(made.text).declared[0].point == IoPoint(5, 1)
    assert [message for code, _, message in told if code == "AMX6793"] == [
        "field KIND N(3) is not understood: it is blank throughout",
        "field RESERVED N(2) is not understood: it holds '4'",
    ]
    _, told = imported(folder, fields=[*choices, field_choice("bit=BITS")])
    assert ("AMX6793", "$SWVAR.DBF", "the table has no field 'BITS', which --field names for bit") in told
    assert ("AMX6793", "$SWVAR.DBF", "no field is known to be the bit of variables") in told


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("register", "is not a key and a field"),
        ("register=", "is not a key"),
        ("regster=X", "is nothing that $SWVAR has"),
        ("CARDS.slot=X", "there is no table 'CARDS'"),
    ],
)
def test_wrong_choices_of_fields(text, message):
    with pytest.raises(UserError) as caught:
        field_choice(text)
    assert message in caught.value.message


def test_subscripts_come_from_the_tasks_where_no_field_has_them(tmp_path):
    fields = [item for item in SWVAR if item[0] != "DIM1"]
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE")], [], {"LINE.BLK": SCAN.format("T%(7)")})
    (folder / "$SWVAR.DBF").write_bytes(table(fields, [memory("T")]))
    made, _ = imported(folder)
    assert config_of(made.text).declared[0].dimensions == (8,)


def test_numbers_that_are_none_are_told_once_for_a_field(plant):
    folder = plant([card(5, 20)], variables=[point("A", 5, 0), point("B", 5, 1), memory("C")])
    data = (folder / "$SWVAR.DBF").read_bytes()
    path = folder / "$SWVAR.DBF"
    assert data.count(b" 5    0-1") == 1
    path.write_bytes(data.replace(b" 5    0-1", b" 5*****-1"))
    made, told = imported(folder, parts={20: "57C419"})
    message = "REGISTER of record 2 is not a number, but '*****': taken as blank"
    assert ("AMX6792", "$SWVAR.DBF record 2", message) in told
    assert "A%: {}" in made.text
    assert "its slot or its register is not known" in made.text


def test_tables_that_are_missing_or_no_tables_are_errors_and_the_others_are_read(plant):
    folder = plant()
    (folder / "$SWVAR.DBF").unlink()
    (folder / "$CARD.DBF").write_bytes(b"NOT A TABLE")
    made, told = imported(folder)
    assert [(code, place) for code, place, _ in told if code == "AMX6789"] == [
        ("AMX6789", "$CARD.DBF"), ("AMX6789", "$SWVAR.DBF")
    ]  # fmt: skip
    assert [(module.slot, module.model) for module in config_of(made.text).modules] == [(0, "57C413"), (1, "57C435")]


def test_net_files_are_quoted_next_to_variables_that_have_no_place(plant):
    folder = plant(variables=[point("THERE", 13, 0)], files={"MILL.NET": "10 THERE% DROP 3 REG 40\n"})
    made, _ = imported(folder)
    assert "slot 13, register 0; MILL.NET line 1: 10 THERE% DROP 3 REG 40; its slot has no module" in made.text
    assert "#   MILL.NET: where variables of networks lie, of version 2" in made.text


def test_include_files_are_written_into_the_tasks(plant):
    line = "10 COMMON REF%\n15 INCLUDE 'HEAD.INC'\n20 CALL SCAN_LOOP(TICKS=4)\n30 X% = REF%\n40 END\n"
    made, _ = imported(plant(line=line, files={"HEAD.INC": "LOCAL X%\n"}))
    assert made.sources["LINE.BLK"].decode().splitlines()[1:3] == ["15 ! INCLUDE HEAD.INC", "16 LOCAL X%"]


def test_what_stands_in_several_files_is_named_at_the_end(plant):
    files = {"LINE.OBJ": b"\0", "DRIVE.POB": b"\0", "LINE.XRF": "X", "OLD.BLK": "10 END\n", "$CARD.NDX": b"\0"}
    made, _ = imported(plant(files=files))
    tail = made.text.partition("# Files of the old rack that were not used:\n")[2].splitlines()
    assert tail == [
        "#   DRIVE.POB: compiled parameters of a UDC's drives",
        "#   LINE.OBJ: a compiled task",
        "#   LINE.XRF: a cross reference",
        "#   OLD.BLK: a source that no record of $TASKS names",
    ]


@given(st.integers(0, 2**32))
@settings(max_examples=60, deadline=None, derandomize=True, database=None)
def test_a_damaged_library_is_imported_or_refused_by_the_typed_error(tmp_path_factory, seed):
    """Bytes of any table, changed, cut or doubled: the rack file that comes out is one, or its errors are counted."""
    chance = random.Random(seed)
    folder = tmp_path_factory.mktemp("damaged")
    shutil.copytree(SAMPLE, folder, dirs_exist_ok=True)
    for path in sorted(folder.rglob("$*.DBF")):
        data = bytearray(path.read_bytes())
        for _ in range(chance.choice((0, 0, 1, 5, 40))):
            data[chance.randrange(len(data))] = chance.choice((0, 0x1A, 0x20, 0x2A, 0x31, chance.randrange(256)))
        path.write_bytes(data[: chance.choice((len(data), len(data), chance.randrange(len(data) + 1)))])
    findings = Findings()
    try:
        made = import_rack(chosen_rack(folder, None), Choices(parts=PARTS), findings)
    except UserError:
        return
    result = load_stored(SourceText("rack.yaml", made.text), folder / "rack.yaml")
    assert (result.config is None) == bool(errors_of(made))
    assert {item.code for item in errors_of(made)} <= {"AMX6205", "AMX6206", "AMX6207", "AMX6209", "AMX6302", "AMX6409"}


NAMES = st.text(alphabet="ABX_19 %@$()", min_size=0, max_size=6)
SMALL = st.integers(-2, 18)
ANY_VARIABLE = st.fixed_dictionaries(
    {"NAME": NAMES, "VAR_TYPE": st.sampled_from((8, 16, 32, 64, 128, 5)), "CARD_TYPE": st.integers(0, 300),
     "DEF_TYPE": st.integers(0, 4), "MAST_SLOT": SMALL, "REM_DROP": st.sampled_from((0, 0, 0, 1, 60)), "SLOT": SMALL,
     "REGISTER": st.sampled_from((0, 1, 2, 5, 64, 302, 2000, 70000)), "BIT": SMALL, "DIM1": st.sampled_from((0, 0, 7)),
     GONE: st.booleans()}
)  # fmt: skip
CODES = (1, 2, 10, 20, 21, 40, 99)
ANY_CARD = st.fixed_dictionaries(
    {"SLOT": SMALL, "MAST_SLOT": SMALL, "REM_DROP": st.sampled_from((0, 0, 1)), "CARD_PART": st.sampled_from(CODES),
     "NETWORK": st.sampled_from(("", "A", "?")), "NET_DEPTH": SMALL, "NET_DROP": SMALL, "WIRE_NOTE1": SMALL,
     "DESC": st.sampled_from(("", "57C419", "X: #'\"{", "57C430"))}
)  # fmt: skip
ANY_TASK = st.fixed_dictionaries(
    {"NAME": NAMES, "TYPE": st.sampled_from(("BLK", "BAS", "PC", "INC", "?")), "SLOT": SMALL, "PRIORITY": SMALL,
     "UTILITY": st.booleans(), "CRITICAL": st.booleans()}
)  # fmt: skip


@given(st.lists(ANY_CARD, max_size=8), st.lists(ANY_TASK, max_size=5), st.lists(ANY_VARIABLE, max_size=10))
@settings(max_examples=80, deadline=None, derandomize=True, database=None)
def test_whatever_the_records_say_only_errors_of_processors_stay(tmp_path_factory, cards, tasks, variables):
    folder = tmp_path_factory.mktemp("any") / "PM1"
    folder.mkdir()
    for name, fields, rows in (("CARD", CARD, cards), ("TASKS", TASKS, tasks), ("SWVAR", SWVAR, variables)):
        (folder / f"${name}.DBF").write_bytes(table(fields, rows))
    made, _ = imported(folder, parts=PARTS)
    assert {item.code for item in errors_of(made)} <= {"AMX6205", "AMX6206", "AMX6207", "AMX6209"}, made.text


def test_a_description_that_is_too_long_is_cut_and_told(tmp_path):
    fields = [(name, kind, 254 if name == "DESC" else length) for name, kind, length in SWVAR]
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE")], [], {"LINE.BLK": READS_REF})
    (folder / "$SWVAR.DBF").write_bytes(table(fields, [memory("REF", DESC="X" * 254), memory("B", DESC="Y" * 200)]))
    made, told = imported(folder)
    texts = {item.name: item.description for item in config_of(made.text).declared}
    assert texts == {"REF%": "X" * 197 + "...", "B%": "Y" * 200}
    message = "record 1: the end of the description, which has more than 200 characters, is left out"
    assert [item for item in told if "description" in item[2]] == [("AMX6795", "$SWVAR.DBF record 1", message)]


@pytest.mark.parametrize("kind", ["INC", "?"])
def test_an_include_file_of_a_tasks_name_does_not_hide_the_task(plant, kind):
    folder = plant(tasks=[task("T1", kind=kind), task("T1", priority=6), task("T1", kind=kind)],
                   files={"T1.BLK": READS_REF, "T1.INC": "!\n"})  # fmt: skip
    made, told = imported(folder)
    assert [task.name for _, task in config_of(made.text).placed_tasks] == ["LINE", "T1"]
    assert ("AMX6789", "$TASKS.DBF record 4", "task T1 is defined before, by record 2: this one is left out") in told


def test_a_source_with_the_name_of_a_stub_is_told_as_not_used(plant):
    files = {"LAD.PC": b"\0REF\0", "LAD.XRF": "REF\n", "LAD.BAS": "10 END\n"}
    made, _ = imported(plant(tasks=[task("LAD", kind="PC", priority=6)], files=files))
    assert b"STUB OF THE LADDER TASK LAD.PC" in made.sources["LAD.BAS"]
    tail = made.text.partition("# Files of the old rack that were not used:\n")[2].splitlines()
    assert tail == ["#   LAD.BAS: a source that no record of $TASKS names"]


def test_a_stub_that_declares_only_the_first_of_very_many_variables_says_so(plant):
    names = [f"V{number}" for number in range(MOST_DECLARED + 1)]
    folder = plant(tasks=[task("LAD", kind="PC", priority=6)], variables=[memory(name) for name in names],
                   files={"LAD.PC": " ".join(names)})  # fmt: skip
    made, told = imported(folder)
    stub = made.sources["LAD.BAS"].decode()
    assert (stub.count("%"), f"V{MOST_DECLARED - 1}%" in stub) == (MOST_DECLARED, True)
    message = "LAD.PC name 2001 variables, of which only the first 2000 are declared"
    assert [message in text for _, place, text in told if place == "$TASKS.DBF record 2"] == [True]


def test_sources_and_include_files_in_utf_16_are_read(plant):
    line = "10 COMMON REF% ! GR\u00dcN\n15 INCLUDE HEAD\n20 CALL SCAN_LOOP(TICKS=4)\n30 X% = REF%\n40 END\n"
    files = {"HEAD.INC": "LOCAL X% ! \u00dc\n".encode("utf-8-sig"), "B.INC": "LOCAL Y%\n".encode("utf-16")}
    made, told = imported(plant(line=line.replace("15 INC", "12 INCLUDE B\n15 INC").encode("utf-16"), files=files))
    assert made.sources["LINE.BLK"].decode().splitlines()[:5] == [
        "10 COMMON REF% ! GR\u00dcN", "12 ! INCLUDE B.INC", "13 LOCAL Y%", "15 ! INCLUDE HEAD.INC",
        "16 LOCAL X% ! \u00dc",
    ]  # fmt: skip
    assert [item for item in told if item[0] == "AMX6789"] == []


def test_links_of_net_files_out_of_the_folder_are_not_followed(plant, tmp_path):
    folder = plant(variables=[point("THERE", 13, 0)])
    (tmp_path / "SECRET").write_text("THERE% SECRET\n")
    (folder / "A.NET").symlink_to(tmp_path / "SECRET")
    made, told = imported(folder)
    assert "SECRET" not in made.text
    assert ("AMX6795", "A.NET", "the file is a link out of the folder: not read") in told
