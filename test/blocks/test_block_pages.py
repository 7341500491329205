"""The pages of docs/blocks/: written from the declarations as they are now, with an example of every block."""

import importlib.util
from pathlib import Path

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.examples import EXAMPLES, table_of

ROOT = Path(__file__).resolve().parents[2]


def generated() -> dict[str, str]:
    spec = importlib.util.spec_from_file_location("generate_block_pages", ROOT / "tools" / "generate_block_pages.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.pages()


def test_the_pages_are_current():
    """``.venv/bin/python tools/generate_block_pages.py`` writes them."""
    written = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "blocks").glob("*.md")}
    assert written == generated()


def test_every_block_has_one_example():
    assert sorted(example.block for example in EXAMPLES) == [name for name, block in CATALOGUE.items() if block.step]


def test_every_block_stands_on_one_page():
    pages = generated()
    for name in CATALOGUE:
        assert sum(f"\n## {name}\n" in text for text in pages.values()) == 1


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.block)
def test_an_example_shows_its_block_at_work(example):
    """Inputs change or time passes, and at least one output changes with them."""
    head, *rows = table_of(example)
    assert len(rows) >= 2
    assert all(len(row) == len(head) for row in rows)
    assert len({tuple(row[-len(example.shown) :]) for row in rows}) > 1
    lengths = {len(column) for column in (*example.varied.values(), *example.shift.values())}
    assert lengths == {example.scans}


def column(name: str, output: str) -> list[str]:
    """A column of a block's example."""
    head, *rows = table_of(next(example for example in EXAMPLES if example.block == name))
    return [row[head.index(output)] for row in rows]


def test_examples_with_the_manuals_numbers():
    assert column("SCALE", "OUTPUT")[:3] == ["0", "5000", "10000"]
    assert column("SEARCH", "OUTPUT")[0] == "3"
    assert int(column("INTEGRATE", "OUTPUT")[-1]) == pytest.approx(1200 * 50 * 0.022, abs=14)
