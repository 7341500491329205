"""Rack files on the command line: which file is meant, reading it."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from automax_ros.cli.usage import UsageError
from automax_ros.core.text import count_of
from automax_ros.language.syntax.task_kind import is_task_file
from automax_ros.rack.config import RackConfig
from automax_ros.rack.loader import LoadResult, load
from automax_ros.rack.modules.registry import SUPPORTED

DEFAULT_RACK_FILE = "rack.yaml"
"""What a folder means where a rack file is asked for."""
_CANNOT_BE_READ = "AMX6000"
_NOT_A_TEXT = frozenset({"AMX6001", "AMX6002"})


def add_set_argument(parser: argparse.ArgumentParser, *, tunables: bool = False) -> None:
    """Add ``--set``, any number of times, as ``settings``; it may take ``tunables``, too."""
    what = "a common variable, or tune TASK.NAME," if tunables else "a common variable"
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="settings",
        help=f"write {what} before the tasks start; may be given again",
    )


def add_outside_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--allow-outside``."""
    parser.add_argument(
        "--allow-outside", action="store_true", help="let the rack file name task sources outside its own folder"
    )


def load_rack_file(path: Path, *, allow_outside: bool) -> LoadResult:
    """Read a rack file, or the ``rack.yaml`` of a folder.

    Raises:
        UsageError: it cannot be read, or is a task.
    """
    path = _meant(path)
    result = load(path, allow_outside=allow_outside)
    for item in result.diagnostics:
        if item.code == _CANNOT_BE_READ:
            raise UsageError(f"{path}: {item.message}")
    return result


def is_rack_folder(path: Path) -> bool:
    """Whether a path is a folder with a ``rack.yaml``."""
    return (path / DEFAULT_RACK_FILE).is_file()


def is_text(result: LoadResult) -> bool:
    """Whether a rack file could be read as text; too large, or not UTF-8, it counts as unreadable."""
    return not any(item.code in _NOT_A_TEXT for item in result.diagnostics)


def size_of(rack: RackConfig) -> str:
    """Return what a rack consists of, in words."""
    modules = Counter(SUPPORTED[module.model].word for module in rack.task_modules)
    counts = [(number, f"{word[0].upper()}{word[1:]}") for word, number in modules.items()]
    counts += [(len(rack.placed_tasks), "task"), (len(rack.declared), "common")]
    return ", ".join(count_of(number, thing) for number, thing in counts)


def _meant(path: Path) -> Path:
    """Return the rack file that an argument means.

    Raises:
        UsageError: it is a task, or a folder without a rack file.
    """
    if is_task_file(path):
        hint = f"`automax trace {path} --input IN.csv` runs a task alone; `automax new {path.parent}` makes a rack file"
        raise UsageError(f"{path} is a task, and a rack is made of its rack file (.yaml)", hint)
    if not path.is_dir():
        return path
    found = path / DEFAULT_RACK_FILE
    if not is_rack_folder(path):
        hint = f"name the rack's YAML file; `automax new {path}` makes one from the folder's tasks"
        raise UsageError(f"{path} is a folder without a {DEFAULT_RACK_FILE}", hint)
    return found
