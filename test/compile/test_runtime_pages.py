"""The pages of run-time problems: the example logs exactly its code when it runs, the cure logs nothing."""

from __future__ import annotations

import pytest
from core.problem_pages import PAGES, read_page

from automax_ros.core.problems import PROBLEMS
from automax_ros.running.task import Status

from .support import task_of

SCANS = 20
CODES = [code for code in PROBLEMS if code.startswith("AMX7")]
WITHOUT_EXAMPLE = {"AMX7042", "AMX7070"}
"""No task can provoke these by itself: the host does, or the rack."""


def codes_of(text: str) -> tuple[set[int], Status]:
    """What a task logs over some scans, and how it ends."""
    task, _ = task_of(text)
    task.record_scans()
    records = [task.run(), *(task.scan(number * task.period_ns) for number in range(1, SCANS + 1))]
    return {code for record in records if record is not None for _, code in record.errors}, task.status


def test_only_what_no_task_provokes_has_no_example():
    without = {code for code in CODES if "## Example" not in (PAGES / f"{code}.md").read_text(encoding="utf-8")}
    assert without == WITHOUT_EXAMPLE


@pytest.mark.parametrize("code", sorted(set(CODES) - WITHOUT_EXAMPLE))
def test_example_logs_its_code_alone(code):
    found, status = codes_of(read_page(code).example.text)
    assert found == {int(code[3:])}
    assert (status is Status.FAULTED) == (code == "AMX7040")


@pytest.mark.parametrize("code", sorted(set(CODES) - WITHOUT_EXAMPLE))
def test_cure_logs_nothing(code):
    assert codes_of(read_page(code).cure.text) == (set(), Status.RUNNING)


def test_what_the_runtime_logs_has_a_page():
    """Every number of a problem in the runtime's own modules is in the table."""
    from automax_ros.blocks import declaration
    from automax_ros.compile import expressions, functions, loops, statements
    from automax_ros.running import task

    modules = (declaration, expressions, functions, loops, statements, task)
    numbers = {value for module in modules for value in vars(module).values() if isinstance(value, int)}
    logged = {f"AMX{number}" for number in numbers if 7000 <= number < 8000}
    assert logged <= set(CODES)
    assert len(logged) > 10
