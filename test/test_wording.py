"""The wording of docs/glossary.md: messages, docstrings, comments, pages and docs avoid what it replaces."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WITH_THE_WORDS = {Path(__file__), ROOT / "docs" / "glossary.md"}
FOLDERS = ("automax_ros", "docs", "config", "tools", "bench", "launch", "test")
ENDINGS = {".py", ".md", ".txt", ".sh"}
"""Sources that recordings carry (.BLK, .yaml, .msg) keep their words, or recordings of the same run would change."""

LATE = re.compile(r"\b(?:lags?|left|leaves?|falls?|counts|memory) behind\b|\bcause is behind\b")
"""Where "behind" is right."""
AMOUNT = (
    "counts|scans|messages|bytes|bits|words|rows?|files?|lines?|pages?|points|samples|ticks|times|steps|arrays?|characters?"
    "|columns?|family|once|twice|MB|MiB|ns|us|ms"
)
WHOLE = (
    "second|minute|hour|day|scan|tick|cycle|message|block|byte|word|row|line|column|file|task|rule|subcommand|module"
    "|topic|error|family"
)

PHRASES = {
    r"\bbehind\b": "after, or: that follows",
    r"(?<!there )\b(?:is|are|was|were) no (?!longer\b|more than\b|less than\b)": "is not a",
    r"\bso many\b": "this many",
    rf"\b(?:{AMOUNT}) an? (?:{WHOLE})\b": "per",
    r"\bbeside\b": "next to, with, apart from",
    r"\banew\b": "again",
    r"\bwithout a word\b": "silently",
    r"\btells (?:why|whether|how|what|which|where)\b": "says, shows, gives",
}
"""What we do not write, as a pattern, and what we write."""


def texts() -> Iterator[tuple[Path, str]]:
    """The project's own words, by file."""
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in ENDINGS]
    for path in sorted({*files, *ROOT.glob("*.md")} - WITH_THE_WORDS):
        yield path, LATE.sub("late", path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("phrase", PHRASES)
def test_nobody_writes(phrase: str) -> None:
    pattern = re.compile(phrase, re.IGNORECASE)
    places = [
        f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]!r}: {PHRASES[phrase]}"
        for path, text in texts()
        for match in pattern.finditer(text)
    ]
    assert places == []


@pytest.mark.parametrize(
    "text", ["a row a scan", "it is no number", "100 times a second", "so many counts", "the line behind it"]
)
def test_the_patterns_find(text: str) -> None:
    assert any(re.search(phrase, text) for phrase in PHRASES)


@pytest.mark.parametrize("text", ["there is no number", "it is no longer there", "scan a line", "it starts a scan"])
def test_the_patterns_pass(text: str) -> None:
    assert not any(re.search(phrase, text) for phrase in PHRASES)
