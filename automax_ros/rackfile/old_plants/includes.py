"""Writes include files (.INC) into the tasks that name them.

No source at hand prints the statement that does so: it is taken to be ``nnn INCLUDE NAME``, with or without quotes,
folders and .INC (decision). The lines of the file come in its place if their numbers fit between those around it; lines
without numbers get those that follow the statement's own, if these are free (decision). The statement stays as a
remark, unless the file has a line with its number.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath

from automax_ros.core.text import quoted
from automax_ros.language.text.lexer import END_OF_FILE
from automax_ros.rackfile.old_plants.decoding import ONE_BYTE, decoded
from automax_ros.rackfile.reading.files import FileFault, is_inside, read_bytes

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
"""Longest text that is made, and most characters of the files that it includes (decision: a bound on untrusted files).
"""


@dataclass
class Included:
    """A text with its include files, their names, and why others are not in it."""

    text: str
    files: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def with_includes(text: str, read: ReadInclude) -> Included:
    """Return a text, lines ended by LF, with the include files that it names, as far as they fit."""
    inlining = _Inlining(read)
    lines = inlining.inlined(text.split("\n"), _LAST_NUMBER + 1, 0)
    return Included("\n".join(lines), inlining.files, inlining.refused)


def include_files(folder: Path) -> Mapping[str, Path]:
    """Return the include files of a folder by their names in upper case; links out of it are not among them."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.upper() == INCLUDE_SUFFIX)
    except OSError:
        return {}
    return {path.name.upper(): path for path in reversed(paths) if is_inside(path, folder)}


def include_reader(files: Mapping[str, Path], code_page: str = ONE_BYTE) -> ReadInclude:
    """Return what reads include files, given by their names in upper case; those that cannot be read are None."""

    def read(name: str) -> str | None:
        try:
            return decoded(read_bytes(files[name]), code_page)[0] if name in files else None
        except FileFault:
            return None

    return read


@dataclass(frozen=True)
class _IncludeFile:
    """The lines of an include file that are not blank; ``heads`` are the rows of those that continue no other.

    ``numbers`` are the line numbers of these, in order only if ``ascending``, which also says that none lacks its own.
    """

    lines: Sequence[str]
    heads: Sequence[int]
    numbers: Sequence[int]
    ascending: bool

    @classmethod
    def of(cls, text: str) -> _IncludeFile:
        plain = text.partition(END_OF_FILE)[0].replace("\r\n", "\n").replace("\r", "\n")
        lines = [line for line in plain.split("\n") if line.strip()]
        heads = [row for row in range(len(lines)) if row == 0 or not lines[row - 1].rstrip().endswith("&")]
        numbers = [int(match[1]) for row in heads if (match := _NUMBERED.match(lines[row]))]
        return cls(lines, heads, numbers, len(numbers) == len(heads) and numbers == sorted(set(numbers)))

    def between(self, number: int, following: int) -> list[str] | None:
        """Return the lines with numbers from the statement's to the next; None if they do not fit."""
        if self.numbers:
            fits = self.ascending and number <= self.numbers[0] and self.numbers[-1] < following
            return list(self.lines) if fits else None
        if number + len(self.heads) >= following:
            return None
        numbered = list(self.lines)
        for place, row in enumerate(self.heads, 1):
            numbered[row] = f"{number + place} {numbered[row].lstrip()}"
        return numbered


@dataclass
class _Inlining:
    """Writes include files into one text; each file is read once."""

    read: ReadInclude
    files: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    _known: dict[str, _IncludeFile | None] = field(default_factory=dict)
    _read_characters: int = 0

    def inlined(self, lines: Sequence[str], following: int, depth: int) -> list[str]:
        """Return lines with their include files; ``following`` is the number of the line after them."""
        result: list[str] = []
        size = 0
        for row, (line, after) in enumerate(zip(lines, _numbers_after(lines, following), strict=True)):
            match = _STATEMENT.match(line)
            taken = self._lines_for(match, after, depth) if match else None
            added = [line] if taken is None else taken
            result += added
            size += sum(map(len, added))
            if size > _MOST_CHARACTERS:
                self.refused.append(f"the text with its include files has more than {_MOST_CHARACTERS} characters")
                return [*result, *lines[row + 1 :]]
        return result

    def _lines_for(self, match: re.Match[str], following: int, depth: int) -> list[str] | None:
        """Return the lines that take the place of a statement, None if it stays."""
        number = int(match[1])
        stem = PureWindowsPath(match[3]).name.upper()
        name = stem if stem.endswith(INCLUDE_SUFFIX) else stem + INCLUDE_SUFFIX
        file = self._file(name) if depth < _DEEPEST else None
        if file is None:
            why = "it is not next to the task" if depth < _DEEPEST else "it is included within too many others"
            if self._read_characters > _MOST_CHARACTERS:
                why = f"the include files have more than {_MOST_CHARACTERS} characters"
            self.refused.append(f"line {number} includes {quoted(name)}: {why}")
            return None
        numbered = file.between(number, following)
        if numbered is None:
            between = f"after {number}" if following > _LAST_NUMBER else f"between {number} and {following}"
            self.refused.append(f"{quoted(name)} stays out: its line numbers do not fit {between}; renumber it")
            return None
        self.files.append(name)
        remark = [] if file.numbers[:1] == [number] else [f"{number} ! INCLUDE {name}"]
        return [*remark, *self.inlined(numbered, following, depth + 1)]

    def _file(self, name: str) -> _IncludeFile | None:
        """Return an include file, None if it cannot be read or is too much with those that were read before."""
        if name not in self._known:
            text = self.read(name) if self._read_characters <= _MOST_CHARACTERS else None
            self._read_characters += len(text or "")
            is_too_much = self._read_characters > _MOST_CHARACTERS
            self._known[name] = None if text is None or is_too_much else _IncludeFile.of(text)
        return self._known[name]


def _numbers_after(lines: Sequence[str], following: int) -> list[int]:
    """Return, for each line, the number of the next line with one, or ``following``."""
    found: list[int] = []
    for line in reversed(lines):
        found.append(following)
        match = _NUMBERED.match(line)
        following = int(match[1]) if match else following
    return found[::-1]
