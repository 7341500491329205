"""The pages of run-time problems: the example logs exactly its code when it runs, the cure logs nothing."""

from __future__ import annotations

import pytest
from core.problem_pages import PAGES, Fence, read_page

from automax_ros.core.problems import PROBLEMS
from automax_ros.runtime.tasks.task import Status
from compile.support import TICK, basic_task_of, task_of

SCANS = 20
CODES = [code for code in PROBLEMS if code.startswith("AMX7")]
DRIVE = {f"AMX{number}" for number in (7105, 7106, 7107, *range(7110, 7118), 7119)}
"""A drive has these: ``test_drive_faults`` of the rack and of its loop provoke them."""
WITHOUT_EXAMPLE = {"AMX7042", "AMX7051", "AMX7052", "AMX7070", "AMX7071", "AMX7072"} | DRIVE
"""No task can provoke these by itself: the host does, or the rack."""


def codes_of(fence: Fence) -> tuple[set[int], bool]:
    """What a task logs over some scans, or bursts of a BASIC task, and whether it is faulted then."""
    task, _ = task_of(fence.text) if fence.language == "blk" else basic_task_of(fence.text)
    task.record_scans()
    records = [task.run(), *(task.scan(number * TICK) for number in range(1, SCANS + 1))]
    return {
        code for record in records if record is not None for _, code in record.errors
    }, task.status is Status.FAULTED


def test_only_what_no_task_provokes_has_no_example():
    without = {code for code in CODES if "## Example" not in (PAGES / f"{code}.md").read_text(encoding="utf-8")}
    assert without == WITHOUT_EXAMPLE


@pytest.mark.parametrize("code", sorted(set(CODES) - WITHOUT_EXAMPLE))
def test_example_logs_its_code_alone(code):
    found, faulted = codes_of(read_page(code).example)
    assert found == {int(code[3:])}
    assert faulted == (code == "AMX7040")


@pytest.mark.parametrize("code", sorted(set(CODES) - WITHOUT_EXAMPLE))
def test_cure_logs_nothing(code):
    assert codes_of(read_page(code).cure) == (set(), False)


def test_what_the_runtime_logs_has_a_page():
    """Every number of a problem in the runtime's own modules is in the table."""
    from automax_ros.blocks.declare import declaration
    from automax_ros.compile.base import functions
    from automax_ros.compile.lowering import basic_statements as waiting
    from automax_ros.compile.lowering import expressions, flow, statements
    from automax_ros.runtime.scan import channels
    from automax_ros.runtime.tasks import task

    modules = (declaration, expressions, functions, flow, statements, waiting, channels, task)
    numbers = {value for module in modules for value in vars(module).values() if isinstance(value, int)}
    logged = {f"AMX{number}" for number in numbers if 7000 <= number < 8000}
    assert logged <= set(CODES)
    assert len(logged) > 10
