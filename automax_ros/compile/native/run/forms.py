"""Decides which tasks of a run are made native: whether it is requested, whether it pays, and the outcome per task."""

from __future__ import annotations

import contextlib
import enum
import os
import queue
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.run.build import library
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.compiler_process import LIMIT_S, LOOK_S, abandon

if TYPE_CHECKING:
    from automax_ros.compile.native.run.task import NativeTask

LINE_NS = 75
"""Approximate time of a task's line in a scan in Python, ns: that of a block."""
WORTHWHILE_NS, WORTHWHILE_LINE_NS = 500_000_000, 10_000_000
"""Time that scans must take in Python for native ones to be built, ns, and what each line of the task adds to that
(decision: twice what it takes to translate and build the task, which is 0.2 s, and 5 ms per line).
"""
WORTHWHILE_KEPT_NS, WORTHWHILE_KEPT_LINE_NS = 150_000_000, 3_000_000
"""The same for native scans to be looked up in the cache of other runs (decision: it saves two thirds of this;
looking takes 0.05 to 0.1 s for the first task of a program, and 1 to 2 ms per line, for the scans are lowered first).
"""

_FAULT = "automax itself failed to make it native, please report this with the task's text"
_MOST_WHY = 400
"""Characters of a reason that quotes a fault."""


class NativeMode(enum.Enum):
    """Whether tasks are made native: where it pays, wherever possible, or never."""

    AUTO = "auto"
    ON = "on"
    OFF = "off"


@dataclass(frozen=True)
class NativeOutcome:
    """A task as it runs: ``native`` is its native form, None with ``why`` where it scans in Python."""

    compiled: CompiledTask
    native: NativeTask | None = None
    why: str = ""

    @property
    def text(self) -> str:
        """The outcome as text for the user."""
        return f"{self.compiled.program.name}: {'native' if self.native else f'in Python: {self.why}'}"


@dataclass(frozen=True)
class NativeForms:
    """The settings of a run for native scans.

    Attributes:
        mode: whether tasks are made native.
        expected_ns: expected task time, None without an end: with ``AUTO`` it decides whether building pays.
        cache: the cache for native scans.
        limit_s: time limit for building each, s.
        why_off: the reason given for each task with ``OFF``.
    """

    mode: NativeMode = NativeMode.OFF
    expected_ns: int | None = None
    cache: NativeCache = NativeCache()
    limit_s: float = LIMIT_S
    why_off: str = "native scans are off"

    def off(self, why: str) -> NativeForms:
        """Return the settings with native scans off, for a reason."""
        return self if self.mode is NativeMode.OFF else replace(self, mode=NativeMode.OFF, why_off=why)

    def made(self, tasks: Mapping[str, CompiledTask]) -> dict[str, NativeOutcome]:
        """Return the form in which each task runs, by the same names; several are built at a time. Raises nothing."""
        if self.mode is NativeMode.OFF or not tasks:
            return {name: NativeOutcome(task, why=self.why_off) for name, task in tasks.items()}
        return _side_by_side(self.form, tasks)

    def library(self, text: str, worthwhile_ns: int) -> Path | None:
        """Return the library of a C text that pays for a run of at least this time; None where there is none."""
        too_short = self.expected_ns is not None and self.expected_ns < worthwhile_ns
        if self.mode is NativeMode.OFF or (self.mode is NativeMode.AUTO and too_short):
            return None
        try:
            return library(text, self.cache, limit_s=self.limit_s)
        except NotNative:
            return None

    def form(self, compiled: CompiledTask) -> NativeOutcome:
        """Return the form in which a task runs: unchanged where it is not native.

        A fault of the translator itself costs the task its native form and nothing more, whatever the mode (decision).
        """
        if self.mode is NativeMode.OFF:
            return NativeOutcome(compiled, why=self.why_off)
        builds = self.mode is NativeMode.ON or self._pays(compiled, WORTHWHILE_NS, WORTHWHILE_LINE_NS)
        if not builds and not self._pays(compiled, WORTHWHILE_KEPT_NS, WORTHWHILE_KEPT_LINE_NS):
            return NativeOutcome(compiled, why="a run this short gains nothing by it (--native on)")
        from automax_ros.compile.native.run.task import native_form

        try:
            native = native_form(compiled, self.cache, limit_s=self.limit_s, builds=builds)
        except NotNative as reason:
            return NativeOutcome(compiled, why=str(reason))
        except Exception as fault:
            return NativeOutcome(compiled, why=f"{_FAULT}: {type(fault).__name__}: {fault}"[:_MOST_WHY])
        return NativeOutcome(compiled.with_scans(native.scans, native.scans_forced), native)

    def _pays(self, compiled: CompiledTask, least_ns: int, least_line_ns: int) -> bool:
        """Return whether scans in Python take at least this time, and this additional time for each line."""
        if self.expected_ns is None:
            return True
        period = compiled.program.period_ns
        scans, lines = self.expected_ns // period if period else 0, len(compiled.program.scan)
        return scans * lines * LINE_NS >= least_ns + lines * least_line_ns


def _side_by_side(
    form: Callable[[CompiledTask], NativeOutcome], tasks: Mapping[str, CompiledTask]
) -> dict[str, NativeOutcome]:
    """Return the outcome of each task. Ctrl-C waits for no thread, and no thread prevents the program from ending."""
    waiting = list(reversed(list(tasks.items())))
    found: queue.SimpleQueue[tuple[str, NativeOutcome | BaseException]] = queue.SimpleQueue()

    def work() -> None:
        with contextlib.suppress(IndexError):  # of the empty list
            while True:
                name, task = waiting.pop()
                try:
                    found.put((name, form(task)))
                except BaseException as fault:
                    found.put((name, fault))

    threads = [threading.Thread(target=work, daemon=True) for _ in range(min(len(tasks), os.cpu_count() or 1))]
    made: dict[str, NativeOutcome] = {}
    try:
        for thread in threads:
            thread.start()
        while len(made) < len(tasks):
            try:
                name, outcome = found.get(timeout=LOOK_S)
            except queue.Empty:
                continue
            if isinstance(outcome, BaseException):
                raise outcome
            made[name] = outcome
    except BaseException:  # such as Ctrl-C: the compilers would continue to their end
        waiting.clear()
        abandon(threads)
        raise
    return {name: made[name] for name in tasks}


IN_PYTHON = NativeForms()
"""No task is native."""
