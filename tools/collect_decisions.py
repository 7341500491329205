"""Writes docs/decisions.md: the project's decisions where the manuals are silent, from the marks in the package.

Run python tools/collect_decisions.py after a mark was added or changed. A mark is "(decision)" in a sentence of a
docstring, a comment or a problem's page; "(decision: the reason)" and "(decision): the reason" say why.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "automax_ros"
TARGET = ROOT / "docs" / "decisions.md"
MARK = re.compile(
    r"\s*\((?:(?P<section>[\d.]+), )?decisions?(?:: (?P<why>[^()]*(?:\([^()]*\)[^()]*)*))?\)(?:: (?P<reason>.*))?"
)
"""A mark, with the section it interprets and the reason, where they are given."""
SENTENCE = re.compile(r"(?<=\.)\s+(?=[\"'`(A-Z0-9])")
"""The space between two sentences of a paragraph."""
ITEM = re.compile(r"\n(?=[-*#] | +\w+: )")
"""The line break before an item of a list, a heading, or an argument of a docstring."""
LONGEST_VALUE = 40
"""Longest value of a constant that is printed after its name, in characters."""
HEAD = """# Decisions

What the emulator does where the manuals are silent, ambiguous or contradict themselves, and the bounds that it sets.
`tools/collect_decisions.py` collects this page from the marks "(decision)" in the code. Sections are those of J-3676-5.
[language.md](language.md) marks the decisions of the language with *.
"""


class Decision(NamedTuple):
    """A marked sentence: the decision, the reason (or empty), the file below the package, and the name in it."""

    statement: str
    reason: str
    file: str
    name: str

    @property
    def room(self) -> str:
        """The room, or "automax_ros" for a file outside of all rooms."""
        return self.file.partition("/")[0] if "/" in self.file else "automax_ros"


def document() -> str:
    """Return the whole page."""
    found = decisions()
    parts = [HEAD]
    for room in dict.fromkeys(item.room for item in found):
        rows = [row(item) for item in found if item.room == room]
        parts += [f"## {room}/\n", "| where | decision | reason |\n| --- | --- | --- |\n" + "\n".join(rows) + "\n"]
    return "\n".join(parts)


def row(decision: Decision) -> str:
    """Return a decision as a row of a table in Markdown."""
    file = decision.file.partition("/")[2] or decision.file
    where = f"`{file}`" + (f" `{decision.name}`" if decision.name else "")
    return f"| {' | '.join(cell.replace('|', '&#124;') for cell in (where, decision.statement, decision.reason))} |"


def decisions() -> list[Decision]:
    """Return every decision of the package, files in alphabetical order, each from top to bottom."""
    found: list[Decision] = []
    for path in sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.md")]):
        file = path.relative_to(PACKAGE).as_posix()
        text = path.read_text(encoding="utf-8")
        for _, name, prose in sorted(texts_of(text)) if path.suffix == ".py" else [(0, "", text)]:
            found += [Decision(statement, reason, file, name) for statement, reason in marked(prose)]
    return found


def marked(prose: str) -> Iterator[tuple[str, str]]:
    """Yield the marked sentences of a text, without their marks, and their reasons."""
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(prose)):
        for item in ITEM.split(paragraph):
            for sentence in SENTENCE.split(" ".join(item.split())):
                match = MARK.search(sentence)
                if match is not None:
                    section = f" (section {match['section']})" if match["section"] else ""
                    statement = (sentence[: match.start()] + section + sentence[match.end() :]).lstrip("- ").rstrip(".")
                    yield statement + ".", (match["why"] or match["reason"] or "").rstrip(".")


def texts_of(source: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, name and text of every docstring, attribute docstring, and run of comments."""
    tree = ast.parse(source)
    yield from docstrings(tree, "")
    for line, comment in comments(source):
        yield line, name_at(tree, line), comment


def docstrings(
    node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef, name: str
) -> Iterator[tuple[int, str, str]]:
    """Yield line, name and text of the docstrings in a module, class or function, and of its attributes."""
    before: ast.stmt | None = None
    for statement in node.body:
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            if isinstance(statement.value.value, str):
                yield (
                    statement.lineno,
                    name if before is None else f"{name}.{attribute(before)}".lstrip("."),
                    statement.value.value,
                )
        elif isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield from docstrings(statement, f"{name}.{statement.name}".lstrip("."))
        before = statement


def attribute(statement: ast.stmt) -> str:
    """Return the name that a statement assigns, with its value where that is short."""
    if not isinstance(statement, ast.Assign | ast.AnnAssign):
        return ""
    target = statement.target if isinstance(statement, ast.AnnAssign) else statement.targets[0]
    value = "" if statement.value is None else f" = {ast.unparse(statement.value)}"
    return ast.unparse(target) + (value if len(value) <= LONGEST_VALUE else "")


def comments(source: str) -> Iterator[tuple[int, str]]:
    """Yield the first line and the text of each run of comments."""
    run: list[str] = []
    first = last = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            if run and token.start[0] != last + 1:
                yield first, "\n".join(run)
                run = []
            first, last = (first if run else token.start[0]), token.start[0]
            run.append(token.string.lstrip("# "))
    if run:
        yield first, "\n".join(run)


def name_at(tree: ast.Module, line: int) -> str:
    """Return the name of the class, function or attribute to which a line belongs."""
    names: list[str] = []
    body: list[ast.stmt] = tree.body
    while True:
        inner = next((item for item in body if item.lineno <= line <= (item.end_lineno or 0)), None)
        if isinstance(inner, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            names.append(inner.name)
            body = inner.body
        else:
            return ".".join([*names, *([attribute(inner).partition(" ")[0]] if inner and attribute(inner) else [])])


def main() -> None:
    """Write the page."""
    TARGET.write_text(document(), encoding="utf-8")


if __name__ == "__main__":
    main()
