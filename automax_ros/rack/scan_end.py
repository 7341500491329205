"""What comes right after each scan of a rack: it is told, waiting inputs follow the process, a fault stops all.

A file of its own since every scan goes through it: see ``tools/compiled_groups.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from automax_ros.rack.observers import Observers
from automax_ros.running.process_inputs import ProcessInputs
from automax_ros.running.task import ScanRecord, Status, Task

_FAULTED: Final = Status.FAULTED
"""A name of its own, since it is asked for after each scan and an enumeration's member is slow to get."""
StopAll = Callable[[str, str | None, str], None]
"""Stops the rack: is told the reason, the hardware's code where there is one, and the task."""


class ScanEnd:
    """Ends the scans of one rack."""

    def __init__(self, observers: Observers, inputs: ProcessInputs, stop_all: StopAll) -> None:
        """Take who is told, the inputs, and what stops the rack after a fault."""
        self._observers, self._inputs, self._stop_all = observers, inputs, stop_all

    def ended(self, task: Task, record: ScanRecord | None) -> None:
        """Do what comes after a scan, or after what stands before SCAN_LOOP."""
        if record is not None:
            self._observers.scanned(task, record)
        inputs = self._inputs
        if inputs.frozen and inputs.scanned(task.name):
            self._observers.tell_writes()
        if task.status is _FAULTED:
            last = task.errors.last
            reason = f"task {task.name}: {last.describe() if last else 'fault'}"
            self._stop_all(reason, last.hardware if last else None, task.name)
