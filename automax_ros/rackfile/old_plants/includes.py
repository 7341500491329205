"""Writes include files (.INC) of BASIC into the tasks that name them.

No source at hand prints the statement that names an include file. Taken is ``nnn INCLUDE NAME``, with or without
quotes, folders and .INC (decision). The lines of the file take its place if their numbers fit between those around it;
lines without numbers get the numbers that follow the statement's own, if these are free (decision). The statement stays
as a remark.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath

from automax_ros.core.text import quoted
from automax_ros.language.text.lexer import END_OF_FILE
from automax_ros.rackfile.reading.files import FileFault, is_inside, read_task_source

INCLUDE_SUFFIX = ".INC"
ReadInclude = Callable[[str], "str | None"]
"""Returns the text of an include file by its name in upper case with .INC; None if there is none."""
_STATEMENT = re.compile(
    r"""\s*([0-9]{1,5})\s+INCLUDE\b\s*[:=(]?\s*(["']?)([^"'()\s]{1,100})\2\s*\)?\s*$""", re.IGNORECASE
)
_NUMBERED = re.compile(r"\s*([0-9]{1,5})(?![0-9])")
_LAST_NUMBER = 32767
_DEEPEST = 4
"""Include files within include files that are followed (decision)."""
_MOST_CHARACTERS = 2_000_000
"""Longest text that is made (decision: a bound on files that include each other)."""


@dataclass
class Included:
    """A text with its include files, their names, and why others are not in it."""

    text: str
    files: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def with_includes(text: str, read: ReadInclude) -> Included:
    """Return a text, lines ended by LF, with the include files that it names, as far as they fit."""
    found = Included("")
    found.text = "\n".join(_inlined(text.split("\n"), read, found, 0))
    return found


def include_reader(folder: Path) -> ReadInclude:
    """Return what reads the include files of a folder, their names in any case; those that cannot be read are None."""

    def read(name: str) -> str | None:
        try:
            paths = sorted(path for path in folder.iterdir() if path.name.upper() == name and is_inside(path, folder))
            return read_task_source(paths[0]).text if paths else None
        except (OSError, FileFault):
            return None

    return read


def _inlined(lines: list[str], read: ReadInclude, found: Included, depth: int) -> list[str]:
    result: list[str] = []
    size = 0
    for row, line in enumerate(lines):
        match = _STATEMENT.match(line)
        taken = _lines_of(match, lines[row + 1 :], read, found, depth) if match else None
        result += [line] if taken is None else taken
        size += sum(map(len, result[-len(taken or [line]) :]))
        if size > _MOST_CHARACTERS:
            found.refused.append(f"the text with its include files has more than {_MOST_CHARACTERS} characters")
            return result + lines[row + 1 :]
    return result


def _lines_of(
    match: re.Match[str], after: list[str], read: ReadInclude, found: Included, depth: int
) -> list[str] | None:
    """Return the lines that take the place of a statement, None if it stays."""
    number = int(match[1])
    stem = PureWindowsPath(match[3]).name.upper()
    name = stem if stem.endswith(INCLUDE_SUFFIX) else stem + INCLUDE_SUFFIX
    text = read(name) if depth < _DEEPEST else None
    if text is None:
        why = "it is not next to the task" if depth < _DEEPEST else "it is included within too many others"
        found.refused.append(f"line {number} includes {quoted(name)}: {why}")
        return None
    lines = text.partition(END_OF_FILE)[0].replace("\r\n", "\n").replace("\r", "\n").split("\n")
    own = [line for line in lines if line.strip()]
    following = next((int(item[1]) for item in map(_NUMBERED.match, after) if item), _LAST_NUMBER + 1)
    numbered = _numbered(own, number, following)
    if numbered is None:
        between = f"after {number}" if following > _LAST_NUMBER else f"between {number} and {following}"
        found.refused.append(f"{quoted(name)} stays out: its line numbers do not fit {between}; renumber it")
        return None
    found.files.append(name)
    first = _NUMBERED.match(numbered[0]) if numbered else None
    remark = [] if first is not None and int(first[1]) == number else [f"{number} ! INCLUDE {name}"]
    return [*remark, *_inlined(numbered, read, found, depth + 1)]


def _numbered(lines: list[str], number: int, following: int) -> list[str] | None:
    """Return the lines of an include file with numbers from the statement's to the next; None if they do not fit."""
    heads = [row for row in range(len(lines)) if row == 0 or not lines[row - 1].rstrip().endswith("&")]
    found = [_NUMBERED.match(lines[row]) for row in heads]
    if not any(found):
        if number + len(heads) >= following:
            return None
        numbers = {row: number + place for place, row in enumerate(heads, 1)}
        return [f"{numbers[row]} {line.lstrip()}" if row in numbers else line for row, line in enumerate(lines)]
    given = [int(match[1]) for match in found if match]
    fits = len(given) == len(heads) and given == sorted(set(given)) and number <= given[0] and given[-1] < following
    return lines if fits else None
