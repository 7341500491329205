"""What the benchmarks share: a task made from text, and the time of one of its scans."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declaration import Platform
from automax_ros.compile.compiler import compile_program
from automax_ros.core.diagnostics import SourceText, render_all
from automax_ros.language.checks.checker import check
from automax_ros.language.syntax.tree import Scope
from automax_ros.running.memory import CommonMemory
from automax_ros.running.task import Task
from automax_ros.running.views import ViewSpec

REPEATS = 60
"""Short runs of which the fastest counts, so that other work on the machine disturbs little."""


def task_of(text: str, target: Platform = Platform.AUTOMAX) -> tuple[Task, CommonMemory]:
    """Return a task in RUN with a common memory of just the variables that it declares."""
    source = SourceText("BENCH.BLK", text)
    result = check(source, name="BENCH", catalogue=CATALOGUE, target=target)
    if result.program is None:
        raise SystemExit(render_all(result.diagnostics, source))
    commons = [symbol for symbol in result.program.symbols.values() if symbol.scope is Scope.COMMON]
    memory = CommonMemory([ViewSpec(symbol.name, symbol.type) for symbol in commons])
    views = {symbol.name: view for view, symbol in enumerate(commons)}
    task = Task(compile_program(result.program, views), memory)
    task.run()
    return task, memory


def scan_ns(task: Task, vary: Callable[[int], None] = lambda _: None, scans: int = 300) -> float:
    """Return the time of one scan in ns: the best of many short runs; ``vary`` changes inputs and is not counted."""
    scan = task.scan
    whole = min(_run_ns(lambda number: (vary(number), scan(0)), scans) for _ in range(REPEATS))
    return whole - min(_run_ns(lambda number: (vary(number), None), scans) for _ in range(REPEATS))


def _run_ns(action: Callable[[int], object], count: int) -> float:
    gc.collect()
    gc.disable()
    began = time.perf_counter_ns()
    for number in range(count):
        action(number)
    taken = time.perf_counter_ns() - began
    gc.enable()
    return taken / count
