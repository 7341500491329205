"""Options for a task by itself: its Processor and tick, the choice of a block, and values of variables."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.cli.options.values import each_once, naming
from automax_ros.core.diagnostics import Diagnostic, SourceText, Span
from automax_ros.core.names import setting
from automax_ros.core.text import quoted
from automax_ros.core.ticks import DEFAULT_TICK_NS, UDC_TICK_NS, tick_ns
from automax_ros.core.types import Value
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import value_text
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.program import Program
from automax_ros.language.tree.task_kind import NotATask, is_task_file, kind_of_file
from automax_ros.rackfile.reading.files import FileFault, read_task_source
from automax_ros.rackfile.reading.names import DeclarationFault, check_task_name
from automax_ros.tuning.dynamic_calls import DynamicCall, NoDynamicBlock, ValueFault, dynamic_calls

_RACK_SUFFIXES = (".YAML", ".YML")
_MILLISECONDS = re.compile(r"[0-9]{1,6}(\.[0-9]{0,6})?|\.[0-9]{1,6}")
"""Bounded, with no exponent: converting a huge exponent to an exact number would take forever."""


@dataclass(frozen=True)
class TaskTarget:
    """The target of a task given without a rack: the kind of Processor and its tick in ns."""

    processor: Platform
    tick_ns: int


def add_target_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--target`` and ``--tick-ms``."""
    parser.add_argument(
        "--target",
        choices=[item.value for item in Platform],
        default=Platform.AUTOMAX.value,
        help="the Processor that runs the task (default: automax)",
    )
    parser.add_argument(
        "--tick-ms", metavar="MS", help="its tick: 0.5 to 10 ms in steps of 0.5 (default: 5.5; a UDC's is always 0.5)"
    )


def target_of(arguments: argparse.Namespace) -> TaskTarget:
    """Return the target that ``--target`` and ``--tick-ms`` give.

    Raises:
        UsageError: not a tick that this Processor can have.
    """
    processor = Platform(arguments.target)
    is_udc = processor is Platform.UDC
    if arguments.tick_ms is None:
        return TaskTarget(processor, UDC_TICK_NS if is_udc else DEFAULT_TICK_NS)
    tick = tick_option(arguments.tick_ms)
    if is_udc and tick != UDC_TICK_NS:
        raise UsageError(f"--tick-ms {arguments.tick_ms}: the tick of a UDC is always 0.5 ms")
    return TaskTarget(processor, tick)


def tick_option(text: str) -> int:
    """Return the tick in ns that ``--tick-ms`` gives.

    Raises:
        UsageError: not a tick that a Processor can have.
    """
    if not _MILLISECONDS.fullmatch(text):
        raise UsageError(f"--tick-ms {quoted(text)} is not a number of milliseconds such as 5.5")
    with naming("--tick-ms"):
        return tick_ns(text)


def is_rack_file(path: Path) -> bool:
    """Whether a path names a rack file, by its suffix, or a folder, which may contain one."""
    suffix = path.suffix.upper()
    return suffix in _RACK_SUFFIXES or (not is_task_file(path) and path.is_dir())


def check_task_file(path: Path, target: TaskTarget) -> tuple[SourceText, CheckResult]:
    """Check a task without a rack: its COMMON statements serve as the definition of the rack's commons.

    Raises:
        UsageError: the file cannot be read, or is of a kind that has no checker.
    """
    require_task(path)
    try:
        source = read_task_source(path)
    except FileFault as fault:
        if not fault.too_large:
            raise UsageError(f"{path} {fault}") from fault
        too_large = Diagnostic("AMX0001", f"the text {fault}", Span(1, 1, 2), hint="divide the task")
        return SourceText(str(path), ""), CheckResult(None, [too_large])
    return source, check_text(path, source.text, target)


def require_clock(path: Path, program: Program) -> None:
    """Refuse a task whose scans follow an AC line: no clock starts them, so they have no scan period.

    Raises:
        UsageError: the task is one.
    """
    if program.cml is not None:
        message = (
            f"{path} runs a drive's {program.cml.block.name}: the interrupts of a 57C406 begin its scans, not the clock"
        )
        raise UsageError(
            message, "run it in a rack: automax run CONFIG --simulated; automax drive-check reports on its loop"
        )


def check_text(path: Path, text: str, target: TaskTarget) -> CheckResult:
    """Check the text of a task without a rack, as that of a file of this name."""
    source = SourceText(str(path), text)
    return check(source, name=path.stem.upper(), catalogue=CATALOGUE, target=target.processor, tick_ns=target.tick_ns)


def name_warning(path: Path) -> Diagnostic | None:
    """Return a warning if a task cannot be named after the file, as the Executive names it (2.4.1)."""
    stem = path.stem
    try:
        check_task_name(stem.upper() if stem.isascii() else stem)
    except DeclarationFault as fault:
        hint = "rename the file; or name the task in a rack file, with file: and this name"
        return Diagnostic(
            "AMX6900", f"{quoted(stem)} cannot be the task's name: {fault.message}", Span(1, 1, 2), hint=hint
        )
    return None


def require_task(path: Path) -> None:
    """Refuse a file whose name is not that of a task.

    Raises:
        UsageError: the file is of another kind.
    """
    try:
        kind_of_file(path)
    except NotATask as fault:
        raise UsageError(f"{path}: {fault}") from fault


def add_call_arguments(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add ``--block`` and ``--set``."""
    parser.add_argument(
        "--block",
        required=required,
        metavar="LINE",
        help="the BASIC line of a block; LINE.2 is the second CALL of a line, as in the names of states",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="settings",
        metavar="NAME=VALUE",
        help="the value of a variable that a block takes, such as GAIN=2.0; repeatable",
    )


def chosen_calls(program: Program, arguments: argparse.Namespace, *, driven: bool = False) -> list[DynamicCall]:
    """Return the dynamic blocks that the options choose, with the values that the options give.

    Raises:
        UsageError: there are none, or an option is wrong.
    """
    try:
        return dynamic_calls(program, settings_of(program, arguments.settings), arguments.block, driven=driven)
    except NoDynamicBlock as fault:
        raise UsageError(f"--block {fault.message}", fault.hint) from fault
    except ValueFault as fault:
        raise UsageError(f"--set {fault.message}", fault.hint) from fault


def settings_of(program: Program, texts: Sequence[str]) -> dict[str, Value]:
    """Return the values that texts ``NAME=VALUE`` give to variables of a task, by label.

    Raises:
        UsageError: a text is wrong, or two are for the same variable.
    """
    return each_once("--set", (_setting(program, text) for text in texts))


def _setting(program: Program, text: str) -> tuple[str, Value]:
    with naming("--set"):
        meant, value = setting(text, program.symbols, "the task has no variable")
    tuning = meant.variable.tuning
    if tuning is not None and not isinstance(value, str) and not isinstance(tuning.low, str):
        assert not isinstance(tuning.high, str)
        if not tuning.low <= value <= tuning.high:
            limits = f"{value_text(tuning.low)} to {value_text(tuning.high)}"
            raise UsageError(f"--set {meant.label}: {value_text(value)} is beyond its tuning limits, {limits}")
    return meant.label, value
