"""What README.md shows of the command line works as it stands there."""

import re
import shlex
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def session(heading: str) -> list[tuple[str, str]]:
    """The commands in the first fenced text below a heading, each with what follows it up to an empty line."""
    _, _, after = README.partition(f"\n## {heading}\n")
    block = after.split("```")[1]
    return [(part[0], part[1]) for part in re.findall(r"^\$ (.+)\n((?:[^$\n].*\n)*)", block, re.MULTILINE)]


def test_your_own_task_shows_all_that_it_needs(automax):
    commands = session("Your own task")
    assert [command.split()[0] for command, _ in commands] == ["cat", "cat", ".venv/bin/automax", ".venv/bin/automax"]
    for command, text in commands:
        program, *arguments = shlex.split(command)
        if program == "cat":
            automax.write(arguments[0], text)
            continue
        result = automax(*arguments)
        assert (result.code, result.err) == (0, "")
    assert len(result.out.splitlines()) > 3


@pytest.mark.parametrize("command", re.findall(r"\.venv/bin/automax ([a-z-]+)", README))
def test_commands_of_the_readme_exist(automax, command):
    assert automax(command, "--help").code == 0
