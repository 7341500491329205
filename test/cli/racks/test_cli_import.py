"""`automax import`: a rack file that passes the check, and what could not be read."""

from __future__ import annotations

import pytest

from automax_ros.rackfile.loader import load

CNF = """\
10 IODEF START_PB@[SLOT=5, REGISTER=0, BIT=3]
20 IODEF LAMP@[SLOT=6, REGISTER=0, BIT=0]
30 NVMEMDEF PRESET%
40 TASK SPEED[TYPE=BLK, SLOT=1, PRIORITY=5, CRITICAL=TRUE]
50 TASK LOGIC[TYPE=PC, SLOT=1, PRIORITY=6]
60 TASK GONE[SLOT=2, PRIORITY=11]
"""
SPEED = "10 COMMON START_PB@, LAMP@\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL AND(INPUT1=START_PB@, OUTPUT=LAMP@)\n40 END\n"


@pytest.fixture
def plant(automax):
    automax.write("SPEED.BLK", SPEED.replace("INPUT1=START_PB@,", "INPUT1=START_PB@, INPUT2=START_PB@,"))
    automax.write("LINE1.CNF", CNF)
    return automax


def test_a_rack_file_that_passes_the_check(plant):
    result = plant("import", "LINE1.CNF", "--output", "rack.yaml", "--module", "5=57C419", "--module", "6=57c403b")
    assert (result.code, result.out) == (0, "wrote rack.yaml: 3 tasks, 3 commons\n")
    assert "LINE1.CNF:5:1: warning[AMX6787]: task LOGIC is left out: LOGIC.PC: tasks of this kind are not run" in (
        result.err
    )
    assert "LINE1.CNF:6:1: warning[AMX6787]: task GONE is left out: GONE.BLK is not in the folder" in result.err
    checked = plant("check", "rack.yaml")
    assert (checked.code, checked.err) == (0, "")
    assert "warning[AMX6497]: the common PRESET% (line 20) is used by no task\n" in checked.out
    assert checked.out.count("[AMX") == 1
    config = load(plant.folder / "rack.yaml").config
    assert (config.name, config.executive) == ("LINE1", 21)
    assert [(item.slot, item.model) for item in config.modules] == [
        (0, "57C413"), (1, "57C430A"), (2, "57C430A"), (5, "57C419"), (6, "57C403")
    ]  # fmt: skip
    assert [(task.name, task.priority, task.critical) for _, task in config.placed_tasks] == [("SPEED", 5, True)]
    points = {item.name: (item.point, item.non_volatile) for item in config.declared}
    assert (points["START_PB@"][0].slot, points["LAMP@"][0].bit, points["PRESET%"]) == (5, 0, (None, True))


def test_without_modules_points_are_plain_commons_and_modules_are_proposed(plant):
    result = plant("import", "LINE1.CNF")
    assert result.code == 0
    assert "  START_PB@: {}                      # slot: 5, register: 0, bit: 3\n" in result.out
    line = next(line for line in result.out.splitlines() if line.startswith("  # 5: {module: }"))
    assert line.split("#")[2].startswith(" generic, registers up to 0: 57C402, ")
    assert "57C419" in line
    assert not (plant.folder / "rack.yaml").exists()


def test_lines_that_cannot_be_read_are_told_and_give_exit_code_1(plant):
    plant.write("LINE1.CNF", "5 FOODEF A%\n" + CNF)
    result = plant("import", "LINE1.CNF", "--output", "rack.yaml")
    assert result.code == 1
    assert "LINE1.CNF:1:3: error[AMX6780]: 'FOODEF' is not a statement" in result.err
    assert plant("check", "rack.yaml").code == 0


