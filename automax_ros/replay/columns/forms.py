"""The forms in which tasks are executed on columns: machine code where it is wanted and available, else Python."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from automax_ros.compile.base.scan_io import StateValues
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.run.columns import BesideLatch
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeOutcome
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.replay.columns.entries import Entries, Ints
from automax_ros.replay.columns.execution import ColumnForm, Executed, PythonColumns
from automax_ros.replay.columns.library import ColumnLibrary, library_text
from automax_ros.runtime.memory.registers import Backplane

if TYPE_CHECKING:
    from automax_ros.compile.native.run.task import (
        NativeTask,
    )  # it takes a tenth of a second, and only native tasks need it

WORTHWHILE_NS = 30 * NS_PER_S
"""Recorded time from which on the library of a replay by columns is built or looked for (decision).

Building it takes half a second once on a machine, and saves 25 ms for each second of five tasks at 5.5 ms.
"""


class ColumnForms:
    """Creates the forms of the tasks of one recording, each once."""

    def __init__(
        self, variables: Sequence[CommonVariable], backplane: Backplane, native: NativeForms = IN_PYTHON
    ) -> None:
        self._types: list[DataType] = [variable.type for variable in variables]
        self._backplane, self._native = backplane, native
        self._made: dict[int, NativeOutcome] = {}
        self._library: ColumnLibrary | None = None
        self._sought = False

    @property
    def outcomes(self) -> list[NativeOutcome]:
        """Whether each task is native, or why not."""
        return list(self._made.values())

    @property
    def library(self) -> ColumnLibrary | None:
        """The machine code for a replay by columns; None where a replay goes scan by scan."""
        if not self._sought:
            self._sought = True
            path = self._native.library(library_text(), WORTHWHILE_NS)
            if path is not None:
                with contextlib.suppress(OSError):
                    self._library = ColumnLibrary(path)
        return self._library

    def leave_in_python(self, compiled: CompiledTask) -> None:
        """Note why a task is not executed by columns, and so not as machine code."""
        outcome = self._native.form(compiled)
        if outcome.native is not None:
            outcome = NativeOutcome(compiled, why="a run this short gains nothing by it (--native on)")
        self._made.setdefault(id(compiled), outcome)

    def form(self, compiled: CompiledTask, views: Sequence[int]) -> ColumnForm:
        """Return the form of a task that latches these views."""
        outcome = self._made.get(id(compiled))
        if outcome is None:
            outcome = self._made[id(compiled)] = self._native.form(compiled)  # keeps the task, so the id stays valid
        if outcome.native is not None:
            return NativeColumns(outcome.native)
        return PythonColumns(compiled, views, self._types, self._backplane)


class NativeColumns:
    """Executes a native task on columns."""

    def __init__(self, task: NativeTask) -> None:
        self._task = task

    def columns(
        self, state: StateValues, latched: Sequence[Ints], count: int, read: Entries, *, latches_own: bool = False
    ) -> Executed:
        """Execute scans; see ``ColumnForm``."""
        actual = BesideLatch(read.offsets, read.views, read.elements, read.values)
        executed = self._task.columns(state, latched, count, actual, latches_own=latches_own)
        done, written = executed.done, executed.written
        within = written.scans < done
        counts = np.bincount(written.scans[within], minlength=done)
        offsets = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts)))
        return Executed(
            done,
            [np.asarray(column, np.int64) for column in executed.outputs],
            executed.errors[executed.errors[:, 0] < done],
            Entries(offsets, written.views[within], written.elements[within], written.values[within]),
        )
