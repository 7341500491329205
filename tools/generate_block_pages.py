"""Writes docs/blocks/: a page for each family of control blocks, from their declarations and examples.

Run python tools/generate_block_pages.py after a change in automax_ros/blocks/.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from automax_ros.blocks.catalogue import FAMILIES, Family
from automax_ros.blocks.declare.declaration import Block, Input, Output, Platform
from automax_ros.blocks.describe import (
    UNKNOWN_TIME,
    input_rows,
    limit_rows,
    output_rows,
    template,
    time_rows,
)
from automax_ros.blocks.examples import EXAMPLES, Example, table_of
from automax_ros.core.problems import PROBLEMS

TARGET = Path(__file__).resolve().parent.parent / "docs" / "blocks"
INDEX = "README.md"


def pages(families: Sequence[Family] = FAMILIES, examples: Sequence[Example] = EXAMPLES) -> dict[str, str]:
    """Return the text of every page by its file name."""
    return {INDEX: index(families), **{f"{family.name}.md": page(family, examples) for family in families}}


def index(families: Sequence[Family]) -> str:
    """Return the page that lists all blocks."""
    lines = [
        "# The control blocks",
        "",
        "Written from the declarations in `automax_ros/blocks/` by `tools/generate_block_pages.py`. `automax blocks`",
        "with a name prints the same of one block, `automax blocks --template > TEMPLATE.BLK` writes a CALL of each to",
        "paste. Sections are those of J-3676-5.",
    ]
    for family in families:
        lines += ["", f"## [{family.title}]({family.name}.md)", "", family.about, ""]
        links = [f"[{block.name}]({family.name}.md#{block.name.lower()})" for block in family.blocks]
        rows = [[link, block.section, block.function] for link, block in zip(links, family.blocks, strict=True)]
        lines += markdown_table(["block", "section", "what it does"], rows)
    return "\n".join(lines) + "\n"


def page(family: Family, examples: Sequence[Example]) -> str:
    """Return the page of a family."""
    lines = [f"# {family.title}", "", family.about]
    for block in family.blocks:
        lines += ["", *described(block), *example_of(block, examples)]
    return "\n".join(lines) + "\n"


def described(block: Block) -> Iterator[str]:
    """Yield the lines that describe a block."""
    yield from (f"## {block.name}", "", f"{block.title}, section {block.section}. Runs on {runs_on(block)}.", "")
    yield from ("```text", block.function, "```", "")
    yield from markdown_table(
        ["input", "symbol", "type", "needed", "form", "meaning"], shortened(input_rows(block), block.inputs)
    )
    if block.outputs:
        yield ""
        yield from markdown_table(
            ["output", "symbol", "type", "needed", "meaning"], shortened(output_rows(block), block.outputs)
        )
    if block.coefficients is not None:
        yield ""
        rows = [[row[0], row[1], row[3]] for row in limit_rows(block) if len(row) == 4]
        yield from markdown_table(["parameter", "lowest", "highest"], rows)
    sentences = [*(rule.text for rule in block.rules), *block.notes]
    sentences += [f"Logs {code}, {PROBLEMS[code].title}." for code in block.problems]
    if sentences:
        yield ""
        yield from (f"- {text}" for text in sentences)
    yield ""
    times = [list(row) for row in time_rows(block)]
    yield from markdown_table(["Processor", "execution time, microseconds"], times) if times else (UNKNOWN_TIME,)
    yield from ("", "```text", *template(block).splitlines(), "```")


def example_of(block: Block, examples: Sequence[Example]) -> Iterator[str]:
    """Yield the lines of a block's example."""
    for example in examples:
        if example.block == block.name:
            fixed = ", ".join(f"{name}={text_of(value)}" for name, value in example.fixed.items())
            about = " ".join(part for part in (example.about, f"With {fixed}." if fixed else "") if part)
            yield from ("", f"Example. {about}".rstrip() if about else "Example.", "")
            head, *rows = table_of(example)
            yield from markdown_table(head, rows)


def text_of(value: object) -> str:
    """Return a fixed input as it is written in a task, a table by its elements."""
    if isinstance(value, tuple):
        return f"({', '.join(str(item) for item in value)})"
    return str(value).upper() if isinstance(value, bool) else str(value)


def runs_on(block: Block) -> str:
    """Return the Processors that run a block."""
    names = {Platform.AUTOMAX: "AutoMax", Platform.PC3000: "PC3000", Platform.UDC: "UDC"}
    return ", ".join(name for processor, name in names.items() if processor in block.runs_on)


def shortened(rows: Sequence[tuple[str, ...]], items: Sequence[Input | Output]) -> list[list[str]]:
    """Return rows of parameters, with the channels from the third to the last but one as one row of dots."""
    short: list[list[str]] = []
    for row, item in zip(rows, items, strict=True):
        stem = item.name.rstrip("0123456789")
        number = item.name.removeprefix(stem)
        last = max(int(n) for other in items if (n := other.name.removeprefix(stem)).isdigit()) if number else 0
        first = min(int(n) for other in items if (n := other.name.removeprefix(stem)).isdigit()) if number else 0
        if number and last - first > 3 and first + 1 < int(number) < last:
            if int(number) == first + 2:
                short.append([f"{stem}{number} ...", *("" for _ in row[1:])])
            continue
        short.append(list(row))
    return short


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    return [*lines, *(f"| {' | '.join(cell.replace('|', '&#124;') for cell in row)} |" for row in rows)]


def main() -> None:
    """Write the pages and remove those of families that no longer exist."""
    TARGET.mkdir(parents=True, exist_ok=True)
    texts = pages()
    for path in TARGET.glob("*.md"):
        if path.name not in texts:
            path.unlink()
    for name, text in texts.items():
        (TARGET / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
