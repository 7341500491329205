"""`automax convert`: shows a diff, writes only when told, keeps the old file."""

from __future__ import annotations

import pytest

OLD = b"10 local out%\r\n20 CALL SCAN_LOOP(TICKS=4)\r\n30 CALL LAG(INPUT=OUT%, WLG=2, OUTPUT=OUT%)\r\n40 END\r\n\x1a"
NEW = b"10 LOCAL OUT%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL LAG(INPUT=OUT%, WLG=2.0, OUTPUT=OUT%)\n40 END\n"
NOTES = (
    "SPEED.BLK: Ctrl-Z and the 0 characters after it left out, 4 line ends written as LF, 1 lower-case line, "
    "1 decimal point\n"
)


@pytest.fixture
def old(automax):
    return automax.write("SPEED.BLK", OLD)


def test_a_diff_and_nothing_written(automax, old):
    result = automax("convert", old)
    assert result.code == 0
    assert result.out == (
        "--- SPEED.BLK\n+++ SPEED.BLK (converted)\n@@ -1,5 +1,5 @@\n"
        "-10 local out%\n+10 LOCAL OUT%\n 20 CALL SCAN_LOOP(TICKS=4)\n"
        "-30 CALL LAG(INPUT=OUT%, WLG=2, OUTPUT=OUT%)\n+30 CALL LAG(INPUT=OUT%, WLG=2.0, OUTPUT=OUT%)\n 40 END\n \n"
    )
    assert result.err == NOTES + "nothing was written; --write or --output DIR writes the 1 converted file\n"
    assert (automax.folder / old).read_bytes() == OLD
    assert [path.name for path in automax.folder.iterdir()] == ["SPEED.BLK"]


def test_write_keeps_the_old_file(automax, old):
    assert automax("convert", old, "--write").code == 0
    assert (automax.folder / old).read_bytes() == NEW
    assert (automax.folder / "SPEED.BLK.orig").read_bytes() == OLD
    assert automax("check", old) == (0, "", "")
    again = automax("convert", old, "--write")
    assert again == (0, "", "SPEED.BLK: nothing to change\n")


def test_write_never_over_an_older_file_that_was_kept(automax, old):
    automax.write("SPEED.BLK.orig", b"precious")
    result = automax("convert", old, "--write")
    assert result.code == 2
    assert "SPEED.BLK.orig cannot be written: File exists" in result.err
    assert (automax.folder / old).read_bytes() == OLD
    assert (automax.folder / "SPEED.BLK.orig").read_bytes() == b"precious"


def test_output_writes_into_a_folder(automax, old):
    (automax.folder / "new").mkdir()
    assert automax("convert", old, "--output", "new").code == 0
    assert (automax.folder / "new" / old).read_bytes() == NEW
    assert (automax.folder / old).read_bytes() == OLD
    again = automax("convert", old, "--output", "new")
    assert (again.code, "new/SPEED.BLK exists already" in again.err) == (2, True)


def test_the_folder_for_the_converted_files_is_made(automax, old):
    assert automax("convert", old, "--output", "new/tasks").code == 0
    assert (automax.folder / "new" / "tasks" / old).is_file()


def test_the_check_of_an_old_file_names_the_command_that_mends_it(automax, old):
    assert f"`automax convert {old}` mends the whole file" in automax("check", old).out
    automax("convert", old, "--output", "new")
    assert "automax convert" not in automax("check", f"new/{old}").out


def test_errors_that_are_left_are_told(automax):
    result = automax("convert", automax.write("WRONG.BLK", b"10 CALL SCAN_LOOP(TICKS=4)\r\n20 X% = 1\r\n30 END\r\n"))
    assert result.code == 1
    assert "WRONG.BLK: `automax check` finds errors in what came out" in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["NONE.BLK"], "NONE.BLK cannot be read: No such file or directory"),
        (["rack.yaml"], "rack.yaml: a task's source is a .BLK or .BAS file"),
        (["SPEED.BLK", "--output", "rack.yaml"], "rack.yaml is not a folder"),
        (["SPEED.BLK", "a/SPEED.BLK", "--output", "a"], "exists already"),
        (["SPEED.BLK", "a/SPEED.BLK", "--output", "b"], "two files are named SPEED.BLK"),
        (["SPEED.BLK", "--write", "--output", "b"], "not allowed with argument"),
    ],
)
def test_wrong_usage_writes_nothing(automax, old, arguments, message):
    for folder in ("a", "b"):
        (automax.folder / folder).mkdir()
    automax.write("a/SPEED.BLK", OLD)
    automax.write("rack.yaml", "rack: A\n")
    result = automax("convert", *arguments)
    assert (result.code, message in result.err) == (2, True)
    assert (automax.folder / old).read_bytes() == OLD
    assert not list((automax.folder / "b").iterdir())


def test_an_include_file_is_written_into_its_task_and_check_names_convert(automax):
    automax.write("HEAD.INC", "LOCAL X%\r\n")
    automax.write("TASK.BLK", "10 INCLUDE HEAD\n20 CALL SCAN_LOOP(TICKS=4)\n30 X% = 1\n40 END\n")
    assert "`automax convert` does it with an include file next to the task" in automax("check", "TASK.BLK").out
    result = automax("convert", "TASK.BLK", "--output", "new")
    assert (result.code, "TASK.BLK: HEAD.INC written in place of its INCLUDE" in result.err) == (0, True)
    assert (automax.folder / "new" / "TASK.BLK").read_text().splitlines()[:2] == [
        "10 ! INCLUDE HEAD.INC",
        "11 LOCAL X%",
    ]
    automax.write("TASK.BLK", "10 INCLUDE NIL\n20 CALL SCAN_LOOP(TICKS=4)\n40 END\n")
    result = automax("convert", "TASK.BLK")
    assert "TASK.BLK: line 10 includes 'NIL.INC': it is not next to the task\n" in result.err
    assert result.code == 1
