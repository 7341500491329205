"""The options of ``tune-info`` and ``response`` that choose a block and give values to variables."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from automax_ros.cli.usage import UsageError
from automax_ros.core.faults import Fault
from automax_ros.core.settings import setting
from automax_ros.core.types import Value
from automax_ros.core.values import value_text
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, NoDynamicBlock, ValueFault, dynamic_calls


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
    """Return the dynamic blocks that the options ask for, with the values they give.

    Raises:
        UsageError: there are none, or an option is at fault.
    """
    try:
        return dynamic_calls(program, settings_of(program, arguments.settings), arguments.block, driven=driven)
    except NoDynamicBlock as fault:
        raise UsageError(f"--block {fault.message}", fault.hint) from fault
    except ValueFault as fault:
        raise UsageError(f"--set {fault.message}", fault.hint) from fault


def settings_of(program: Program, texts: Sequence[str]) -> dict[str, Value]:
    """Return what texts ``NAME=VALUE`` give the variables of a task, by their labels.

    Raises:
        UsageError: one of them is at fault, or two are for the same variable.
    """
    values: dict[str, Value] = {}
    for text in texts:
        name, value = _setting(program, text)
        if name in values:
            raise UsageError(f"--set {name} is given twice", "give each variable one value")
        values[name] = value
    return values


def _setting(program: Program, text: str) -> tuple[str, Value]:
    try:
        meant, value = setting(text, program.symbols, "the task has no variable")
    except Fault as fault:
        raise UsageError(f"--set: {fault.message}", fault.hint) from fault
    tuning = meant.variable.tuning
    if tuning is not None and not isinstance(value, str) and not isinstance(tuning.low, str):
        assert not isinstance(tuning.high, str)
        if not tuning.low <= value <= tuning.high:
            limits = f"{value_text(tuning.low)} to {value_text(tuning.high)}"
            raise UsageError(f"--set {meant.label}: {value_text(value)} is beyond its tuning limits, {limits}")
    return meant.label, value
