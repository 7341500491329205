"""Every example of the documentation is executed, and does what its page says."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import jsonschema
import pytest
from rack.helpers import rack_at
from yaml_core import data_of

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.cli.main import module_of, parsers
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import Severity
from automax_ros.language.checks.checker import check
from automax_ros.language.tree.task_kind import is_task_file
from automax_ros.rackfile.loader import KEYS, load
from automax_ros.rackfile.loader import schema as rack_schema
from automax_ros.scenario.stimuli.schema import schema as stimuli_schema
from docs.fences import PAGES, ROOT, Fence, fences
from docs.scratch import commands, execute, prepare, session, shows, standing_in, write

EXAMPLES = [fence for page in PAGES for fence in fences(page)]
LANGUAGES = {"python", "yaml", "json", "sh", "console", "blk", "bas", "cnf", "csv", "ebnf", "text", "xml", "cmake"}
SHOWN_ONLY = {"text", "csv", "ebnf", "xml", "cmake"}
"""What is not executed: pictures, usage, tables that other examples read, the grammar (test/language/grammar.py)."""
PROMPT, GREETING = "step> ", "help lists the commands"
"""What `automax step` prints on a terminal only."""
MOST_NOT_RUN = 12
"""Blocks that cannot be executed; a new one must be worth it."""


def ids(fence: Fence) -> str:
    return str(fence)


def test_there_are_examples():
    assert len(EXAMPLES) > 100
    assert {fence.language for fence in EXAMPLES} <= LANGUAGES
    assert len([fence for fence in EXAMPLES if fence.language not in SHOWN_ONLY]) > 60


def test_what_is_not_run_says_why():
    not_run = [fence for fence in EXAMPLES if fence.note.startswith("not run: ")]
    assert len(not_run) <= MOST_NOT_RUN
    for fence in not_run:
        assert len(fence.note.removeprefix("not run: ").split()) >= 4, fence


@pytest.mark.parametrize("fence", [fence for fence in EXAMPLES if fence.note.startswith("run by ")], ids=ids)
def test_what_another_test_runs_is_read_there(fence):
    path = ROOT / fence.note.removeprefix("run by ").split()[0]
    text = path.read_text(encoding="utf-8")
    assert fence.page.name in text or (fence.page.name == "README.md" and fence.page.parent.name in text)


def here(*languages: str) -> list[Fence]:
    return [fence for fence in EXAMPLES if fence.language in languages and fence.runs_here]


@pytest.mark.parametrize("fence", here("json"), ids=ids)
def test_json(fence):
    json.loads(fence.text)


def stub_tasks(path: Path) -> None:
    """Write an empty task for each that a rack file names and the page does not show."""
    for slot in data_of(path.read_text(encoding="utf-8"))["slots"].values():
        for name, task in (slot.get("tasks") or {}).items():
            file = path.parent / task.get("file", f"{name}.BLK")
            if not file.exists() and not file.with_suffix(".BAS").exists():
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text("10 END\n" if file.suffix == ".BAS" else "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n")


@pytest.mark.parametrize("fence", here("yaml"), ids=ids)
def test_yaml(fence, tmp_path):
    """A rack file has no errors; a part of one, and stimuli, have the right form."""
    data = data_of(fence.text)
    if isinstance(data, list):
        jsonschema.validate(data, json.loads(json.dumps(stimuli_schema())))
    elif "rack" in data and "slots" in data:
        prepare(fence.page, tmp_path)
        path = tmp_path / "rack.yaml"
        path.write_text(fence.text, encoding="utf-8")
        stub_tasks(path)
        result = load(path)
        assert [item for item in result.diagnostics if item.severity is Severity.ERROR] == []
    elif all(key.startswith("/") for key in data):  # a parameter file of ROS
        assert all(list(node) == ["ros__parameters"] and node["ros__parameters"] for node in data.values())
    else:
        assert set(data) <= set(KEYS)
        part = {**rack_schema(), "required": []}
        jsonschema.validate(data, json.loads(json.dumps(part)))


@pytest.mark.parametrize("fence", here("blk", "bas"), ids=ids)
def test_tasks(fence):
    """A task has no errors; a part of one neither, with what makes it whole. Its commons are whatever it declares."""
    text = fence.text
    if "END\n" not in text:
        text += "30000 CALL SCAN_LOOP(TICKS=4)\n" if "SCAN_LOOP" not in text else ""
        text += "30010 END\n"
    target = Platform(fence.word("target") or "automax")
    source = SourceText(fence.file or f"PAGE.{fence.language.upper()}", text)
    tick = 500_000 if target is Platform.UDC else 5_500_000
    result = check(source, name="PAGE", catalogue=CATALOGUE, target=target, tick_ns=tick, commons=None)
    assert [item for item in result.diagnostics if item.severity is Severity.ERROR] == []


@pytest.mark.parametrize("fence", here("cnf"), ids=ids)
def test_configuration_tasks(fence, tmp_path):
    (tmp_path / "RACK.CNF").write_text(fence.text)
    result = execute("automax import RACK.CNF --output rack.yaml", tmp_path)
    assert (tmp_path / "rack.yaml").is_file(), result.text


def racks_of_pages() -> list[Path]:
    """Pages that show a rack file under its name, and its tasks under theirs."""
    return [page for page in PAGES if {"rack.yaml"} & {fence.file for fence in fences(page) if fence.runs_here}]


@pytest.mark.parametrize("page", racks_of_pages(), ids=lambda page: page.name)
def test_racks_with_their_tasks(page, tmp_path):
    """What a page shows as files of one rack fits together."""
    prepare(page, tmp_path)
    stub_tasks(tmp_path / "rack.yaml")
    rack = rack_at(tmp_path / "rack.yaml")
    rack.start()
    rack.run(0.5)
    assert rack.operations.stopped is None
    shown = {Path(fence.file).stem for fence in fences(page) if is_task_file(fence.file)}
    assert {task.name for task in rack.tasks if task.errors.count} & shown == set()


@pytest.mark.parametrize("fence", [fence for fence in EXAMPLES if fence.language in ("sh", "console")], ids=ids)
def test_every_command_can_be_given(fence):
    """The arguments of every `automax` are right, also where it is not run here."""
    given = [command for command, _ in session(fence.text)] if fence.language == "console" else commands(fence.text)
    for command in given:
        for part in re.split(r"&&|\||;", command):
            words = shlex.split(part.partition(" >")[0].partition(" --ros-args")[0])
            if words and words[0] == "automax" and "<" not in words:
                parsers({words[1]: module_of(words[1])})[0].parse_args(words[1:])


def shell_pages() -> list[Path]:
    return list(dict.fromkeys(fence.page for fence in here("sh", "console", "python") if not fence.word("live")))


@pytest.mark.parametrize("page", shell_pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_and_programs(page, tmp_path):
    """In the order of the page, in one folder, the programs of a page in one interpreter."""
    prepare(page, tmp_path)
    names: dict[str, object] = {"__name__": "__page__"}
    for fence in fences(page):
        write(fence, tmp_path)
        if not fence.runs_here or fence.word("live"):
            continue
        code = int(fence.word("exit") or 0)
        if fence.language == "sh":
            ended = [(command, execute(command, tmp_path)) for command in commands(fence.text)]
            assert [(command, result) for command, result in ended[:-1] if result.code not in (0, code)] == [], fence
            assert ended[-1][1].code == code, (str(fence), ended[-1])
        elif fence.language == "console":
            for command, shown in session(fence.text):
                typed = [line.removeprefix(PROMPT) for line in shown if line.startswith(PROMPT)]
                result = execute(command, tmp_path, typed)
                assert result.code == code, (str(fence), command, result.text)
                printed = [line for line in shown if not line.startswith((PROMPT, GREETING))]
                assert shows(result.text, printed) == "", (str(fence), command, result.text)
        elif fence.language == "python":
            with standing_in(tmp_path):
                exec(compile(fence.text, str(fence), "exec"), names)
