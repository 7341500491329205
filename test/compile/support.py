"""What the tests of the runtime share: a task with a memory of its own commons, and repeatable hypothesis settings."""

from __future__ import annotations

from hypothesis import settings

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.base.cost import NEXT_US, CostModel
from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.compile.lowering.basic_statements import WaitingLowering
from automax_ros.core.diagnostics import SourceText, render_all
from automax_ros.core.types import Value
from automax_ros.language.checks.checker import check
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import ViewSpec
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.task import ScanRecord, Task

TICK = 5_500_000
ESTIMATES_US = {"Next": NEXT_US, **{kind.__name__: us for kind, us in WaitingLowering.estimates_us.items()}}
"""Estimated time of each BASIC statement on a 7010, microseconds."""
WRITER, OTHER = 1, 9
"""Ids of the task under test and of another writer."""


def repeatable(examples: int) -> settings:
    return settings(deadline=None, derandomize=True, max_examples=examples, database=None)


def program_of(
    text: str, name: str = "TASK", target: Platform = Platform.AUTOMAX, suffix: str = ".blk", tick_ns: int = TICK
) -> Program:
    """The checked program of a task; fails on an error, not on a warning. Every Processor has the same tick here."""
    source = SourceText(f"task{suffix}", text)
    result = check(source, name=name, catalogue=CATALOGUE, tick_ns=tick_ns, target=target)
    assert result.program is not None, render_all(result.diagnostics, source)
    return result.program


def views_of(program: Program) -> list[ViewSpec]:
    return [
        ViewSpec(symbol.name, symbol.type, symbol.elements, bool(symbol.dimensions), symbol.length)
        for symbol in program.symbols.values()
        if symbol.scope is Scope.COMMON
    ]


def compiled_of(text: str, cost_model: CostModel | None = None, target: Platform = Platform.AUTOMAX) -> CompiledTask:
    program = program_of(text, target=target)
    return compile_program(program, {spec.name: view for view, spec in enumerate(views_of(program))}, cost_model)


def task_of(
    text: str, memory_class=CommonMemory, cost_model=None, target=Platform.AUTOMAX, **commons: Value
) -> tuple[Task, CommonMemory]:
    """A task and a memory made of its own COMMON statements; ``commons`` by name, such as ``**{"REF%": 5}``."""
    compiled = compiled_of(text, cost_model, target)
    memory = memory_class(views_of(compiled.program))
    for name, value in commons.items():
        memory.write_from_outside(memory.view(name), value, OTHER)
    return Task(compiled, memory, writer=WRITER), memory


def basic_task_of(
    text: str, *, name: str = "TASK", memory=None, cost_model=None, channels=None, events=None, **commons: Value
) -> tuple[BasicTask, CommonMemory]:
    """A BASIC task and a memory made of its own COMMON statements, or in a memory that has them."""
    program = program_of(text, name, suffix=".bas")
    memory = memory or CommonMemory(views_of(program))
    views = {spec.name: memory.view(spec.name) for spec in views_of(program)}
    for variable, value in commons.items():
        memory.write_from_outside(memory.view(variable), value, OTHER)
    compiled = compile_program(program, views, cost_model)
    return BasicTask(compiled, memory, writer=WRITER, channels=channels, events=events), memory


def lines(*statements: str, declare: str = "LOCAL A%, B%, C%, D!, E!, R, Q, X@, Y@, S$, T%(10)") -> str:
    """A task of unnumbered or numbered statements: declarations in 10, SCAN_LOOP in 20, statements from 30 on, END.

    A statement that begins with a digit keeps its own number.
    """
    numbered, number = [], 30
    for statement in statements:
        if statement[:1].isdigit():
            number = int(statement.split()[0])
            numbered.append(statement)
        else:
            numbered.append(f"{number} {statement}")
        number += 10
    return "\n".join([f"10 {declare}", "20 CALL SCAN_LOOP(TICKS=4)", *numbered, f"{max(number, 30000)} END"]) + "\n"


def ran(*statements: str, scans: int = 1, **options) -> Task:
    """A task of these statements after some scans."""
    task, _ = task_of(lines(*statements, **options))
    run_scans(task, scans)
    return task


def run_scans(task: Task, scans: int, first: int = 1) -> None:
    if first == 1:
        task.run()
    for number in range(first, first + scans):
        task.scan(number * task.period_ns)


def logged(task: Task) -> list[tuple[int, int]]:
    """Line and number of the kept entries of the error log."""
    return [(entry.line, entry.code) for entry in task.errors.entries]


def scan_in_steps(task: Task, now_ns: int) -> list[int]:
    """Execute one modeled scan without pre-emption and return the costs that it yielded."""
    return scan_and_record(task, now_ns)[0]


def scan_and_record(task: Task, now_ns: int) -> tuple[list[int], ScanRecord | None]:
    """Execute one modeled scan without pre-emption and return the costs that it yielded and its record."""
    costs, steps = [], task.scan_modeled(now_ns)
    while True:
        try:
            costs.append(next(steps))
        except StopIteration as end:
            return costs, end.value
