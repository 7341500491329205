"""Every block and statement, native and in Python: the same bits."""

from __future__ import annotations

import re
import shutil

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from soaking import in_soak

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Block, Platform
from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import native_form
from automax_ros.compile.native.translate.scan_body import Repeated
from automax_ros.compile.native.translate.translation import translate
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from compile import programs
from compile.block_model import TICKS, Programmed
from compile.native.identity import assert_same
from compile.programs import tasks
from compile.support import TICK, compiled_of, views_of
from compile.test_blocks_in_task import BLOCKS, ON_A_RACK, declarations, with_its_structure

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")


def drawn(strategy, count: int, number: int) -> list:
    """Examples of a strategy, the same ones in every run."""
    found: list = []

    @seed(number)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def collect(example) -> None:
        found.append(example)

    collect()
    return found[-count:]


def task_text(calls: list[list[Programmed]]) -> str:
    """A task of all these calls, each with a data structure of its own."""
    lines = []
    for number, programmed in enumerate(calls):
        for place, call in enumerate(programmed):
            text = call.text(100 + 10 * number + place)
            lines.append(re.sub(r"QUEUE([%@])", rf"QUEUE{number}\1", text))
    return f"{declarations()}20 CALL SCAN_LOOP(TICKS={TICKS})\n" + "\n".join(lines) + "\n32000 END\n"


def check_blocks(blocks: list[Block], each: int, number: int, stretches: int, cache: NativeCache) -> None:
    target = Platform.AUTOMAX if all(block in ON_A_RACK for block in blocks) else Platform.UDC
    calls = [example for block in blocks for example in drawn(with_its_structure(block), each, number)]
    native = native_form(compiled_of(task_text(calls), target=target), cache)
    for forced in (False, True):
        assert_same(native, stretches, 8, forced=forced, seed=number)


@pytest.mark.parametrize("on_a_rack", [True, False], ids=["on a rack", "on a UDC"])
def test_every_block_is_the_same_in_c(on_a_rack: bool, tmp_path) -> None:
    blocks = [block for block in BLOCKS if (block in ON_A_RACK) is on_a_rack]
    check_blocks(blocks, 1, 1, 15, NativeCache(tmp_path / "cache"))


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_every_block_is_the_same_in_c_however_it_is_programmed(block: Block, tmp_path) -> None:
    for number in range(4):
        check_blocks([block], 60, 100 + number, 60, NativeCache(tmp_path / "cache"))


WITH_STRINGS = ("$", "PRINT", "VAL(", "LEN%", "ASC%", '"')


def numeric_task(text: str) -> CompiledTask | None:
    """The task without the string variables that none of its statements uses; None of one that has others."""
    for declared in ("S$, P$:5, ", "KS$, ", ', "TEXT"'):
        text = text.replace(declared, "")
    if any(word in text for word in WITH_STRINGS):
        return None
    program = check(SourceText("task.blk", text), name="TASK", catalogue=CATALOGUE, tick_ns=TICK).program
    if program is None:
        return None
    return compile_program(program, {spec.name: view for view, spec in enumerate(views_of(program))})


@pytest.fixture
def without_strings(monkeypatch) -> None:
    """Random tasks of which a part has no strings."""
    every = programs.simple_statements
    plain = every().filter(lambda text: not any(word in text for word in WITH_STRINGS))
    monkeypatch.setattr(programs, "simple_statements", lambda: plain)


@pytest.mark.usefixtures("without_strings")
@pytest.mark.parametrize(("count", "least", "number"), [(26, 10, 3), in_soak(1500, 600, 4, timeout_s=3600)])
def test_random_tasks_are_the_same_in_c(tmp_path, count: int, least: int, number: int) -> None:
    found = [task for task in map(numeric_task, drawn(tasks(), count, number)) if task is not None]
    assert len(found) >= least
    cache = NativeCache(tmp_path / "cache")
    for place, compiled in enumerate(found):
        native = native_form(compiled, cache)
        assert_same(native, 6, 6, forced=place % 3 == 0, seed=place)


@pytest.mark.usefixtures("without_strings")
def test_what_comes_out_as_before_is_what_would_be_translated_again(monkeypatch) -> None:
    """Statements that are not looked at again have the lines that they would get: the whole texts are the same."""
    on_a_rack = [block for block in BLOCKS if block in ON_A_RACK]
    compiled = [task for task in map(numeric_task, drawn(tasks(), 8, 5)) if task is not None]
    compiled.append(
        compiled_of(task_text([example for block in on_a_rack for example in drawn(with_its_structure(block), 1, 6)]))
    )
    quick = [translate(task) for task in compiled]
    again: list[object] = []

    def carried_out(_, statement, known, carry_out):
        again.append(statement)
        return carry_out(statement, known)

    monkeypatch.setattr(Repeated, "carried_out", carried_out)
    assert [translate(task) for task in compiled] == quick
    assert len(again) > len({id(statement) for statement in again}), "some were translated several times"
