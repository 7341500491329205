"""Every problem code has a page; its example provokes that code and nothing else, its cure does not."""

import dataclasses

import pytest
from core.problem_pages import PAGES, Fence, read_page

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declaration import Block, Processor
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import PROBLEMS
from automax_ros.language.checker import CheckResult, check

COMPILED = [code for code in PROBLEMS if code[3] in "024"]
"""Codes that the compiler reports: their examples are whole tasks."""
OTHERS = [code for code in PROBLEMS if code not in COMPILED]


def blocks() -> dict[str, Block]:
    """The catalogue, with a BIT_SELECT (section 9, AutoMax only) as long as it lacks one: some page needs such a block."""
    rack_only = frozenset({Processor.AUTOMAX, Processor.PC3000})
    stand_in = dataclasses.replace(
        CATALOGUE["TRANSITION"],
        name="BIT_SELECT",
        inputs=(dataclasses.replace(CATALOGUE["DIFFERENCE"].inputs[0], name="INPUT"),),
        outputs=(dataclasses.replace(CATALOGUE["TRANSITION"].outputs[0], name="OUTPUT0"),),
        runs_on=rack_only,
    )
    return {"BIT_SELECT": stand_in, **CATALOGUE}


def checked(fence: Fence) -> CheckResult:
    tick_ns = 500_000 if fence.target is Processor.UDC else 5_500_000
    return check(
        SourceText("task.blk", fence.text),
        name="TASK",
        catalogue=blocks(),
        target=fence.target,
        tick_ns=tick_ns,
        commons=fence.commons,
    )


@pytest.mark.parametrize("code", PROBLEMS)
def test_page_has_title_text_example_and_cure(code: str) -> None:
    page = read_page(code)
    assert page.title == f"# {code}: {PROBLEMS[code].title}"
    assert len(page.text) > 40
    assert all(len(line) <= 132 for line in page.text.splitlines())


def test_no_page_without_a_code() -> None:
    assert {path.stem for path in PAGES.iterdir()} == set(PROBLEMS)


@pytest.mark.parametrize("code", COMPILED)
def test_example_provokes_its_code_alone(code: str) -> None:
    result = checked(read_page(code).example)
    assert {item.code for item in result.diagnostics} == {code}
    assert (result.program is None) == (PROBLEMS[code].severity.value == "error")


@pytest.mark.parametrize("code", COMPILED)
def test_cure_compiles_without_a_word(code: str) -> None:
    result = checked(read_page(code).cure)
    assert result.diagnostics == []
    assert result.program is not None


@pytest.mark.parametrize("code", OTHERS)
def test_example_of_other_bands_is_a_task_or_a_file(code: str) -> None:
    page = read_page(code)
    assert {page.example.language, page.cure.language} <= {"blk", "yaml"}
    assert page.example.text.strip()
    assert page.cure.text.strip()
