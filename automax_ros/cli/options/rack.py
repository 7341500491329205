"""A rack file on the command line, and the values that ``--set`` gives to its commons and tunables."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from automax_ros.cli.options.values import naming
from automax_ros.cli.output.screen import print_diagnostics, print_warning_count
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.text import count_of
from automax_ros.core.types import Value, bare_name
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.language.program import Program
from automax_ros.language.tree.task_kind import is_task_file
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.value_names import TunableSetting, setting, tuning
from automax_ros.rackfile.modules.registry import SUPPORTED

DEFAULT_RACK_FILE = "rack.yaml"
"""The file that a folder stands for where a rack file is expected."""
_CANNOT_BE_READ = "AMX6000"
_NOT_A_TEXT = frozenset({"AMX6001", "AMX6002"})


def add_set_argument(parser: argparse.ArgumentParser, *, tunables: bool = False) -> None:
    """Add ``--set``, any number of times, as ``settings``; ``tunables``: for tunables, too."""
    what = "a common variable, or tune TASK.NAME," if tunables else "a common variable"
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="settings",
        help=f"write {what} before the tasks start; may be given again",
    )


def add_outside_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--allow-outside``."""
    parser.add_argument(
        "--allow-outside", action="store_true", help="let the rack file name task sources outside its own folder"
    )


def load_rack_file(path: Path, *, allow_outside: bool) -> LoadResult:
    """Read a rack file, or the ``rack.yaml`` of a folder.

    Raises:
        UsageError: the file cannot be read, or is a task.
    """
    path = _find_rack_file(path)
    result = load(path, allow_outside=allow_outside)
    for item in result.diagnostics:
        if item.code == _CANNOT_BE_READ:
            raise UsageError(f"{path}: {item.message}")
    return result


def is_rack_folder(path: Path) -> bool:
    """Whether a path is a folder with a ``rack.yaml``."""
    return (path / DEFAULT_RACK_FILE).is_file()


def is_text(result: LoadResult) -> bool:
    """Whether a rack file could be read as text: it is neither too large nor something other than UTF-8."""
    return not any(item.code in _NOT_A_TEXT for item in result.diagnostics)


def size_of(rack: RackConfig) -> str:
    """Return the numbers of modules, tasks, commons and webs of a rack, in words."""
    modules = Counter(SUPPORTED[module.model].word for module in rack.task_modules)
    counts = [(number, f"{word[0].upper()}{word[1:]}") for word, number in modules.items()]
    counts += [(len(rack.placed_tasks), "task"), (len(rack.declared), "common")]
    counts += [(len(rack.webs), "web")] if rack.webs else []
    return ", ".join(count_of(number, thing) for number, thing in counts)


def _find_rack_file(path: Path) -> Path:
    """Return the rack file that an argument names, itself or by its folder."""
    if is_task_file(path):
        hint = f"`automax trace {path} --input IN.csv` runs a task alone; `automax new {path.parent}` makes a rack file"
        raise UsageError(f"{path} is a task, and a rack is made of its rack file (.yaml)", hint)
    if not path.is_dir():
        return path
    found = path / DEFAULT_RACK_FILE
    if not is_rack_folder(path):
        hint = f"name the rack's YAML file; `automax new {path}` makes one from the folder's tasks"
        raise UsageError(f"{path} is a folder without a {DEFAULT_RACK_FILE}", hint)
    return found


def config_of(path: Path, *, allow_outside: bool, quiet: bool = False) -> RackConfig | None:
    """Return a rack's configuration; if its file has errors, print them and return None.

    The warnings of a usable file are counted on standard error, but not if ``quiet``: another process has done it.

    Raises:
        UsageError: the file cannot be read.
    """
    result = load_rack_file(path, allow_outside=allow_outside)
    if has_errors(result.diagnostics):
        print_diagnostics(result.diagnostics, result.source, sys.stderr)
    elif not quiet:
        print_warning_count([(result.source, result.diagnostics)], path.name, path)
    if not is_text(result):
        raise UsageError(f"{path} cannot be used")
    return result.config if not has_errors(result.diagnostics) else None


def usable_config(path: Path, *, allow_outside: bool) -> RackConfig:
    """Return a rack's configuration; its warnings are counted on standard error.

    Raises:
        RackError: the file has errors, which the exception contains.
        UsageError: the file cannot be read.
    """
    result = load_rack_file(path, allow_outside=allow_outside)
    if result.config is None:
        raise RackError(f"{path} has errors", [(result.source, result.diagnostics)])
    print_warning_count([(result.source, result.diagnostics)], path.name, path)
    return result.config


def namespace_of(path: Path) -> str:
    """Return the namespace of a rack whose file may have errors.

    Raises:
        UsageError: the file cannot be read, or has no rack name.
    """
    found = load_rack_file(path, allow_outside=False).namespace
    if found is None:
        raise UsageError(f"{path} has no rack name (`rack:`)", "the node `rack` needs one: rack: PM1")
    return found


def settings_of(config: RackConfig, texts: list[str]) -> list[tuple[str, Value]]:
    """Return the values that the texts of ``--set`` give to common variables.

    Raises:
        UsageError: a text is wrong.
    """
    settings = []
    for text in texts:
        try:
            settings.append(setting(config, text))
        except UserError as error:
            raise UsageError(f"--set: {error.message}", _tunable_hint(config, text) or error.hint) from error
    return settings


def _tunable_hint(config: RackConfig, text: str) -> str | None:
    """Return a hint if NAME=VALUE, or TASK.NAME=VALUE, names a tunable of a task, else None."""
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


def split_settings(config: RackConfig, texts: list[str]) -> tuple[list[tuple[str, Value]], list[TunableSetting]]:
    """Return the values that the texts of ``--set`` give to common variables, and those for tunables.

    Raises:
        UsageError: a text is wrong.
    """
    programs: dict[str, Program] = {}
    if any("." in _name(text) for text in texts):
        programs = {task.name: result.program for task, _, result in check_tasks(config) if result.program is not None}
    tunings, others = [], []
    for text in texts:
        task, _, name = _name(text).partition(".")
        if task in programs and name:
            with naming("--set"):
                tunings.append(tuning(programs, text))
        else:
            others.append(text)
    return settings_of(config, others), tunings


def begin_with(rack: Rack, tunings: Sequence[TunableSetting]) -> None:
    """Set tunables to the values of ``--set``, before the rack runs.

    They override the values kept from the last run, and ROS parameters (decision: who types it means
    this run).

    Raises:
        UsageError: a task refuses a value.
    """
    for item in tunings:
        with naming(f"--set {item.task}.{item.name}"):
            rack.tune(rack.task(item.task), item.name, item.value)


def _name(text: str) -> str:
    return text.partition("=")[0].strip().upper()
