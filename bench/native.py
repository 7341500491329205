"""Native scans: the program of 40 blocks in each form, coefficients that change, and the time to build them.

Printed next to the time of Python in the same run; the manual's times are those of the 7010 (section 53).
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _harness import SECONDS, Loop, ns_in_turn, scans_of, task_of
from blocks import PROGRAM, PROGRAM_BLOCKS

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.run.build import build, find_compiler, level_of
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import NativeTask, native_form
from automax_ros.compile.native.translate.translation import translate
from automax_ros.core.types import DataType, type_of_name

COLUMN = 20_000
"""Scans of one call by columns."""
PID = (
    "10 COMMON REF%, FDBK%, OUT%\n11 LOCAL GAIN, K%\n20 CALL SCAN_LOOP(TICKS=4)\n"
    "25 K% = K% + 1\n26 IF K% > 1000 THEN K% = 1\n27 GAIN = K% * 0.001 + 0.5\n"
    "30 CALL PID(KP=GAIN, KI=2.0, KD=0.1, LOOP_TIME=0.022, INPUT=REF%, FEEDBACK=FDBK%, OUTPUT=OUT%)\n90 END\n"
)
PID_7010_US = 124.0


def columns_of(native: NativeTask, changes: dict[str, Callable[[int], int]], count: int = COLUMN) -> Loop:
    """Return scans of a native loop over columns."""
    compiled = native.compiled
    columns = []
    for name in compiled.latched:
        kind = np.float64 if type_of_name(name) is DataType.REAL else np.int64
        vary, steady = changes.get(name), int(name.endswith("@"))
        columns.append(np.array([steady if vary is None else vary(number) for number in range(count)], kind))

    def whole() -> None:
        assert native.columns(compiled.layout.fresh(), columns, count).done == count

    return Loop(whole, compiled.layout.fresh, count)


def called(compiled: CompiledTask, *, logged: bool = False) -> Loop:
    """Return scans of a task in a form.

    Args:
        compiled: the form of the program of 40 blocks.
        logged: whether the write log is kept, as the nodes and a recording require.
    """
    task, memory = task_of(PROGRAM)
    task.install(compiled)
    task.run()
    if logged:
        memory.keep_log()
    views = [memory.view(name) for name in ("LINE_SP%", "FDBK%", "COUNT%", "START@", "READY@")]
    for view, value in ((views[0], 3000), (views[3], True), (views[4], True)):
        memory.write_now(view, value, 1)
    feedback, count, write, take = views[1], views[2], memory.write_now, memory.take_writes

    def vary(number: int) -> None:
        write(feedback, number & 2047, 1)
        write(count, number * 7 & 4095, 1)

    def vary_and_take(number: int) -> None:
        vary(number)
        take()

    return scans_of(task, vary_and_take if logged else vary)


def nexts(form: Callable[..., object], compiled: CompiledTask, count: int = 500) -> Loop:
    """Return only the calls of ``next``, with memory that costs nothing: the latched values are always one tuple."""

    class Still:
        latched = tuple(type_of_name(name).zero for name in compiled.latched)

        def latch(self) -> tuple[object, ...]:
            return self.latched

        def commit(self, changes: object) -> None:
            """Discard the changes."""

        def log(self, line: int, code: int) -> None:
            """Discard the error."""

    scans: Any = form(compiled.layout.fresh(), Still())

    def whole() -> None:
        for _ in range(count):
            next(scans)

    def rest() -> None:
        for _ in range(count):
            pass

    return Loop(whole, rest, count)


def built_s(text: str, level: str) -> float:
    """Return the compiler's time for a text, s."""
    began = time.perf_counter()
    build(text, find_compiler(), (level,))
    return time.perf_counter() - began


