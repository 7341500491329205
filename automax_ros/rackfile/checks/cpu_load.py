"""The load of each module by its tasks, from the manual's execution times (section 53)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from automax_ros.compile.base.cost import MOST_SHARED_TICKS
from automax_ros.compile.scan_times import ScanTimes, period_ns, scan_times
from automax_ros.core.diagnostics import Diagnostic, Span
from automax_ros.core.ticks import NS_PER_US
from automax_ros.rackfile.checks.drive_rules import latched_registers
from automax_ros.rackfile.checks.tasks import CheckedTask
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import ModuleConfig, cost_model
from automax_ros.rackfile.modules.drive import ACCESS_NS
from automax_ros.rackfile.modules.registry import SUPPORTED
from automax_ros.rackfile.reading.executive import version_text

TABLES_SINCE = 34
"""Version of the Executive, in tenths, from which on tables 4 to 6 hold (53.1)."""
_WHOLE, _HALF = 100.0, 50.0


@dataclass(frozen=True)
class TaskLoad:
    """The time of a task's scans; ``period_ns`` is None for a task without a period, which has no share.

    ``fires``: it has a current minor loop, and its period is a sixth of a line cycle.
    """

    task: str
    times: ScanTimes
    period_ns: int | None
    fires: bool = False
    accesses: Mapping[int, int] = field(default_factory=dict)
    """Registers of a 57C406 that it latches in a scan, by slot: each delays the microprocessor there (52.7)."""

    def delay_percent(self, slot: int) -> float:
        """Return the share of the time of the 57C406 in a slot that is taken by its accesses."""
        return 0.0 if self.period_ns is None else _WHOLE * self.accesses[slot] * ACCESS_NS / self.period_ns

    @property
    def percent(self) -> float | None:
        """The share of its period that the longest scan takes."""
        return None if self.period_ns is None else _WHOLE * self.times.most_ns / self.period_ns


@dataclass(frozen=True)
class ModuleLoad:
    """The tasks of a module in the order of the file; ``word`` is the module's name in the manuals."""

    module: ModuleConfig
    word: str
    tasks: tuple[TaskLoad, ...]

    @property
    def percent(self) -> float:
        """The sum of its tasks' shares."""
        return sum(task.percent or 0.0 for task in self.tasks)

    @property
    def least_ticks(self) -> int | None:
        """The fewest TICKS in which all tasks that share one scan fit (53.2); None if each task has its own scan."""
        if self.module.times not in MOST_SHARED_TICKS or not self.tasks:
            return None
        return -(-sum(task.times.most_ns for task in self.tasks) // self.module.tick_ns)


def loads_of(config: RackConfig, checked: Iterable[CheckedTask]) -> list[ModuleLoad]:
    """Return the loads of all modules that run tasks, in the order of slots; tasks with errors are left out."""
    programs = {item.task.name: item.result.program for item in checked}
    found = []
    for module in config.task_modules:
        tasks = tuple(
            TaskLoad(
                task.name,
                scan_times(program, cost_model(module)),
                period_ns(program),
                program.cml is not None,
                Counter(point.slot for _, point, _ in latched_registers(config, program)),
            )
            for task in module.tasks
            if (program := programs[task.name]) is not None
        )
        found.append(ModuleLoad(module, SUPPORTED[module.model].models[module.model], tasks))
    return found


def faults(config: RackConfig, loads: Iterable[ModuleLoad]) -> list[Diagnostic]:
    """Return the diagnostics of a rack's loads, each at the place of its module in the rack file."""
    known, old = list(loads), []
    if config.executive < TABLES_SINCE:
        version, since = version_text(config.executive), version_text(TABLES_SINCE)
        message = f"the tables of execution times hold from executive {since} on; this rack has {version}"
        old = [Diagnostic("AMX6772", message, Span(1, 1, 2), hint="take the times as a guess")]
    return [*old, *(found for load in known for found in _overload(load)), *late_loops(known)]


def late_loops(loads: Iterable[ModuleLoad]) -> Iterator[Diagnostic]:
    """Report current minor loops whose command comes in the second half of a sixth of a line cycle."""
    for load, task in ((module, task) for module in loads for task in module.tasks):
        if task.fires and task.percent is not None and task.percent > _HALF:
            took, sixth = task.times.most_ns / NS_PER_US, (task.period_ns or 0) / NS_PER_US
            due = f"half of a sixth of a line cycle ({sixth:.0f} us)"
            message = f"{task.task} takes {took:.0f} us on {load.word}, more than {due}"
            hint = "its DELTA counts one scan later: let another task do what it can, or take a faster Processor"
            yield Diagnostic("AMX6774", message, Span(load.module.line, 1, 2), hint=hint)


def _overload(load: ModuleLoad) -> list[Diagnostic]:
    module, ticks = load.module, load.least_ticks
    span = Span(module.line, 1, 2)
    most = MOST_SHARED_TICKS.get(module.times)
    if ticks is not None and most is not None and ticks > most:
        needed = sum(task.times.most_ns for task in load.tasks) / NS_PER_US
        names = " and ".join(task.task for task in load.tasks)
        message = f"{names} take {needed:.2f} us on {module.name}, which is {ticks} TICKS; {most} are the most"
        return [Diagnostic("AMX6771", message, span, hint="give some of the work to a Processor's task")]
    if load.percent <= _WHOLE:
        return []
    message = f"the tasks of {module.name} take {load.percent:.2f} % of its time"
    hint = f"write TICKS={ticks} or more" if ticks is not None else "scan less often, or move a task"
    return [Diagnostic("AMX6770", message, span, hint=hint)]
