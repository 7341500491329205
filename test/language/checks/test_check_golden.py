"""The checker's findings as a person reads them, frozen: test/golden/diagnostics/check_*.BLK."""

from pathlib import Path

import pytest
from golden_text import GOLDEN, check_golden

from automax_ros.core.diagnostics import SourceText, render_all
from language.check_support import check_text

TASKS = sorted((GOLDEN / "diagnostics").glob("check_*.BLK"))


def test_there_are_golden_tasks() -> None:
    assert len(TASKS) >= 5


@pytest.mark.parametrize("path", TASKS, ids=lambda path: path.stem)
def test_rendered_findings(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    rendered = render_all(check_text(text).diagnostics, SourceText(path.name, text))
    check_golden(path.with_suffix(".expected.txt"), rendered)
