"""The examples of the pages: fenced blocks, with what their heads and the comments over them tell a test.

The head of a fence is its language, then a file's name (the block is that file) or words: ``exit=1`` (the commands
end with that code), ``live=NAME`` (they need a rack that runs), ``target=udc``. A comment over it,
``<!-- not run: why -->`` or ``<!-- run by test/... -->``, says why it is not executed here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(r"(?:^<!-- (?P<note>[^\n]*) -->\n)?^```(?P<head>[^\n`]*)\n(?P<text>.*?)^```$", re.M | re.S)
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted(path for name in ("config", "bags", "examples") for path in (ROOT / name).rglob("README.md")),
]
FILE = re.compile(r"[\w/]+\.\w+")


@dataclass(frozen=True)
class Fence:
    """A block: its page, the line of its head, its language, the words after it, its text, the note over it."""

    page: Path
    line: int
    language: str
    words: tuple[str, ...]
    text: str
    note: str

    @property
    def file(self) -> str:
        """The file that it is, or ""."""
        return next((word for word in self.words if FILE.fullmatch(word)), "")

    def word(self, key: str) -> str:
        """What stands after ``key=``, or ""."""
        return next((word.partition("=")[2] for word in self.words if word.startswith(f"{key}=")), "")

    @property
    def runs_here(self) -> bool:
        """Whether the tests of this folder execute it."""
        return not self.note.startswith(("not run: ", "run by "))

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def fences(page: Path) -> list[Fence]:
    """The blocks of a page."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in FENCE.finditer(text):
        language, *words = match["head"].split() or [""]
        line = text.count("\n", 0, match.start("head")) + 1
        found.append(Fence(page, line, language, tuple(words), match["text"], match["note"] or ""))
    return found
