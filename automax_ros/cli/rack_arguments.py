"""What commands that run a rack share: its configuration, ``--set``, and what is told of a rack with errors."""

from __future__ import annotations

import sys
from pathlib import Path

from automax_ros.cli.rack_file import is_text, load_rack_file
from automax_ros.cli.terminal import print_diagnostics, tell_warnings
from automax_ros.cli.usage import UsageError
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.faults import Fault
from automax_ros.core.types import Value, bare_name
from automax_ros.rack.config import RackConfig
from automax_ros.rack.installation import RackError
from automax_ros.rack.settings import setting
from automax_ros.rack.tasks_check import check_tasks


def config_of(path: Path, *, allow_outside: bool, quiet: bool = False) -> RackConfig | None:
    """Return a rack's configuration; what is wrong with its file is printed, and None returned where it has errors.

    Of a file that can be used its warnings are counted, ``quiet``: not even that, since another process has done it.

    Raises:
        UsageError: the file cannot be read.
    """
    result = load_rack_file(path, allow_outside=allow_outside)
    if has_errors(result.diagnostics):
        print_diagnostics(result.diagnostics, result.source, sys.stderr)
    elif not quiet:
        tell_warnings([(result.source, result.diagnostics)], path.name, path)
    if not is_text(result):
        raise UsageError(f"{path} cannot be used")
    return result.config if not has_errors(result.diagnostics) else None


def usable_config(path: Path, *, allow_outside: bool) -> RackConfig:
    """Return a rack's configuration; its warnings are counted.

    Raises:
        RackError: the file has errors, which it holds.
        UsageError: the file cannot be read.
    """
    result = load_rack_file(path, allow_outside=allow_outside)
    if result.config is None:
        raise RackError(f"{path} has errors", [(result.source, result.diagnostics)])
    tell_warnings([(result.source, result.diagnostics)], path.name, path)
    return result.config


def namespace_of(path: Path) -> str:
    """Return the namespace of a rack whose file may have errors.

    Raises:
        UsageError: the file cannot be read, or says no name.
    """
    found = load_rack_file(path, allow_outside=False).namespace
    if found is None:
        raise UsageError(f"{path} says no name of a rack", "the node `rack` needs one: rack: PM1")
    return found


def settings_of(config: RackConfig, texts: list[str]) -> list[tuple[str, Value]]:
    """Return what the texts of ``--set`` give common variables.

    Raises:
        UsageError: one of them is at fault.
    """
    settings = []
    for text in texts:
        try:
            settings.append(setting(config, text))
        except Fault as error:
            raise UsageError(f"--set: {error.message}", _tunable_hint(config, text) or error.hint) from error
    return settings


def _tunable_hint(config: RackConfig, text: str) -> str | None:
    """Return what to do where NAME=VALUE, or TASK.NAME=VALUE, names a tunable of a task; None where it does not."""
    name, _, value = (part.strip().upper() for part in text.partition("="))
    for task, _, result in check_tasks(config):
        symbol = result.program.symbols.get(name.removeprefix(f"{task.name}.")) if result.program is not None else None
        if symbol is not None and symbol.tuning is not None:
            slot = next(item.slot for item in config.task_modules if task in item.tasks)
            full = f"{task.name}.{bare_name(symbol.name)}"
            command = f"ros2 param set /{config.namespace}/processor_{slot} {full} {value}"
            cure = f"`automax run` takes --set {full}={value}; while it runs: {command}"
            return f"{symbol.name} is a tunable of task {task.name}: {cure}"
    return None


def print_refused(command: str, error: RackError) -> int:
    """Print why a rack cannot be built, for a subcommand; return its exit code."""
    for source, diagnostics in error.findings:
        print_diagnostics(diagnostics, source, sys.stderr)
    print(f"automax {command}: {error}", file=sys.stderr)
    return 1
