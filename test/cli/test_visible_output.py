"""No control character of a file name, a file, an argument or another program reaches the terminal."""

import io
import json
import re
import sys
from pathlib import Path

import pytest

from automax_ros.cli.main import SUBCOMMANDS, main
from automax_ros.cli.visible import VisibleOutput, write_control
from automax_ros.core.text import visible
from cli.support import WRONG

EVIL = "ev\x1b]0;il\x07\x9b31m\x7f\u202e\u2028\u2066\rx"
"""ESC, BEL, CSI of C1, DEL, overrides of direction, a line separator, a carriage return."""
RAW = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
TASKLESS = "rack: PM1\nslots: {0: {module: 57C413}}\ncommon: {A%: {unit: 7}}\n"
OF_TASKS = ("check", "trace", "compile", "tune-info", "response", "convert")


def given(command: str, folder: Path) -> list[list[str]]:
    """Command lines with hostile names: of nothing, of a faulty file, as an option, as what follows."""
    suffix = {"import": ".CNF"}.get(command, ".BLK" if command in OF_TASKS else ".yaml")
    file = folder / f"{EVIL}{suffix}"
    file.write_text(TASKLESS if suffix == ".yaml" else WRONG)
    rest = {
        "trace": ["--input", str(file)],
        "compile": ["--native"],
        "response": ["--block", EVIL],
        "ctl": ["get", EVIL],
        "export": ["--output", "x.csv"],
        "plot": [EVIL, "--output", "x.png"],
        "compare": ["--input", str(file)],
        "node": ["--module", EVIL],
        "sweep": ["--vary", f"{EVIL}=1:2:2", "--measure", f"{EVIL}=last(A%)"],
    }.get(command, [])
    nested = {"bag": "info", "compare": "pulse"}.get(command)
    before = [command, nested] if nested else [command]
    return [
        [*before, str(file), *rest],
        [*before, str(folder / f"no{EVIL}"), *rest],
        [*before, EVIL, EVIL, EVIL],
        [*before, f"--{EVIL}"],
    ]


@pytest.mark.parametrize("command", SUBCOMMANDS)
def test_no_subcommand_prints_control_characters(command, tmp_path, monkeypatch, capsys, ros_domain_id):
    monkeypatch.chdir(tmp_path)
    told = ""
    for arguments in given(command, tmp_path):
        code = main(arguments)
        caught = capsys.readouterr()
        assert not RAW.findall(caught.out + caught.err), arguments
        told += caught.out + caught.err
        assert code in {0, 1, 2}
    assert "ev" in told, "what was wrong is named"


def test_the_name_of_a_subcommand_is_shown_harmless(capsys):
    assert main([EVIL]) == 2
    assert not RAW.findall(capsys.readouterr().err)


def test_json_stays_exact(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / f"{EVIL}.BLK").write_text(WRONG)
    assert main(["check", f"{EVIL}.BLK", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)[0]["file"] == f"{EVIL}.BLK"


def test_line_ends_and_tabs_stay_and_all_else_is_shown():
    assert visible("a\tb\nc\x1b[2J\u202e\n") == "a\tb\nc\ufffd[2J\ufffd\n"


def test_control_sequences_of_our_own_pass(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(sys, "stdout", out)
    output = VisibleOutput()
    twice = VisibleOutput()
    try:
        print("\x1b[2J")
        write_control(sys.stdout, "\x1b[K")
        sys.stdout.writelines(["a\x07", "b"])
    finally:
        twice.undo()
        output.undo()
    assert out.getvalue() == "\ufffd[2J\n\x1b[Ka\ufffdb"
    assert sys.stdout is out
