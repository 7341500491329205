"""`automax check`: tasks and rack files, as a person and as a program reads them."""

import json

import pytest

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import count_of
from cli.support import TASK, WRONG

KEYS = {"file", "line", "column", "end_column", "statement", "severity", "code", "message"}
RACK = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {SPEED: {priority: 5}}}
common:
  REF%:
  RUN@:
"""
SPEED = "10 COMMON REF%, RUN@\n20 CALL SCAN_LOOP(TICKS=1)\n30 END\n"


def records(result):
    return json.loads(result.out)


def test_good_task_says_nothing(automax):
    assert automax("check", automax.write("TASK.BLK", TASK)) == (0, "", "")


def test_error_shows_place_line_caret_and_gives_1(automax):
    result = automax("check", automax.write("TASK.BLK", WRONG))
    assert (result.code, result.err) == (1, "")
    assert result.out == (
        "TASK.BLK:2:4: error[AMX4001]: X% is not declared\n"
        "  20 X% = 1\n"
        "     ^^\n"
        "  hint: declare it with LOCAL or COMMON\n"
    )  # fmt: skip


def test_warning_alone_is_fine(automax):
    result = automax("check", automax.write("TASK.BLK", "10 call SCAN_LOOP(TICKS=4)\n20 END\n"))
    assert result.code == 0
    assert "warning[AMX0003]" in result.out


def test_all_files_are_checked_in_their_order(automax):
    names = [automax.write("B.BLK", WRONG), automax.write("A.BLK", TASK), automax.write("C.BLK", WRONG)]
    result = automax("check", *names)
    assert result.code == 1
    assert [line.split(":")[0] for line in result.out.splitlines() if "error" in line] == ["B.BLK", "C.BLK"]


def test_json_is_one_list_over_all_files(automax):
    names = [automax.write("B.BLK", WRONG), automax.write("C.BLK", WRONG.replace("X%", "Y%"))]
    result = automax("check", "--json", *names)
    assert result.code == 1
    assert records(result) == [
        {
            "file": name,
            "line": 2,
            "column": 4,
            "end_column": 6,
            "statement": 20,
            "severity": "error",
            "code": "AMX4001",
            "message": f"{variable} is not declared",
            "hint": "declare it with LOCAL or COMMON",
        }
        for name, variable in zip(names, ("X%", "Y%"), strict=True)
    ]


def test_json_of_a_good_task_is_an_empty_list(automax):
    name = automax.write("TASK.BLK", "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n")
    assert automax("check", "--json", name) == (0, "[]\n", "")


def test_json_marks_forms_that_no_source_confirms(automax):
    text = "10 LOCAL A%, &\n  G [CURRENT=1.0]\n20 CALL SCAN_LOOP(TICKS=4)\n30 A% = BIT_SET%(A%, 3)\n40 END\n"
    result = automax("check", "--json", automax.write("TASK.BLK", text))
    assert result.code == 0
    found = records(result)
    assert all(set(item) >= KEYS for item in found)
    assert [(item["line"], item["statement"], item["severity"], item["code"]) for item in found] == [
        (2, 10, "note", None),
        (4, 30, "note", None),
    ]
    assert all(item["unconfirmed"] is True for item in found)
    assert "BIT_SET%" in found[1]["message"]


def test_json_marks_a_problem_inside_such_a_form(automax):
    text = "10 LOCAL G [CURRENT=1.0, HIGH=0.5]\n20 CALL SCAN_LOOP(TICKS=4)\n30 X% = 1\n40 END\n"
    result = automax("check", "--json", automax.write("TASK.BLK", text))
    marks = {item["code"]: item.get("unconfirmed", False) for item in records(result) if item["code"]}
    assert marks == {"AMX4014": True, "AMX4001": False}


def test_tick_decides_what_a_coefficient_may_be(automax):
    """WLG of LAG is limited by 0.71 C (section 43): 256 for 5.5 ms, 141 for 10 ms."""
    text = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=1)\n30 CALL LAG(INPUT=A%, WLG=200.0, OUTPUT=B%)\n40 END\n"
    name = automax.write("TASK.BLK", text)
    assert automax("check", name).code == 0
    result = automax("check", "--tick-ms", "10", name)
    assert result.code == 1
    assert "AMX4084" in result.out


def test_target_decides_what_may_be_used(automax):
    name = automax.write("TASK.BLK", "10 EVENT NAME=E, TIMEOUT=50\n20 CALL SCAN_LOOP(TICKS=1, EVENT=E)\n30 END\n")
    rack, udc = automax("check", name), automax("check", "--target", "udc", name)
    assert "AMX4027" not in rack.out
    assert "AMX4027" in udc.out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tick-ms", "0.7"], "0.5 to 10 ms"),
        (["--tick-ms", "0"], "0.5 to 10 ms"),
        (["--tick-ms", "10.5"], "0.5 to 10 ms"),
        (["--tick-ms", "fast"], "not a number"),
        (["--tick-ms", "1e999999999"], "not a number"),
        (["--tick-ms", "nan"], "not a number"),
        (["--target", "udc", "--tick-ms", "1"], "always 0.5"),
        (["--target", "plc"], "invalid choice"),
    ],
)
def test_impossible_tick_or_target_is_wrong_usage(automax, options, message):
    result = automax("check", *options, automax.write("TASK.BLK", TASK))
    assert (result.code, result.out) == (2, "")
    assert message in result.err


@pytest.mark.parametrize(
    "options", [["--target", "udc"], ["--target", "udc", "--tick-ms", "0.50"], ["--tick-ms", "10"]]
)
def test_possible_ticks(automax, options):
    name = automax.write("TASK.BLK", "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n")
    assert automax("check", *options, name).code == 0


def test_missing_file_is_2_and_the_others_are_checked(automax):
    result = automax("check", "NONE.BLK", automax.write("B.BLK", WRONG))
    assert result.code == 2
    assert result.err == "automax check: error: NONE.BLK cannot be read: No such file or directory\n"
    assert "B.BLK:2:4: error[AMX4001]" in result.out


def test_missing_file_leaves_json_whole(automax):
    result = automax("check", "--json", "NONE.BLK", "none.yaml", automax.write("B.BLK", WRONG))
    assert result.code == 2
    assert [item["file"] for item in records(result)] == ["B.BLK"]
    assert result.err.count("cannot be read") == 2


@pytest.mark.parametrize(
    ("name", "message"),
    [("TASK.PC", "a ladder task (.PC) is not run"), ("TASK.TXT", "a task's source is a .BLK or .BAS file")],
)
def test_other_kinds_of_files_are_refused(automax, name, message):
    result = automax("check", automax.write(name, "10 END\n"))
    assert (result.code, result.out) == (2, "")
    assert message in result.err


def test_a_basic_task_is_checked_as_one(automax):
    text = "10 EVENT NAME = GO\n20 WAIT ON GO\n30 DELAY 2 SECONDS\n40 GOTO 20\n50 END\n"
    assert automax("check", automax.write("SLOW.BAS", text)) == (0, "", "")
    assert "AMX0031" in automax("check", automax.write("SLOW.BLK", text)).out
    compiled = automax("compile", "SLOW.BAS")
    assert compiled.code == 0
    assert compiled.out.startswith("def burst(state, io):")
    traced = automax("trace", "SLOW.BAS", "--input", automax.write("IN.csv", "GO\n1\n"))
    assert (traced.code, traced.out) == (2, "")
    assert "SLOW.BAS is a BASIC task" in traced.err


def test_folder_is_no_task(automax):
    (automax.folder / "TASK.BLK").mkdir()
    result = automax("check", "TASK.BLK")
    assert result == (2, "", "automax check: error: TASK.BLK is a folder, not a file\n")


def test_huge_task_is_an_error_of_the_task(automax):
    result = automax("check", automax.write("TASK.BLK", b"!" * 1_000_001))
    assert result.code == 1
    assert "error[AMX0001]" in result.out


def test_bytes_of_old_editors_in_remarks_are_read(automax):
    text = b"10 ! Gr\xfc\xdfe\r\n20 CALL SCAN_LOOP(TICKS=4)\r\n30 END\r\n\x1a"
    assert automax("check", automax.write("TASK.BLK", text)) == (0, "", "")


@pytest.mark.parametrize("name", ["SPEED_REGULATOR.BLK", "2ND.BLK", "MY-TASK.BLK"])
def test_file_that_cannot_name_a_task_is_warned_of(automax, name):
    result = automax("check", automax.write(name, "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n"))
    assert result.code == 0
    assert f"{name}:1:1: warning[AMX6900]" in result.out


def test_file_in_lower_case_names_a_task(automax):
    assert automax("check", automax.write("speed_1.blk", "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n")) == (0, "", "")


def test_good_rack_says_nothing(automax):
    automax.write("SPEED.BLK", SPEED)
    assert automax("check", automax.write("rack.yaml", RACK)) == (0, "", "")


def test_rack_defines_the_commons_of_its_tasks(automax):
    automax.write("SPEED.BLK", SPEED.replace("RUN@", "RUN%, OTHER%"))
    result = automax("check", automax.write("rack.yml", RACK))
    assert result.code == 1
    assert "SPEED.BLK:1:17: error[AMX4011]: RUN% is INTEGER here, RUN@ at rack.yml:6 is BOOLEAN" in result.out
    assert "SPEED.BLK:1:23: error[AMX4010]: the rack does not define the common OTHER%" in result.out


def test_rack_decides_the_tick_of_its_tasks(automax):
    text = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=1)\n30 CALL LAG(INPUT=A%, WLG=200.0, OUTPUT=B%)\n40 END\n"
    automax.write("SPEED.BLK", text)
    assert automax("check", automax.write("rack.yaml", RACK)).code == 0
    result = automax("check", automax.write("rack.yaml", RACK.replace("57C435,", "57C435, tick_ms: 10,")))
    assert result.code == 1
    assert "SPEED.BLK:3" in result.out


def test_task_in_two_checks_is_told_once(automax):
    automax.write("SPEED.BLK", SPEED.replace("30 END", "25 X% = 1\n30 END"))
    automax.write(
        "rack.yaml", RACK.replace("SPEED: {priority: 5}", "SPEED: {priority: 5}, B: {file: SPEED.BLK, priority: 6}")
    )
    result = automax("check", "rack.yaml", "SPEED.BLK")
    assert result.code == 1
    assert result.out.count("AMX4001") == 1


def test_rack_file_at_fault(automax):
    automax.write("SPEED.BLK", SPEED)
    result = automax("check", automax.write("rack.yaml", RACK.replace("57C435", "57C999")))
    assert result.code == 1
    assert "rack.yaml:3:" in result.out
    assert "AMX6202" in result.out


def test_rack_file_that_is_no_text_is_2(automax):
    result = automax("check", automax.write("rack.yaml", RACK.encode() + b"# \xff\n"))
    assert result.code == 2
    assert "error[AMX6002]" in result.out


def test_missing_rack_file_is_2(automax):
    result = automax("check", "none.yaml")
    assert (result.code, result.out) == (2, "")
    assert "none.yaml" in result.err
    assert "cannot be read" in result.err


def test_sources_elsewhere_have_to_be_allowed(automax):
    (automax.folder / "inner").mkdir()
    automax.write("SPEED.BLK", SPEED)
    automax.write("inner/rack.yaml", RACK.replace("{priority: 5}", "{file: ../SPEED.BLK, priority: 5}"))
    assert "AMX6305" in automax("check", "inner/rack.yaml").out
    assert automax("check", "--allow-outside", "inner/rack.yaml") == (0, "", "")


class Terminal:
    """Makes standard output look like a terminal."""

    def __init__(self, monkeypatch):
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.setattr("sys.stdout.isatty", lambda: True)


def test_terminal_shows_colours_and_a_summary(automax, monkeypatch):
    name = automax.write("TASK.BLK", WRONG.replace("10 CALL", "10 call").replace("30 END", "25 Y%=1\n30 END"))
    Terminal(monkeypatch)
    out = automax("check", name).out
    assert "\x1b[1;31merror[AMX4001]\x1b[0m" in out
    assert "\x1b[1;33mwarning[AMX0003]\x1b[0m" in out
    assert out.endswith("\n2 errors, 1 warning\n")


def test_terminal_tells_that_all_is_well(automax, monkeypatch):
    name = automax.write("TASK.BLK", TASK)
    Terminal(monkeypatch)
    assert automax("check", name).out == "no problems in 1 file\n"


def test_terminal_tells_what_a_rack_consists_of(automax, monkeypatch):
    automax.write("SPEED.BLK", SPEED)
    automax.write("rack.yaml", RACK)
    Terminal(monkeypatch)
    shown = "rack.yaml: 1 Processor, 1 task, 2 commons\nno problems in 1 file\n"
    assert automax("check", "rack.yaml").out == shown
    assert automax("check", ".").out == shown


@pytest.mark.parametrize(("variable", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_colours_can_be_refused(automax, monkeypatch, variable, value):
    name = automax.write("TASK.BLK", WRONG)
    Terminal(monkeypatch)
    monkeypatch.setenv(variable, value)
    assert "\x1b" not in automax("check", name).out


def test_source_cannot_drive_the_terminal(automax):
    result = automax("check", automax.write("TASK.BLK", "10 X% = 1 \x1b[2J\x07\n20 END\n"))
    assert result.code == 1
    assert "\x1b" not in result.out
    assert "\x07" not in result.out


def test_nouns_follow_their_numbers():
    assert [count_of(number, "error") for number in (0, 1, 2)] == ["0 errors", "1 error", "2 errors"]


def test_name_warning_is_a_warning():
    assert PROBLEMS["AMX6900"].severity.value == "warning"


@pytest.mark.parametrize("options", [("--tick-ms", "3"), ("--target", "udc")])
def test_options_for_tasks_are_refused_where_only_racks_are_checked(automax, options):
    automax.write("SPEED.BLK", SPEED)
    result = automax("check", automax.write("rack.yaml", RACK), *options)
    assert (result.code, result.out) == (2, "")
    assert "for tasks given by themselves" in result.err
