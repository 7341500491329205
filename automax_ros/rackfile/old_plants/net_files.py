"""Quotes the lines of .NET files of version 2, which say where variables of GBLDEF lie; their form is not known.

A line is quoted next to each variable that it names, so that its place can be put in by hand: nothing of it is
interpreted (decision).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from automax_ros.core.text import printable
from automax_ros.core.types import bare_name
from automax_ros.rackfile.reading.files import FileFault, read_task_source

NET_SUFFIX = ".NET"
_WORD = re.compile(r"[A-Z_][A-Z0-9_]{0,15}")
_MOST_CHARACTERS = 80
_MOST_FILES = 100


def net_lines(folder: Path) -> Mapping[str, str]:
    """Return the first line of a folder's .NET files that names a word, by the word in upper case."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.upper() == NET_SUFFIX and path.is_file())
    except OSError:
        return {}
    return _lines(paths[:_MOST_FILES])


def _lines(paths: Iterable[Path]) -> dict[str, str]:
    found: dict[str, str] = {}
    for path in paths:
        try:
            lines = read_task_source(path).lines
        except FileFault:
            continue
        for number, line in enumerate(lines, 1):
            shown = printable(line).strip()[:_MOST_CHARACTERS]
            for word in _WORD.findall(line.upper()):
                found.setdefault(word, f"{printable(path.name)} line {number}: {shown}")
    return found


def quoted_for(name: str, lines: Mapping[str, str]) -> str:
    """Return what follows a variable's comment: the line that names it, "" if none does."""
    line = lines.get(bare_name(name))
    return "" if line is None else f"; {line}"
