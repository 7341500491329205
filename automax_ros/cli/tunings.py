"""Tunables on the command line: ``--set TASK.NAME=VALUE``."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.cli.rack_arguments import settings_of
from automax_ros.cli.usage import UsageError
from automax_ros.core.faults import Fault
from automax_ros.core.types import Value
from automax_ros.language.program import Program
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks_check import check_tasks
from automax_ros.rack.tunings import Tuning, tuning


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
            try:
                tunings.append(tuning(programs, text))
            except Fault as fault:
                raise UsageError(f"--set: {fault.message}", fault.hint) from fault
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
