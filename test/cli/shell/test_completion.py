"""`automax completion`: bash, zsh and fish complete as the command line is."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from automax_ros.cli.main import SUBCOMMANDS
from automax_ros.cli.shell.arguments import commands
from automax_ros.cli.shell.completion import SHELLS

FOUND = commands()
EVERY = [inner for command in FOUND for inner in command.all()]
SCRIPTS = {name: make(FOUND) for name, make in SHELLS.items()}


def shell(name: str, program: str, *arguments: str) -> list[str]:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not installed")
    result = subprocess.run([path, *arguments, "-c", program], capture_output=True, text=True, timeout=240, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    return result.stdout.split("\n")


def completed(*words: str) -> set[str]:
    """What bash offers for the last of the words."""
    typed = " ".join(f"'{word}'" for word in ("automax", *words))
    ask = f'COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _automax; printf "%s\\n" "${{COMPREPLY[@]}}"'
    lines = shell("bash", f"{SCRIPTS['bash']}\n{ask}", "--norc", "--noprofile")
    return {line for line in lines if line}


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["sche"], {"schema"}),
        (["re"], {"record", "replay", "report", "rerun", "response"}),
        (["schema", ""], {"rack", "stimuli", "-h", "--help"}),
        (["run", "x.yaml", "--simu"], {"--simulated"}),
        (["bag", ""], {"info", "repair", "-h", "--help"}),
        (["bag", "info", "out", "--ch"], {"--check"}),
        (["ctl", "PM1", "stop-"], {"stop-all"}),
        (["ctl", "PM1", "watch", "--ev"], {"--every"}),
        (["run", "conf"], set()),
    ],
)
def test_bash(words, offered):
    assert completed(*words) == offered


def test_bash_knows_every_subcommand():
    assert completed("") == set(SUBCOMMANDS)


def test_bash_completes_the_words_of_an_option():
    with_words = [(command, option) for command in EVERY for option in command.options if option.values]
    assert with_words
    for command, option in with_words:
        assert completed(*command.words, option.names[-1], "") == set(option.values)


@pytest.mark.parametrize("name", SHELLS)
def test_each_script_names_every_option(automax, name):
    assert automax("completion", name).out == SCRIPTS[name]
    for command in EVERY:
        for option in command.options:
            assert all(word.lstrip("-") in SCRIPTS[name] for word in option.names)


def test_zsh_reads_its_script(tmp_path):
    (tmp_path / "_automax").write_text(SCRIPTS["zsh"])
    program = f"compdef() {{ :; }}; source {tmp_path}/_automax; functions _automax >/dev/null && echo read"
    assert shell("zsh", program, "-f")[0] == "read"


def test_fish_completes(tmp_path):
    script = tmp_path / "automax.fish"
    script.write_text(SCRIPTS["fish"])

    def offered(line: str) -> set[str]:
        found = shell("fish", f"source {script}; complete -C '{line}'", "--no-config")
        return {item.partition("\t")[0] for item in found if item}

    assert offered("automax sche") == {"schema"}
    assert offered("automax ctl PM1 stop-") == {"stop-all"}
    assert offered("automax run x.yaml --simu") == {"--simulated"}
    assert offered("automax schema ") == {"rack", "stimuli"}


def test_another_shell_is_wrong_usage(automax):
    assert automax("completion", "csh").code == 2
