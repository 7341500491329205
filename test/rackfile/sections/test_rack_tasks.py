"""Tasks of a rack file, and above all: which files it may reach."""

import os

import pytest
import yaml
from rack.helpers import codes, good, loaded, write

from automax_ros.rackfile.loader import load


def rack(task: str) -> str:
    return f"rack: A\nslots:\n  0:\n    module: 57C435\n    tasks:\n      {task}\n"


@pytest.mark.parametrize("name", ["A", "LINE", "S_1", "ABCDEFGH"])
def test_task_names(tmp_path, name):
    assert good(tmp_path, rack(f"{name}: {{file: LINE.BLK, priority: 4}}")).task_modules[0].tasks[0].name == name


@pytest.mark.parametrize("name", ["ABCDEFGHI", "1A", "_A", "A-B", "A B", "A%", "''"])
def test_task_names_that_the_manual_forbids(tmp_path, name):
    assert codes(tmp_path, rack(f"{name}: {{file: LINE.BLK, priority: 4}}")) == ["AMX6300"]


def test_priorities_are_4_to_11(tmp_path):
    for priority in range(-1, 14):
        expected = [] if 4 <= priority <= 11 else ["AMX6302"]
        assert codes(tmp_path, rack(f"LINE: {{priority: {priority}}}")) == expected


@pytest.mark.parametrize(
    ("file", "code"),
    [
        ("../LINE.BLK", "AMX6305"),
        ("sub/../../LINE.BLK", "AMX6305"),
        ("/etc/LINE.BLK", "AMX6305"),
        ("'C:\\LINE.BLK'", "AMX6305"),
        ("'..\\LINE.BLK'", "AMX6305"),
        ("LINE.INC", "AMX6304"),
        ("line.pc", "AMX6304"),
        ("LINE", "AMX6304"),
        (".BLK", "AMX6304"),
        ("NONE.BLK", "AMX6306"),
        ("FOLDER.BLK", "AMX6306"),
        ("PIPE.BLK", "AMX6306"),
        ('"\\0.BLK"', "AMX6010"),
        ('"\\ud800.BLK"', "AMX6003" if yaml.__with_libyaml__ else "AMX6010"),
        ("LINE.BLK", None),
        ("./LINE.BLK", None),
    ],
)
def test_files_that_a_task_may_and_may_not_name(tmp_path, file, code):
    (tmp_path / "FOLDER.BLK").mkdir()
    os.mkfifo(tmp_path / "PIPE.BLK")
    found = codes(tmp_path, rack(f"LINE: {{file: {file}, priority: 4}}"))
    assert found == ([code] if code else [])


def test_a_ladder_task_that_only_its_name_tells_is_told_as_one(tmp_path):
    (tmp_path / "STEPS.PC").write_text("ladder\n")
    text = rack("STEPS: {priority: 4}")
    assert codes(tmp_path, text) == ["AMX6304"]
    (tmp_path / "STEPS.BLK").write_text("10 CALL SCAN_LOOP(TICKS=2)\n20 END\n")
    assert codes(tmp_path, text) == []


def test_symbolic_link_to_itself_is_refused(tmp_path):
    (tmp_path / "LOOP.BLK").symlink_to(tmp_path / "LOOP.BLK")
    (found,) = codes(tmp_path, rack("LINE: {file: LOOP.BLK, priority: 4}"))
    assert found in ("AMX6305", "AMX6306")  # Python 3.13 resolves the loop to itself, earlier ones do not


def test_symbolic_links_lead_out_only_when_allowed(tmp_path):
    inside = tmp_path / "rack"
    inside.mkdir()
    (tmp_path / "SECRET.BLK").write_text("10 END\n")
    (inside / "LINK.BLK").symlink_to(tmp_path / "SECRET.BLK")
    (inside / "OUT").symlink_to(tmp_path)
    for file in ("LINK.BLK", "OUT/SECRET.BLK", "../SECRET.BLK", str(tmp_path / "SECRET.BLK")):
        text = rack(f"LINE: {{file: {file}, priority: 4}}")
        assert codes(inside, text) == ["AMX6305"]
        config = loaded(inside, text, allow_outside=True).config
        assert config.task_modules[0].tasks[0].file.read_text() == "10 END\n"


def test_symbolic_link_inside_the_folder_is_fine(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "ONE.BLK").symlink_to(tmp_path / "LINE.BLK")
    assert good(tmp_path, rack("LINE: {file: sub/ONE.BLK, priority: 4}")).task_modules[0].tasks[0].name == "LINE"


def test_tasks_next_to_the_file_that_the_rack_file_links_to_are_fine(tmp_path):
    """As `colcon build --symlink-install` installs a rack: each file by itself is a link to its source."""
    source, installed, elsewhere = tmp_path / "source", tmp_path / "installed", tmp_path / "elsewhere"
    for folder in (source, installed, elsewhere):
        folder.mkdir()
    write(source, rack("LINE: {priority: 4}"))
    for file in source.iterdir():
        (installed / file.name).symlink_to(file)
    assert [task.name for task in load(installed / "rack.yaml").config.task_modules[0].tasks] == ["LINE"]
    (elsewhere / "LINE.BLK").write_text("10 END\n")
    (installed / "LINE.BLK").unlink()
    (installed / "LINE.BLK").symlink_to(elsewhere / "LINE.BLK")
    assert [item.code for item in load(installed / "rack.yaml").diagnostics] == ["AMX6305"]


def test_rack_file_may_be_named_relative_to_the_working_folder(tmp_path, monkeypatch):
    write(tmp_path, rack("LINE: {priority: 4}"))
    monkeypatch.chdir(tmp_path)
    assert load("rack.yaml").config.task_modules[0].tasks[0].file.name == "LINE.BLK"


def test_rack_file_that_is_no_file_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    for path in (tmp_path / "pipe.yaml", tmp_path, tmp_path / "none.yaml", "/dev/zero"):
        assert [item.code for item in load(path).diagnostics] == ["AMX6000"]


def test_missing_file_gets_a_hint_with_a_name_that_is_there(tmp_path):
    result = loaded(tmp_path, rack("LINE: {file: line.BLK, priority: 4}"))
    assert [item.hint for item in result.diagnostics] == ["did you mean LINE.BLK?"]


def test_file_name_alone_gets_a_hint_with_the_whole_form(tmp_path):
    result = loaded(tmp_path, rack("LINE: LINE.BLK"))
    assert result.diagnostics[0].hint == "write LINE: {file: LINE.BLK, priority: 8}"


def test_names_differ_in_the_whole_rack_even_in_case(tmp_path):
    text = (
        "rack: A\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435, tasks: {LINE: {priority: 4}}}\n"
        "  2: {module: 57C435, tasks: {line: {file: LINE.BLK, priority: 4}}}\n"
    )
    assert sorted(codes(tmp_path, text)) == ["AMX6301", "AMX6411"]
