"""What the displays of a rack's Processors show: the code of a fault or of a status, or nothing.

A code of a STOP ALL is shown by the Processor whose task has caused it; where no Processor's task has (a UDC's has, a
module was lost, two drive the common clock) by all of them, since the tasks of all have stopped, until the rack runs
again (decision). A code that stands in the error log of a task, which 87 for a shorted SCR does without a STOP ALL
(52.3.1), is shown until that log is cleared (decision: J2-3106-1 names both in one step). A Processor that has
nothing to tell, and one without power, shows nothing (decision). The codes d0 and E0 are of an installation, which
takes no time here and is refused with the errors' own words: no rack that answers shows them (decision).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from automax_ros.rack.modules.processor import ProcessorConfig
from automax_ros.rack.rack import Rack
from automax_ros.running.error_log import ErrorLog

MEANINGS = {
    "14": "overlap: a scan was not finished when the next one was due",
    "31": "bus error: a register or a module does not answer",
    "38": "two modules drive the common clock",
    "87": "shorted SCR",
    "95": "the tasks of a UDC have unequal TICKS",
    "C": "four receive time-outs in a row on the network",
    "E0": "a task and the configuration do not agree",
    "d0": "tasks are being installed",
}
"""The codes of which the meaning is known, in words; the whole table of the manuals is not."""


@dataclass(frozen=True)
class Display:
    """The display of one Processor: ``code`` is "" where it is blank, ``meaning`` says in words what it shows."""

    module: str
    code: str
    meaning: str


def displays_of(rack: Rack) -> list[Display]:
    """Return what the displays of a rack's Processors show now, as far as they are in this process, by slot."""
    return [
        _display(rack, module.config.name, [item.name for item in module.tasks])
        for module in rack.modules
        if isinstance(module.config, ProcessorConfig)
    ]


def meaning_of(code: str) -> str:
    """Return what a code means in words."""
    return MEANINGS.get(code, "a code of which the meaning is not known")


def _display(rack: Rack, module: str, tasks: list[str]) -> Display:
    if not rack.operations.powered:
        return Display(module, "", "the power is off")
    for code in _codes(rack, tasks):
        return Display(module, code, meaning_of(code))
    return Display(module, "", "no fault")


def _codes(rack: Rack, tasks: list[str]) -> Iterator[str]:
    """Yield the codes that concern a Processor with these tasks, the one that it shows first."""
    cause = rack.operations.stopped
    if cause is not None and cause.code and _concerns(rack, cause.task, tasks):
        yield cause.code
    for name in tasks:
        yield from _logged(rack.task(name).errors)


def _concerns(rack: Rack, task: str, tasks: list[str]) -> bool:
    """Return whether a stop that a task has caused ("" is none) is shown by the Processor with these tasks."""
    if not _is_on_processor(rack, task):
        return True
    return task in tasks and rack.task(task).errors.count > 0


def _is_on_processor(rack: Rack, task: str) -> bool:
    placed = rack.config.placed_tasks
    return any(item.name == task and isinstance(module, ProcessorConfig) for module, item in placed)


def _logged(log: ErrorLog) -> Iterator[str]:
    """Yield the codes that a log holds, the newest first."""
    return (entry.hardware for entry in reversed(log.entries) if entry.hardware)
