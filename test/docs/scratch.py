"""The folder in which the examples of a page run: the example racks, its own files, and what its text assumes."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.cli.main import main
from docs.fences import ROOT, Fence, fences

STAGES = {
    "docs/howto/import.md": "import",
    "docs/old_files.md": "old_files",
    "docs/rack_yaml.md": "tasks",
    "docs/recordings.md": "pm1",
    "docs/stepping.md": "pm1",
    "docs/stimuli.md": "pm1",
}
"""The folder of stages/ with the files that a page's examples need and do not show."""
RECORDED = {"docs/recordings.md"}
"""Pages whose examples begin with a recording."""
LONGEST_S = 3.0
"""Simulated seconds that a run of an example lasts: its pages say more, to no other effect on whether it runs."""
DURATION = re.compile(r"(--duration )([0-9.]+)")


@dataclass(frozen=True)
class Ended:
    """How a command ended and what it printed, standard output and errors as they came."""

    code: int
    text: str


def prepare(page: Path, folder: Path) -> None:
    """Put everything into the folder that the examples of a page may use."""
    for name in ("config", "bags", "examples"):
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name)
    name = page.relative_to(ROOT).as_posix()
    if name in STAGES:
        shutil.copytree(Path(__file__).parent / "stages" / STAGES[name], folder, dirs_exist_ok=True)
    if name in RECORDED:
        made = execute(
            "automax run rack.yaml --simulated --duration 6 --set REF%=1000 --set RUN@=1 --record out", folder
        )
        assert made.code == 0, made.text
    for fence in reversed(fences(page)):  # of two of one name the first: the second is written where it stands
        write(fence, folder)


def write(fence: Fence, folder: Path) -> None:
    """Write a block that is a file."""
    if fence.file:
        (folder / fence.file).parent.mkdir(parents=True, exist_ok=True)
        (folder / fence.file).write_text(fence.text, encoding="utf-8")


@contextlib.contextmanager
def standing_in(folder: Path) -> Iterator[None]:
    """Run what follows in a folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def commands(text: str) -> Iterator[str]:
    """Yield the commands of a shell's block, comments left out, continued lines joined."""
    for line in text.replace("\\\n", " ").splitlines():
        plain = re.sub(r"(^|\s)#.*$", "", line).strip()
        if plain:
            yield DURATION.sub(shorter, plain.replace(".venv/bin/automax", "automax"))


def shorter(match: re.Match[str]) -> str:
    """A duration as the tests have it."""
    return f"{match[1]}{min(LONGEST_S, float(match[2])):g}"


def session(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the commands of a session, ``$ ...``, each with the lines that it shows."""
    parts = re.split(r"^\$ (.*)\n", text, flags=re.M)
    for command, shown in zip(parts[1::2], parts[2::2], strict=True):
        yield next(commands(command)), shown.splitlines()


def execute(command: str, folder: Path, typed: Sequence[str] = ()) -> Ended:
    """Run a command line in a folder: `automax` in this process, which saves the imports, all else in a shell.

    What is ``typed`` comes on its standard input.
    """
    words = shlex.split(command)
    if typed:
        program = [sys.executable, "-m", "automax_ros.cli.main", *words[1:]]
        lines = "".join(f"{line}\n" for line in typed)
        result = subprocess.run(
            program, cwd=folder, input=lines, capture_output=True, text=True, timeout=100, check=False
        )
        return Ended(result.returncode, result.stdout + result.stderr)
    if words[0] != "automax" or {"&&", "|", ";"} & set(words):
        result = subprocess.run(
            ["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=100, check=False
        )
        return Ended(result.returncode, result.stdout + result.stderr)
    target = ""
    if ">" in words:
        at = words.index(">")
        target, words = words[at + 1], words[:at]
    printed, told = io.StringIO(), io.StringIO()
    with standing_in(folder), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(told):
        code = main(words[1:])
    if target:
        (folder / target).write_text(printed.getvalue(), encoding="utf-8")
    return Ended(code, ("" if target else printed.getvalue()) + told.getvalue())


def shows(printed: str, shown: list[str]) -> str:
    """Return the first line that a page shows and a command did not print, "" if it printed all, in their order.

    ``...`` stands for any number of lines.
    """
    lines = iter(printed.splitlines())
    for wanted in shown:
        if wanted.strip() in ("...", ""):
            continue
        if not any(line.rstrip() == wanted.rstrip() for line in lines):
            return wanted
    return ""
