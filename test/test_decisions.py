"""docs/decisions.md holds every decision that the package marks, as it is marked now."""

import importlib.util
import re
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def collector() -> ModuleType:
    spec = importlib.util.spec_from_file_location("collect_decisions", ROOT / "tools" / "collect_decisions.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_current(collector):
    """``.venv/bin/python tools/collect_decisions.py`` writes it."""
    assert (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8") == collector.document()


def test_every_mention_of_a_decision_is_a_mark_that_is_collected(collector):
    """A mark of another form would be lost silently."""
    collected = Counter(item.file for item in collector.decisions())
    mentions = Counter[str]()
    for path in [*collector.PACKAGE.rglob("*.py"), *collector.PACKAGE.rglob("*.md")]:
        words = re.findall(r"\bdecisions?\b", path.read_text(encoding="utf-8"), re.IGNORECASE)
        mentions[path.relative_to(collector.PACKAGE).as_posix()] += len(words)
    assert +mentions == collected


@pytest.mark.parametrize(
    ("source", "name", "statement", "reason"),
    [
        ('LIMIT = 3\n"""Most of it (decision)."""\n', "LIMIT = 3", "Most of it.", ""),
        ('LIMIT: int = 3\n"""Most of it (decision: a bound)."""\n', "LIMIT = 3", "Most of it.", "a bound"),
        ('def act():\n    """First. It does so (decision): why. Then."""\n', "act", "It does so.", "why"),
        (
            'class A:\n    def act():\n        """It\n        clamps (4.2, decision)."""\n',
            "A.act",
            "It clamps (section 4.2).",
            "",
        ),
        ("def act():\n    # it does\n    # so (decision)\n    pass\n", "act", "it does so.", ""),
        ('def act():\n    """Act.\n\n    Args:\n        x: s; three (decision).\n    """\n', "act", "x: s; three.", ""),
    ],
)
def test_a_mark_is_found_with_its_sentence_and_its_place(collector, source, name, statement, reason):
    found = [(where, *pair) for _, where, prose in collector.texts_of(source) for pair in collector.marked(prose)]
    assert found == [(name, statement, reason)]
