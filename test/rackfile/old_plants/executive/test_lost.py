"""What an import loses is an error that names file and record; what it only guesses or lacks a place for is not."""

from __future__ import annotations

import shutil

import pytest

from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.rackfile.old_plants.executive.fields import field_choice
from automax_ros.rackfile.old_plants.executive.findings import MOST_FINDINGS, Findings, Unplaced
from automax_ros.rackfile.old_plants.executive.folders import chosen_rack
from automax_ros.rackfile.old_plants.executive.importing import Choices, import_rack
from rackfile.old_plants.executive.disks import SAMPLE, SCAN, card, memory, point, processor, rack, table, task
from rackfile.old_plants.executive.disks import TASKS as TASK_FIELDS

PARTS = {1: "57C413", 2: "57C435", 3: "57C431", 10: "57C404", 20: "57C419", 21: "57C403", 22: "57C409", 40: "57552"}


@pytest.fixture
def floppy(tmp_path):
    return shutil.copytree(SAMPLE, tmp_path / "floppy")


@pytest.fixture
def wind1(floppy):
    return floppy / "AMXLIB" / "MILL" / "WIND1"


def imported(folder, parts=PARTS, **choices):
    findings = Findings()
    made = import_rack(chosen_rack(folder, None), Choices(parts=parts, **choices), findings)
    return made, findings


def lost(findings):
    return [(item.place, item.message) for item in findings.items if item.severity is Severity.ERROR]


def replace(path, old, new):
    data = path.read_bytes()
    assert data.count(old) == 1
    path.write_bytes(data.replace(old, new))


def cut_after_whole_records(path, count):
    """Cut a table in the middle of the record after ``count`` whole ones."""
    data = path.read_bytes()
    header, width = int.from_bytes(data[8:10], "little"), int.from_bytes(data[10:12], "little")
    path.write_bytes(data[: header + count * width + width // 2])


def test_the_sample_loses_nothing():
    _, findings = imported(SAMPLE)
    assert (lost(findings), findings.has_errors) == ([], False)


@pytest.mark.parametrize(
    ("choices", "task_name", "record", "slot", "model"),
    [
        ({"parts": PARTS | {2: "57C419"}}, "LINE", 1, 1, "57C419"),
        ({"modules": {1: "57C419"}}, "LINE", 1, 1, "57C419"),
        ({"parts": PARTS | {3: "57C402"}}, "SECT1", 2, 2, "57C402"),
    ],
)
def test_a_task_in_the_slot_of_a_module_that_runs_none_is_lost(floppy, choices, task_name, record, slot, model):
    made, findings = imported(floppy, **choices)
    why = f"it stands in slot {slot}, and a {model} runs no tasks"
    assert lost(findings) == [(f"$TASKS.DBF record {record}", f"task {task_name} is lost: {why}")]
    assert made.tasks == 2
    lines = made.text.splitlines()
    comment = next(line for line in lines if line.startswith(f"    # {task_name}: {{priority: "))
    assert comment.endswith(why)
    assert lines[lines.index(comment) - 1].startswith(f"  {slot}: {{module: {model}}}")


def test_a_task_in_the_slot_of_a_module_that_is_a_comment_is_lost(floppy):
    _, findings = imported(floppy, modules={1: "57C416"})
    assert [place for place, _ in lost(findings)] == ["$TASKS.DBF record 1"]
    assert "the module of slot 1, where it stands, is left out: " in lost(findings)[0][1]


@pytest.mark.parametrize("name", ["PRIXXXXX", "PRIORITX"])
def test_without_the_field_of_the_priority_no_task_is_taken_for_anything(floppy, wind1, name):
    replace(wind1 / "$TASKS.DBF", b"PRIORITY", name.encode())
    made, findings = imported(floppy, {key: value for key, value in PARTS.items() if key != 2})
    told = [(item.message, item.hint) for item in findings.items if item.code == "AMX6789"]
    message = "no field is known to be the priority: the 3 records cannot be used"
    assert told == [(message, f"name the field: --field TASKS.priority={name}")]
    assert made.tasks == 0
    assert "57552" not in "".join(item.message for item in findings.items if "slot 1:" in item.message)
    made, findings = imported(floppy, fields=[field_choice(f"TASKS.priority={name}")])
    assert (made.tasks, findings.has_errors) == (3, False)


def test_a_task_without_a_priority_is_no_task_of_a_udc(tmp_path):
    """It may be one of a Processor's, whose priority is damaged: where its module is not known, it is lost."""
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE", priority=None)],
                  files={"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    made, findings = imported(folder, {})
    assert made.tasks == 0
    (place, message), = lost(findings)  # fmt: skip
    assert place == "$TASKS.DBF record 1"
    assert "which module it is, is not known" in message
    _, findings = imported(folder)
    assert [(place, "priority of task 'LINE' must be a whole number" in text) for place, text in lost(findings)] == [
        ("$TASKS.DBF record 1", True)
    ]


def test_a_priority_that_is_a_drive_makes_a_task_of_a_udc_in_any_slot(tmp_path):
    fields = [(name, "C" if name == "PRIORITY" else kind, length) for name, kind, length in TASK_FIELDS]
    folder = rack(tmp_path / "PM1", [card(0, 1), card(3, 40)], files={"WA.BLK": SCAN.format("REF%")})
    (folder / "$TASKS.DBF").write_bytes(table(fields, [task("WA", 3, "B")]))
    made, findings = imported(folder, {1: "57C413"})
    assert "    module: 57552 " in made.text
    assert "      WA: {drive: B}" in made.text
    assert lost(findings) == []


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (None, "is not in the folder"),
        (b"", "is empty"),
        (b"\r\n  \x1a\0\0\0", "is empty"),
        (b"\0" * 512, "is empty"),
        (bytes(value for value in range(256) if value != 0x1A) * 8, "is not text"),
    ],
)
def test_a_task_whose_source_cannot_be_read_is_lost(floppy, wind1, data, fault):
    (wind1 / "SECT1.BLK").unlink()
    if data is not None:
        (wind1 / "SECT1.BLK").write_bytes(data)
    made, findings = imported(floppy)
    assert lost(findings) == [("$TASKS.DBF record 2", f"task SECT1 is lost: SECT1.BLK {fault}")]
    assert (made.tasks, "SECT1.BLK" in made.sources) == (2, False)
    assert "SECT1.BLK: a source that no record" not in made.text


@pytest.mark.parametrize(("name", "told"), [("LOGIC.PC", []), ("LOGIC.XRF", ["$TASKS.DBF record 2"])])
def test_a_ladder_task_without_its_file_is_lost_and_has_a_stub_all_the_same(tmp_path, name, told):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE"), task("LOGIC", kind="PC")],
                  [memory("REF")], {"LINE.BLK": SCAN.format("REF%"), name: b"\0REF\0"})  # fmt: skip
    made, findings = imported(folder)
    assert ([place for place, _ in lost(findings)], made.tasks) == (told, 2)
    assert "COMMON REF%" in made.sources["LOGIC.BAS"].decode()


