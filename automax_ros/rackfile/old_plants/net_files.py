"""Quotes the lines of .NET files of version 2, which say where variables of GBLDEF lie; their form is not known.

A line is quoted next to each variable that it names, so that its place can be put in by hand: nothing of it is
interpreted (decision).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.text import printable
from automax_ros.core.types import bare_name
from automax_ros.rackfile.reading.files import FileFault, is_inside, read_task_source

NET_SUFFIX = ".NET"
_WORD = re.compile(r"[A-Z_][A-Z0-9_]{0,15}")
_MOST_CHARACTERS = 80
_MOST_FILES = 100


@dataclass(frozen=True)
class NetLines:
    """The first line that names a word, by the word in upper case; ``left_out``: files that are not read, with why."""

    lines: dict[str, str] = field(default_factory=dict)
    left_out: list[tuple[str, str]] = field(default_factory=list)


def net_lines(folder: Path) -> NetLines:
    """Return the lines of a folder's .NET files."""
    found = NetLines()
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.upper() == NET_SUFFIX)
    except OSError:
        return found
    for number, path in enumerate(paths):
        name = printable(path.name)
        if number == _MOST_FILES:
            found.left_out.append((name, f"and all after it come after the first {_MOST_FILES} .NET files"))
            break
        if not is_inside(path, folder):
            found.left_out.append((name, "is a link out of the folder"))
            continue
        try:
            lines = read_task_source(path).lines
        except FileFault as fault:
            found.left_out.append((name, str(fault)))
            continue
        for row, line in enumerate(lines, 1):
            shown = printable(line).strip()[:_MOST_CHARACTERS]
            for word in _WORD.findall(line.upper()):
                found.lines.setdefault(word, f"{name} line {row}: {shown}")
    return found


def quoted_for(name: str, lines: Mapping[str, str]) -> str:
    """Return what follows a variable's comment: the line that names it, "" if none does."""
    line = lines.get(bare_name(name))
    return "" if line is None else f"; {line}"