def test_a_point_that_the_module_does_not_have_is_told(plant):
    plant.write("LINE1.CNF", "10 IODEF A%[SLOT=5, REGISTER=9]\n")
    result = plant("import", "LINE1.CNF", "--module", "5=57C419")
    assert result.code == 1
    assert "error[AMX6421]: register of I/O point A% is 9; it must be 0 to 3" in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["NONE.CNF"], "NONE.CNF cannot be read"),
        (["SPEED.BLK"], "SPEED.BLK is not a configuration task"),
        (["BIG.CNF"], "BIG.CNF has more than 1000000 bytes"),
        (["LINE1.CNF", "--module", "57C419"], "'57C419' is not a slot and a module"),
        (["LINE1.CNF", "--module", "16=57C419"], "'16=57C419' is not a slot and a module"),
        (["LINE1.CNF", "--module", "5=57C999"], "the emulator has no such module"),
        (["LINE1.CNF", "--part", "5=57C419"], "--part is for the folder of a disk, and LINE1.CNF is not a folder"),
        (["LINE1.CNF", "--headers"], "--headers is for the folder of a disk"),
        (["LINE1.CNF", "--output", "there.yaml"], "there.yaml exists already"),
        (["LINE1.CNF", "--output", "rack.txt"], "a rack file ends in .yaml or .yml"),
    ],
)
def test_wrong_usage(plant, arguments, message):
    plant.write("BIG.CNF", "10 REM " + "X" * 1_000_000)
    plant.write("there.yaml", "precious")
    result = plant("import", *arguments)
    assert (result.code, message in result.err) == (2, True)
    assert (plant.folder / "there.yaml").read_text() == "precious"


@pytest.mark.parametrize(("register", "models"), [(4136, "57C406"), (4135, "none that the emulator has")])
def test_the_registers_of_a_drive_are_recognised(plant, register, models):
    plant.write("LINE1.CNF", f"10 IODEF TLD%[SLOT=7, REGISTER={register}]\n" + CNF)
    result = plant("import", "LINE1.CNF")
    assert f"generic, registers up to {register}: {models}\n" in result.out


def test_a_network_variable_stands_on_its_57c404(plant):
    """NETDEF names slot, drop and register; which drop the rack is, no line of the old configuration says."""
    plant.write(
        "LINE1.CNF",
        "10 NETDEF REF%[SLOT=9, DROP=2, REGISTER=32]\n20 NETDEF THERE@[SLOT=9, DROP=2, REGISTER=1, BIT=3]\n"
        "30 MEMDEF START_PB@, LAMP@\n40 TASK SPEED[TYPE=CONTROL, SLOT=1, PRIORITY=5]\n",
    )
    result = plant("import", "LINE1.CNF", "--output", "rack.yaml")
    assert (result.code, result.err) == (0, "")
    assert "  9: {module: 57C404, network: NET, drop: 0}" in (plant.folder / "rack.yaml").read_text()
    config = load(plant.folder / "rack.yaml").config
    assert [task.name for _, task in config.placed_tasks] == ["SPEED"]
    points = {item.name: item.point for item in config.declared if item.point is not None}
    assert {name: (point.slot, point.register, point.bit) for name, point in points.items()} == {
        "REF%": (9, 2 * 64 + 32, None), "THERE@": (9, 2 * 64 + 1, 3)
    }  # fmt: skip


@pytest.mark.parametrize(("word", "file"), [("CONTROL", "ONE.BLK"), ("BASIC", "ONE.BAS"), ("BLK", "ONE.BLK")])
def test_types_of_tasks_in_words(automax, word, file):
    automax.write(
        file, "10 LOCAL A%\n20 A% = 1\n30 END\n" if word == "BASIC" else "10 CALL SCAN_LOOP(TICKS=2)\n20 END\n"
    )
    automax.write("R.CNF", f"10 TASK ONE[TYPE={word}, SLOT=1, PRIORITY=5]\n")
    assert automax("import", "R.CNF", "--output", "r.yaml").code == 0
    ((_, task),) = load(automax.folder / "r.yaml").config.placed_tasks
    assert task.file.name == file


def test_a_variable_named_like_a_word_of_the_language_is_told_and_left_out(automax):
    """No task could use it, and the rack file would have an error; the others of its line are there."""
    automax.write("R.CNF", "10 MEMDEF END, A%, STEP, TO%\n")
    result = automax("import", "R.CNF", "--output", "r.yaml")
    assert result.code == 1
    assert "R.CNF:1:11: error[AMX6401]: END is a word of the language" in result.err
    assert result.err.count("error[") == 2
    assert [item.name for item in load(automax.folder / "r.yaml").config.declared] == ["A%", "TO%"]
