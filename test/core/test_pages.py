"""Every problem code has a page; its example provokes that code and nothing else, its cure does not."""

import dataclasses

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import PROBLEMS
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.parse.parser import SOURCE_LIMIT
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT
from core.problem_pages import PAGES, Fence, read_page

COMPILED = [code for code in PROBLEMS if code[3] in "024"]
"""Codes that the compiler reports: their examples are whole tasks."""


def whole(code: str, text: str) -> str:
    """The example, where it stands for a text too long to be printed."""
    if code == "AMX0001":
        return text.replace("...", "." * SOURCE_LIMIT, 1)
    if code == "AMX0006":
        return text.encode("utf-16").decode("latin-1")
    if code == "AMX0002":
        line = text.splitlines()[2]
        more = [f"{number} {line.partition(' ')[2]}" for number in range(1000, 1000 + DIAGNOSTIC_LIMIT)]
        return "\n".join([*text.splitlines()[:-1], *more, "9999 END"])
    return text


def checked(fence: Fence) -> CheckResult:
    return check(
        SourceText(f"task.{fence.language}", fence.text),
        name="TASK",
        catalogue=CATALOGUE,
        target=fence.target,
        tick_ns=fence.tick_ns,
        commons=fence.commons,
    )


def unprotected(fence: Fence, code: str) -> bool:
    """Whether a finding is the warning that a short example for a UDC leaves out THERMAL_OVERLOAD."""
    short = fence.target is Platform.UDC and "COMMON FB%" not in fence.text
    return short and code == "AMX4097"


@pytest.mark.parametrize("code", PROBLEMS)
def test_page_has_title_text_and_cure(code: str) -> None:
    """What the examples of racks, bags and run time show is tested where those are."""
    title, _, text = (PAGES / f"{code}.md").read_text(encoding="utf-8").partition("\n")
    assert title == f"# {code}: {PROBLEMS[code].title}"
    explanation, cure = text.split("\n## Cure\n")
    assert len(explanation.partition("\n## Example\n")[0].split()) >= 4
    assert cure.strip()


def test_no_page_without_a_code() -> None:
    assert {path.stem for path in PAGES.iterdir()} <= set(PROBLEMS)


@pytest.mark.parametrize("code", COMPILED)
def test_example_provokes_its_code_alone(code: str) -> None:
    example = read_page(code).example
    result = checked(dataclasses.replace(example, text=whole(code, example.text)))
    besides = {"AMX0040"} if code == "AMX0002" else set()
    assert {item.code for item in result.diagnostics if not unprotected(example, item.code)} == {code} | besides
    assert (result.program is None) == (PROBLEMS[code].severity.value == "error")


@pytest.mark.parametrize("code", COMPILED)
def test_cure_compiles_without_a_word(code: str) -> None:
    cure = read_page(code).cure
    result = checked(cure)
    assert [item for item in result.diagnostics if not unprotected(cure, item.code)] == []
    assert result.program is not None
