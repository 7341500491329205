"""What a task's snapshot holds: its state, a drive's loop where it has one, and its error log."""

from __future__ import annotations

from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.layout import Layout, Role, StateField
from automax_ros.core.types import DataType
from automax_ros.drive.cml.minor_loop import NUMBERS
from automax_ros.running.error_log import LOG_FIELD, LOG_NUMBERS

_LOG = StateField(LOG_FIELD, DataType.DOUBLE, Role.LOG, 0, LOG_NUMBERS, is_array=True)


def snapshot_layout(compiled: CompiledTask) -> Layout:
    """Return the layout of a task's snapshots: the state, the numbers of its minor loop, the error log."""
    cml = compiled.program.cml
    loop = () if cml is None else (_loop_field(cml.block.name),)
    return Layout((*compiled.layout.fields, *loop, _LOG))


def _loop_field(name: str) -> StateField:
    return StateField(name, DataType.REAL, Role.BLOCK, 0.0, NUMBERS, is_array=True)
