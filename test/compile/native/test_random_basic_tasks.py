"""Random BASIC tasks with waits anywhere against an independent interpreter, which does not know of bursts."""

from __future__ import annotations

import itertools
import re

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.compile.base.scan_io import Suspension
from automax_ros.compile.compiler import compile_program
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from automax_ros.language.program import Program
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.task import Status
from compile.interpreter import Interpreter
from compile.native.test_random_tasks import bits, written
from compile.programs import REFUSED, tasks
from compile.support import TICK, WRITER, views_of

_CALL = re.compile(r"^(\d+) CALL .*$", re.MULTILINE)
_LATER = re.compile(r"^(\d{3,5}) (?!ELSE|END|NEXT|DATA|REM|!)(.*)$", re.MULTILINE)
MOST_BURSTS = 3000


class BackgroundInterpreter(Interpreter):
    """The statements from the first to END, with a clock that DELAY moves."""

    now = 0

    def run(self):
        self._all(self.program.scan)

    def _do_delay(self, statement):
        count = self._framed(lambda: self.value(statement.count))
        if count < 0:
            self._error(7054, self.line)
        self.now += max(0, count) * TICK

    def _do_setevent(self, _):
        """Nobody waits."""


def as_basic_task(text: str, waits: list[str]) -> str:
    """A control-block task's text with remarks in place of its blocks and waits before other statements."""
    queue = itertools.cycle(waits)
    text = _CALL.sub(r"\1 REM", text.replace("&\n", " "))
    return _LATER.sub(lambda found: f"{found[1]} {next(queue)} \\ {found[2]}", text)


@st.composite
def basic_tasks(draw) -> Program:
    waits = st.sampled_from(
        ["DELAY 1 TICKS", "DELAY 3 TICKS", "DELAY 0 TICKS", "DELAY A% TICKS", "DELAY B% - 9 TICKS", "PRINT 1", "SET GO"]
    )
    text = "1 EVENT NAME = GO\n" + as_basic_task(draw(tasks()), draw(st.lists(waits, min_size=1, max_size=9)))
    result = check(SourceText("TASK.BAS", text), name="TASK", catalogue=CATALOGUE, tick_ns=TICK)
    wrong = [item for item in result.diagnostics if item.severity.value == "error" and item.code not in REFUSED]
    assert not wrong, (wrong, text)
    assume(result.program is not None)
    assert result.program is not None
    return result.program


def agree(program: Program, *, modeled: bool = False) -> int:
    """Compare all that a task does; return the number of its bursts."""
    model = BackgroundInterpreter(program)
    model.run()
    memory = CommonMemory(views_of(program))
    compiled = compile_program(program, {spec.name: view for view, spec in enumerate(memory.specs)})
    task = BasicTask(compiled, memory, writer=WRITER)
    task.record_scans()
    memory.keep_log()
    task.run(0)
    now, busy, errors, bursts = 0, False, [], 0
    while task.status is Status.RUNNING and bursts < MOST_BURSTS:
        if modeled:
            steps = task.scan_modeled(now)
            try:
                while True:
                    next(steps)
            except StopIteration as end:
                record = end.value
        else:
            record = task.scan(now)
        errors += record.errors
        busy = busy or task.wish[0] == Suspension.BUSY
        bursts += 1
        if task.status is Status.RUNNING:
            now = task.wake_ns
    assert bursts < MOST_BURSTS
    assert [entry[1:] for entry in written(memory)] == [
        (name, element, bits(value)) for _, name, element, value in model.writes
    ]
    assert errors == model.log
    assert {name: bits(task.value(name)) for name in model.locals} == {
        name: bits(value) for name, value in model.locals.items()
    }
    assert list(task.printed)[-20:] == model.printed[-20:]
    assert busy or now == model.now
    return bursts


@given(basic_tasks())
@settings(deadline=None, derandomize=True, max_examples=40, database=None, suppress_health_check=[HealthCheck.too_slow])
def test_bursts_do_what_the_statements_say(program: Program) -> None:
    bursts = agree(program)
    assert agree(program, modeled=True) == bursts