def long_text(lines: int) -> str:
    """Return a task of this many lines: blocks and statements of each kind, repeated."""
    kinds = [
        "CALL SCALE(INPUT=A%, INPUT_MAX=4095, INPUT_MIN=0, OUTPUT_IMAX=4000, OUTPUT_IMIN=0, OUTPUT=B%)",
        "CALL LAG(INPUT=B%, WLG=5.0, OUTPUT=C%)",
        "CALL RAMP(INPUT=C%, ACCEL_RATE=40, DECEL_RATE=40, OUTPUT=D%)",
        "A% = B% + C% * 3 / 7",
        "CALL PROP_INT(INPUT=D%, KP=0.8, WLD=1.5, OUTPUT=E%)",
        "IF X@ OR A% > 5 THEN R = R * 0.5 + E%",
        "CALL AND(INPUT1=X@, INPUT2=Y@, OUTPUT=X@)",
        "CALL SUMMER(INPUT1=A%, INPUT2=-E%, OUTPUT=F%)",
    ]
    kinds = [kind.replace("INPUT2=-E%", "INPUT2=E%") for kind in kinds]
    body = [f"{100 + 10 * number} {kinds[number % len(kinds)]}" for number in range(lines)]
    head = "10 LOCAL A%, B%, C%, D%, E%, F%, R, X@, Y@\n20 CALL SCAN_LOOP(TICKS=40)\n"
    return head + "\n".join(body) + f"\n{200 + 10 * lines} END\n"


def report_making(name: str, text: str) -> None:
    """Print the times of translation and compiler for a task, and the time where both are in the cache."""
    compiled = task_of(text)[0].compiled
    began = time.perf_counter()
    source = translate(compiled)
    taken = time.perf_counter() - began
    levels = [f"{built_s(source.text, level):>10.2f} s" for level in ("-O1", "-O2")]
    with tempfile.TemporaryDirectory() as folder:
        cache = NativeCache(Path(folder, "cache"))
        native_form(compiled, cache)
        began = time.perf_counter()
        native_form(compiled, cache)
        found = time.perf_counter() - began
    size = f"{len(source.text) / 1000:>9.0f} kB {level_of(source.text)}"
    print(f"{name:16}{taken:>10.2f} s{''.join(levels)}{found:>10.2f} s{size}")


def main() -> None:
    """Print all figures."""
    task, _ = task_of(PROGRAM)
    cache = NativeCache()
    try:
        native = native_form(task.compiled, cache)
    except NotNative as reason:
        print(f"no native scans here: {reason}")
        return
    python, in_c = task.compiled, replace(task.compiled, scans=native.scans)
    changes = {"LINE_SP%": lambda _: 3000, "FDBK%": lambda n: n & 2047, "COUNT%": lambda n: n * 7 & 4095}
    loops = {
        "a task's scan, in Python": called(python),
        "a task's scan, native": called(in_c),
        "called, memory free, Python": nexts(python.scans, python),
        "called, memory free, native": nexts(native.scans, python),
        "a task's scan, native, logged": called(in_c, logged=True),
        "native loop over columns": columns_of(native, changes),
    }
    found = ns_in_turn(list(loops.values()), len(loops) * SECONDS)
    print(f"program of {PROGRAM_BLOCKS} blocks{'ns per scan':>24}{'ratio':>9}   the last: wanted 60 ns")
    for name, taken in zip(loops, found, strict=True):
        print(f"{name:34}{taken:>10.1f}{found[0] / taken:>9.1f}")
    report_changing(cache)
    print(f"\n{'made':16}{'translated':>12}{'gcc -O1':>12}{'gcc -O2':>12}{'found':>12}{'text, as built':>17}")
    report_making(f"{PROGRAM_BLOCKS} blocks", PROGRAM)
    report_making("2,000 lines", long_text(2000))


def report_changing(cache: NativeCache) -> None:
    """Print the time of a scan in which a PID's KP changes every time."""
    compiled = task_of(PID)[0].compiled
    forms = {"Python": compiled, "native": replace(compiled, scans=native_form(compiled, cache).scans)}
    found = ns_in_turn([referred(form) for form in forms.values()], len(forms) * SECONDS)
    print(f"\n{'PID, KP new in every scan':34}{'ns':>10}{'of 7010':>9}   the whole scan; wanted: 100")
    for name, ns in zip(forms, found, strict=True):
        print(f"{name:34}{ns:>10.0f}{PID_7010_US * 1000 / ns:>9.0f}")


def referred(compiled: CompiledTask) -> Loop:
    """Return scans of PID in a form, with a new REF% for each."""
    task, memory = task_of(PID)
    task.install(compiled)
    task.run()
    reference, write = memory.view("REF%"), memory.write_now

    def vary(number: int) -> None:
        write(reference, number & 4095, 1)

    return scans_of(task, vary)


if __name__ == "__main__":
    main()
