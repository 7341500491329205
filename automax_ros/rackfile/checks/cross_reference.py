"""The cross reference of a rack: of each common its place, who writes it, who reads it.

Writers and readers are those of the checked tasks (``lines_that_write``, ``reads_of``); what a task reaches by slot
and register alone (IOREAD%, IOWRITE) has no name and is not among them. Outside of tasks a common is written by a
plant's or a web's feed, by ROS 2 (``ros: in``), by a joint's command, by its module (an input), or by the rack itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from automax_ros.core.kinds import Direction
from automax_ros.core.names import PREDEFINED
from automax_ros.language.program import Program, Symbol, lines_that_write
from automax_ros.language.tree.tree import Scope
from automax_ros.rackfile.checks.common_use import reads_of
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.module import ModuleConfig, TaskConfig
from automax_ros.rackfile.model.plants import FeedConfig, JointCommand


@dataclass(frozen=True)
class TaskUse:
    """How one task uses a common: the BASIC lines that write it and those that read it.

    Both are empty for a task that only declares it. ``file`` is the name of the task's source, ``module`` that of the
    module that runs it.
    """

    task: str
    file: str
    module: str
    writes: tuple[int, ...] = ()
    reads: tuple[int, ...] = ()


@dataclass(frozen=True)
class CommonUse:
    """A common with its place in words and all that uses it.

    ``input_of`` is the module that shows the process in it, "" if none does; ``by_rack`` whether the rack itself writes
    it. ``meant_so`` is what the rack file says.
    """

    variable: CommonVariable
    place: str
    tasks: tuple[TaskUse, ...] = ()
    feeds: tuple[FeedConfig, ...] = ()
    commands: tuple[JointCommand, ...] = ()
    input_of: str = ""
    by_rack: bool = False
    meant_so: bool = False

    @property
    def name(self) -> str:
        """The common's name."""
        return self.variable.name

    @property
    def writers(self) -> list[TaskUse]:
        """The tasks that write it."""
        return [use for use in self.tasks if use.writes]

    @property
    def readers(self) -> list[TaskUse]:
        """The tasks that read it."""
        return [use for use in self.tasks if use.reads]

    @property
    def from_ros(self) -> bool:
        """Whether ROS 2 may write it."""
        return self.variable.direction is Direction.IN


def cross_reference(config: RackConfig, programs: Iterable[Program]) -> list[CommonUse]:
    """Return all commons of a rack in the order of its file, with those of their users that are in ``programs``."""
    by_task = {program.name: program for program in programs}
    used: dict[str, list[TaskUse]] = {}
    for module, task in config.placed_tasks:
        program = by_task.get(task.name)
        if program is not None:
            for name, use in _uses_of(program, task, module).items():
                used.setdefault(name, []).append(use)
    modules = {module.slot: module for module in config.modules}
    return [
        CommonUse(
            variable,
            place_of(variable, modules),
            tuple(used.get(variable.name, ())),
            tuple(item for item in config.feeds if item.common == variable.name),
            tuple(item for item in config.joint_commands if item.common == variable.name),
            _input_of(variable, config, modules),
            variable.name in PREDEFINED,
            variable.name in config.meant_so,
        )
        for variable in config.declared
    ]


def place_of(variable: CommonVariable, modules: Mapping[int, ModuleConfig]) -> str:
    """Return the place of a common in words: slot, register or drop, bit; or common memory."""
    point = variable.point
    if point is None:
        return "common memory"
    where = f"slot {point.slot} {modules[point.slot].registers.place(point.register)}"
    return where if point.bit is None else f"{where} bit {point.bit}"


def _uses_of(program: Program, task: TaskConfig, module: ModuleConfig) -> dict[str, TaskUse]:
    writes = lines_that_write(program)
    reads: dict[str, dict[int, None]] = {}
    for name, line in reads_of(program):
        if line is not None:
            reads.setdefault(name, {})[line] = None
    return {
        symbol.name: TaskUse(
            task.name,
            task.file.name,
            module.name,
            tuple(sorted(writes.get(symbol.name, ()))),
            tuple(sorted(reads.get(symbol.name, ()))),
        )
        for symbol in _commons(program)
    }


def _commons(program: Program) -> list[Symbol]:
    return [symbol for symbol in program.symbols.values() if symbol.scope is Scope.COMMON]


def _input_of(variable: CommonVariable, config: RackConfig, modules: Mapping[int, ModuleConfig]) -> str:
    if variable.point is None or not config.is_input(variable):
        return ""
    return modules[variable.point.slot].name
