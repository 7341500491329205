"""Shared by the benchmarks: a task made from text, and times of measured functions that are run in turn."""

from __future__ import annotations

import gc
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from statistics import median
from subprocess import PIPE, Popen
from typing import NamedTuple

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.compiler import compile_program
from automax_ros.core.diagnostics import SourceText, render_all
from automax_ros.core.ticks import NS_PER_S
from automax_ros.language.checks.checker import check
from automax_ros.language.tree.tree import Scope
from automax_ros.rack.rack import Rack
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import ViewSpec
from automax_ros.runtime.tasks.task import Task

SECONDS = 1.0
"""Length of a measurement of short runs, s: long enough for a host of varying speed to reach its best."""
FASTEST = 0.1
"""The part of the rounds that counts, the fastest ones: other work on the machine disturbs them little."""
ANSWER = "--answer"
"""The argument with which a program of bench/ answers the questions of the process that started it."""


class Loop(NamedTuple):
    """Passes to be timed, a millisecond or less: ``whole`` with the measured code, ``rest`` without it."""

    whole: Callable[[], object]
    rest: Callable[[], object]
    """Its time is subtracted."""
    passes: int


def scans_per_second(rack: Rack) -> float:
    """Return how many scans the rack's tasks execute per second of rack time."""
    return sum(NS_PER_S / task.period_ns for task in rack.tasks if task.period_ns)


def task_of(text: str, target: Platform = Platform.AUTOMAX) -> tuple[Task, CommonMemory]:
    """Return a task in RUN with a common memory of only the variables that it declares."""
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


def ns_in_turn(loops: Sequence[Loop], seconds: float = SECONDS) -> list[float]:
    """Return the time of one pass of each loop, ns.

    All are run in turn, round by round. Times are subtracted within a round, and loops are compared by the median of
    the same fastest rounds: so a host of varying speed affects all alike.
    """
    works = [work for loop in loops for work in (loop.rest, loop.whole)]
    rounds: list[list[int]] = []
    clock = time.perf_counter_ns
    gc.collect()
    gc.disable()
    try:
        end = clock() + seconds * 1e9
        while not rounds or clock() < end:
            marks = [clock()]
            for work in works:
                work()
                marks.append(clock())
            rounds.append([after - before for before, after in pairwise(marks)])
    finally:
        gc.enable()
    fastest = sorted(rounds, key=sum)[: max(1, round(len(rounds) * FASTEST))]
    return [
        median(taken[2 * number + 1] - taken[2 * number] for taken in fastest) / loop.passes
        for number, loop in enumerate(loops)
    ]


def still(_: int) -> None:
    """Change no input."""


def scans_of(task: Task, vary: Callable[[int], object] = still, scans: int = 300) -> Loop:
    """Return scans of a task; ``vary`` changes inputs before each and is not counted."""
    scan = task.scan

    def whole() -> None:
        for number in range(scans):
            vary(number)
            scan(0)

    def rest() -> None:
        for number in range(scans):
            vary(number)

    return Loop(whole, rest, scans)


def scan_ns(task: Task, vary: Callable[[int], object] = still) -> float:
    """Return the time of one scan in ns; ``vary`` changes inputs before each and is not counted."""
    return ns_in_turn([scans_of(task, vary)])[0]


def seconds_in_turn(works: Sequence[Callable[[int], float]], repeats: int) -> list[float]:
    """Return the least time that each function returns for its runs, all in turn, s; each is passed the round."""
    rounds = [[work(number) for work in works] for number in range(repeats)]
    return [min(taken) for taken in zip(*rounds, strict=True)]


def wall_s(work: Callable[[], object]) -> float:
    """Return the wall time of a call, s."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


class Other:
    """A program of bench/ in a separate process and another form than this one: it answers while this one waits."""

    def __init__(self, file: str, form: Mapping[str, str]) -> None:
        command = [sys.executable, file, ANSWER]
        self._process = Popen(command, stdin=PIPE, stdout=PIPE, text=True, env={**os.environ, **form})

    def __enter__(self) -> Other:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def __call__(self, question: str) -> float:
        """Return the reply of its ``answer`` to a question of one line."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(question, file=self._process.stdin, flush=True)
        told = self._process.stdout.readline()
        if not told:
            raise SystemExit(f"{self._process.args} has ended with {self._process.wait()}")
        return float(told)


def answer(measure: Callable[[str], float]) -> None:
    """Answer the questions of the process that started this one, until there are no more."""
    for line in sys.stdin:
        print(measure(line.strip()), flush=True)