def test_an_include_file_that_is_not_there_is_lost(tmp_path):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE"), task("HEAD", kind="INC")],
                  files={"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    assert lost(imported(folder)[1]) == [("$TASKS.DBF record 2", "task HEAD is lost: HEAD.INC is not in the folder")]


def test_some_control_characters_in_remarks_are_no_fault_of_a_source(floppy, wind1):
    path = wind1 / "SECT1.BLK"
    path.write_bytes(b"5 ! \x0e\x1bESECTION\x0f\r\n" + path.read_bytes())
    made, findings = imported(floppy)
    assert (made.tasks, lost(findings)) == (3, [])


def test_a_variable_whose_name_is_damaged_is_lost(floppy, wind1):
    replace(wind1 / "$SWVAR.DBF", b"START_PB", b"START-PB")
    made, findings = imported(floppy)
    (place, message), = lost(findings)  # fmt: skip
    assert place == "$SWVAR.DBF record 6"
    assert message.startswith("record 6: no rack file can declare START-PB@: ")
    assert made.commons == 11
    assert "  # START-PB@: {" in made.text


def test_names_that_occur_twice_are_lost(tmp_path):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor()], [task("LINE"), task("LINE", priority=6)],
                  [memory("REF"), memory("REF")], {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    _, findings = imported(folder)
    assert [place for place, _ in lost(findings)] == ["$TASKS.DBF record 2", "$SWVAR.DBF record 2"]


def test_modules_and_tasks_without_a_slot_are_lost(tmp_path):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor(), card(5, 20), card(5, 21)], [task("LINE", None)],
                  files={"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    _, findings = imported(folder)
    assert sorted(place for place, _ in lost(findings)) == ["$CARD.DBF record 4", "$TASKS.DBF record 1"]


@pytest.mark.parametrize("name", ["SYSTEM", "SECT", "RACK", "NET"])
def test_a_table_of_the_system_that_is_missing_is_an_error(floppy, wind1, name):
    (wind1.parent / f"${name}.DBF").unlink()
    _, findings = imported(floppy)
    (place, message), = lost(findings)  # fmt: skip
    assert place == f"${name}.DBF"
    assert message.startswith("the system's folder has no such file: ")


def test_a_rack_whose_system_was_not_copied_is_told(floppy, wind1):
    for name in ("SYSTEM", "SECT", "RACK", "NET"):
        (wind1.parent / f"${name}.DBF").unlink()
    _, findings = imported(floppy)
    assert lost(findings) == []
    message = "the folder above the rack has none of its system's tables: they were not copied with it"
    assert ("AMX6795", "WIND1", message) in [(item.code, item.place, item.message) for item in findings.items]


@pytest.mark.parametrize(("name", "what"), [("IORACK", "remote racks"), ("PARAM", "parameters of a UDC's drives")])
def test_tables_that_only_make_comments_may_be_missing_and_are_told(floppy, wind1, name, what):
    (wind1 / f"${name}.DBF").unlink()
    _, findings = imported(floppy)
    assert lost(findings) == []
    message = f"the rack's folder has no such file: {what}, if there are any, are missing"
    assert ("AMX6795", f"${name}.DBF", message) in [(item.code, item.place, item.message) for item in findings.items]


def test_a_table_that_is_cut_counts_the_cut_record_and_blames_no_part_code(floppy, wind1):
    cut_after_whole_records(wind1 / "$CARD.DBF", 2)
    _, findings = imported(floppy)
    count = int.from_bytes((wind1 / "$CARD.DBF").read_bytes()[4:8], "little")
    message = f"the header says {count} records, the file holds 2 and a part of one: {count - 3} are missing"
    assert ("$CARD.DBF", message) in lost(findings)
    told = [item.message for item in findings.items]
    assert not any("no module has this code" in text for text in told)
    assert not any("it is on remote I/O" in text for text in told)
    assert any("its slot has no module; with its drop it is on a network, remote I/O or a gateway" in t for t in told)


def test_a_file_that_is_no_table_is_one_error(floppy, wind1):
    """Garbage read as a list of fields says nothing of fields."""
    names = b"".join(bytes((0x80 + number,)) * 11 + b"?" + b"\x05" * 20 for number in range(100))
    (wind1 / "$SWVAR.DBF").write_bytes(b"PK\x03\x04" + b"\x14" * 28 + names)
    _, findings = imported(floppy)
    (found,) = [item for item in findings.items if item.file == "$SWVAR.DBF"]
    assert found.code == "AMX6789"
    assert found.message.startswith("the first byte is 50h, not the 03h of dBASE III; the header is cut")


def test_hints_name_only_what_can_be_said(floppy, wind1):
    _, findings = imported(floppy, {}, fields=[field_choice("CARD.part=DESC")])
    hints = [item.hint for item in findings.items if item.hint and item.hint.startswith("read its")]
    assert hints[0] == "read its number on the module: --module 6=NUMBER"
    assert not any("None" in hint for hint in hints)
    (wind1 / "$TASKS.DBF").unlink()
    _, findings = imported(floppy, {})
    (found,) = [item for item in findings.items if item.message.startswith("slot 1: ")]
    assert found.message.endswith("is not known; no task, network or variable of its slot says it")
    assert found.hint == "read its number on the module: --part 2=NUMBER, or --module 1=NUMBER"


def test_choices_that_fit_nothing_are_told(floppy):
    _, findings = imported(floppy, modules={3: "57C419"}, drives={"LINE": "B"})
    told = [(item.place, item.message) for item in findings.items if item.code == "AMX6794"]
    assert told == [
        ("$CARD.DBF", "--module 3=57C419: no record has slot 3; the module is added"),
        ("$TASKS.DBF", "--drive 'LINE': it is not a task of a UDC"),
    ]


def test_errors_after_the_most_findings_still_count():
    findings = Findings()
    for number in range(MOST_FINDINGS):
        findings.add("AMX6791", "deleted", "A.DBF", number)
    assert not findings.has_errors
    findings.add("AMX6789", "lost", "A.DBF")
    assert (findings.left_out, findings.has_errors) == (1, True)
    both = Findings()
    both.extend(findings)
    assert (len(both.items), both.left_out, both.errors) == (MOST_FINDINGS, 1, 1)


def test_records_of_one_reason_are_told_together():
    findings, unplaced = Findings(), Unplaced()
    for number in (2, 5):
        unplaced.add("A.DBF", "no place", number)
    unplaced.add("A.DBF", "no name", 3, lost=True)
    unplaced.tell(findings)
    assert [(item.code, item.place, item.message) for item in findings.items] == [
        ("AMX6795", "A.DBF record 2", "records 2, 5: no place"), ("AMX6789", "A.DBF record 3", "record 3: no name")
    ]  # fmt: skip
    assert PROBLEMS["AMX6789"].severity is Severity.ERROR


def test_a_point_that_its_module_does_not_have_loses_its_place_alone(tmp_path):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor(), card(5, 20)], [task("LINE")],
                  [memory("REF"), point("A", 5, 9)], {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    made, findings = imported(folder)
    assert (made.commons, lost(findings)) == (2, [])


def test_hints_of_guesses_and_of_slots_that_no_option_names(tmp_path):
    folder = rack(tmp_path / "PM1", [card(0, 1), processor(), card(20, None)], [task("LINE")], [memory("REF")],
                  {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    _, findings = imported(folder, {})
    hints = {item.place: item.hint for item in findings.items if item.code == "AMX6794"}
    assert hints == {
        "$CARD.DBF record 1": "if it is another: --part 1=NUMBER, or --module 0=NUMBER",
        "$CARD.DBF record 2": "if it is another: --part 2=NUMBER, or --module 1=NUMBER",
        "$CARD.DBF record 3": None,
    }
