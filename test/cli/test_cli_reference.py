"""`automax compile`, `blocks`, `explain`: what they print."""

import ast

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.describe import description, summary, template, templates
from automax_ros.core.problems import PROBLEMS
from cli.support import TASK, WRONG


def test_compile_prints_python_functions(automax):
    result = automax("compile", automax.write("TASK.BLK", TASK))
    assert (result.code, result.err) == (0, "")
    functions = [node.name for node in ast.parse(result.out).body if isinstance(node, ast.FunctionDef)]
    assert functions == ["startup", "scans", "scan_steps"]
    assert "OUT_i" in result.out


def test_compile_of_a_wrong_task(automax):
    result = automax("compile", automax.write("TASK.BLK", WRONG))
    assert (result.code, result.out) == (1, "")
    assert "TASK.BLK:2:4: error[AMX4001]" in result.err


def test_compile_takes_target_and_tick(automax):
    """A coefficient of a literal is computed when the task is compiled: it depends on the tick."""
    text = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=1)\n30 CALL LAG(INPUT=A%, WLG=10.0, OUTPUT=B%)\n40 END\n"
    name = automax.write("TASK.BLK", text)
    assert automax("compile", name).out != automax("compile", "--tick-ms", "0.5", name).out
    assert automax("compile", "--target", "udc", name).out == automax("compile", "--tick-ms", "0.5", name).out


def test_compile_without_a_file(automax):
    assert automax("compile", "NONE.BLK").code == 2


def test_blocks_lists_them_all(automax):
    result = automax("blocks")
    assert result == (0, summary(CATALOGUE.values()), "")
    assert [line.split()[0] for line in result.out.splitlines()] == sorted(CATALOGUE)


@pytest.mark.parametrize("name", ["LAG", "prop_int"])
def test_one_block(automax, name):
    block = CATALOGUE[name.upper()]
    assert automax("blocks", name) == (0, description(block), "")
    assert automax("blocks", "--template", name) == (0, template(block), "")


def test_templates_of_all_blocks(automax):
    assert automax("blocks", "--template") == (0, templates(CATALOGUE.values()), "")


def test_unknown_block(automax):
    assert automax("blocks", "PROPINT") == (
        2,
        "",
        "automax blocks: error: no block 'PROPINT'\n  hint: did you mean PROP_INT?\n",
    )
    assert "lists them all" in automax("blocks", "QQQ").err


def test_explain_lists_every_code_with_its_title(automax):
    lines = automax("explain").out.splitlines()
    assert [line.split()[0] for line in lines] == list(PROBLEMS)
    assert all(problem.title in line for problem, line in zip(PROBLEMS.values(), lines, strict=True))


@pytest.mark.parametrize("asked", ["AMX6915", "amx6915", "6915", " Amx6915 "])
def test_explain_prints_the_page_without_its_marks(automax, asked):
    result = automax("explain", asked)
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith("AMX6915: value that the variable cannot hold (error)\n\nA cell does not fit")
    assert "\nExample\n\n    REF%,RUN@\n    40000,1\n\nCure\n\n    REF%,RUN@\n    32767,1\n" in result.out


def test_explain_says_what_is_only_a_warning(automax):
    assert automax("explain", "6900").out.splitlines()[0].endswith("(warning)")


@pytest.mark.parametrize("code", PROBLEMS)
def test_every_code_can_be_explained(automax, code):
    result = automax("explain", code)
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith(f"{code}: {PROBLEMS[code].title}")
    assert "```" not in result.out
    assert "\n#" not in result.out


def test_explain_knows_the_codes_of_the_hardware(automax):
    assert automax("explain", "31").out.startswith("AMX7031: bus error")
    both = automax("explain", "e0").out.splitlines()
    assert [line.split()[0] for line in both] == ["AMX4010", "AMX4011"]


@pytest.mark.parametrize(
    ("asked", "near"),
    [("AMX7006", "AMX7005"), ("9999", max(PROBLEMS)), ("bus", "AMX7031"), ("zzz", "`automax explain`")],
)
def test_unknown_code(automax, asked, near):
    result = automax("explain", asked)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("automax explain: error: no problem code ")
    assert near in result.err


def test_headings_stand_out_on_a_terminal(automax, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert "\x1b[1mCure\x1b[0m" in automax("explain", "4001").out
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in automax("explain", "4001").out
