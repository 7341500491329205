"""Tunables on the command line: ``--set TASK.NAME=VALUE``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.cli.rack_arguments import settings_of
from automax_ros.cli.usage import UsageError
from automax_ros.core.faults import Fault
from automax_ros.core.settings import setting
from automax_ros.core.types import Value, bare_name
from automax_ros.language.program import Program
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks_check import check_tasks


@dataclass(frozen=True)
class Tuning:
    """A value that ``--set`` gives a tunable, named with its type character."""

    task: str
    name: str
    value: Value


def split_settings(config: RackConfig, texts: list[str]) -> tuple[list[tuple[str, Value]], list[Tuning]]:
    """Return what the texts of ``--set`` give common variables, and what they give tunables.

    Raises:
        UsageError: one of them is at fault.
    """
    programs: dict[str, Program] = {}
    if any("." in _name(text) for text in texts):
        programs = {task.name: result.program for task, _, result in check_tasks(config) if result.program is not None}
    tunings, others = [], []
    for text in texts:
        task, _, name = _name(text).partition(".")
        if task in programs and name:
            tunings.append(_tuning(task, programs[task], name, text))
        else:
            others.append(text)
    return settings_of(config, others), tunings


def begin_with(rack: Rack, tunings: Sequence[Tuning]) -> None:
    """Give tunables what ``--set`` says, before the rack runs.

    It counts more than the values kept from the last run, and more than parameters of ROS (decision: who types it means
    this run).

    Raises:
        UsageError: a task refuses a value.
    """
    for item in tunings:
        try:
            rack.tune(rack.task(item.task), item.name, item.value)
        except ValueError as error:
            raise UsageError(f"--set {item.task}.{item.name}: {error}") from error


def _name(text: str) -> str:
    return text.partition("=")[0].strip().upper()


def _tuning(task: str, program: Program, name: str, text: str) -> Tuning:
    """Return what a text gives a tunable, whose type character may be left out.

    Raises:
        UsageError: the task has none of that name, or the value is not of its type.
    """
    tunables = {full: symbol for full, symbol in program.symbols.items() if symbol.tuning is not None}
    bare = {bare_name(full): full for full in tunables}
    full = name if name in tunables else bare.get(name, name)
    try:
        meant, value = setting(f"{full}={text.partition('=')[2]}", tunables, f"task {task} has no tunable")
    except Fault as fault:
        raise UsageError(f"--set: {fault.message}", fault.hint) from fault
    return Tuning(task, meant.label, value)
