"""Names and values from a command line, checked against a rack's common variables and its tasks' tunables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.kinds import Direction
from automax_ros.core.names import PREDEFINED, Element, NameFault
from automax_ros.core.names import setting as named_setting
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, Value, bare_name
from automax_ros.core.user_error import UserError
from automax_ros.core.values import value_of, value_text
from automax_ros.language.program import Program, Symbol, lines_that_write
from automax_ros.rackfile.model.config import NO_SUCH_COMMON, CommonElement, RackConfig

DEFAULT_WATCHED = 5
"""Most variables that a status line shows by default."""


def setting(config: RackConfig, text: str) -> tuple[str, Value]:
    """Return the name and value of ``NAME=VALUE``; the name may be that of an array's element.

    Raises:
        UserError: not of that form, no such common, the value does not fit, or the rack itself writes it (2.4.6).
    """
    meant, value = named_setting(text, config.by_name, NO_SUCH_COMMON)
    if meant.name in PREDEFINED:
        raise NameFault(f"{meant.name} cannot be set: the rack itself writes it", "leave it out")
    return meant.label, value


def watched(
    config: RackConfig, names: Sequence[str] | None, programs: Iterable[Program] = ()
) -> Sequence[CommonElement]:
    """Return the variables of these names, such as ``REF%`` and ``TABLE%(3)``; without names the file's ``watch``.

    If the rack file has none either, these are the first published commons that control-block tasks among ``programs``
    write, and after them the first others: in many files a panel's push-buttons come first, and they show least.

    Raises:
        NameFault: there is no such simple common or element.
    """
    if names is not None:
        return [config.common(name) for name in names]
    if config.watch is not None:
        return config.watch
    written = {name for program in programs if not program.is_basic for name in lines_that_write(program)}
    published = [
        variable
        for variable in config.variables
        if variable.direction is not Direction.CLOSED and not variable.is_array and variable.type is not DataType.STRING
    ]
    published.sort(key=lambda variable: variable.name not in written)
    return [Element(variable) for variable in published[:DEFAULT_WATCHED]]


@dataclass(frozen=True)
class TunableSetting:
    """A value for a tunable of a task, named with its type character."""

    task: str
    name: str
    value: Value


def tunables_of(program: Program) -> dict[str, Symbol]:
    """Return the tunables of a task by their full names."""
    return {full: symbol for full, symbol in program.symbols.items() if symbol.tuning is not None}


def tuning(programs: Mapping[str, Program], text: str) -> TunableSetting:
    """Return the tunable and value of ``TASK.NAME=VALUE``; the type character may be left out.

    Raises:
        UserError: not of that form, the task has none of that name, or the value is not of its type.
        KeyError: there is no such task.
    """
    owner, equals, value = text.partition("=")
    task, _, name = owner.strip().upper().partition(".")
    tunables = tunables_of(programs[task])
    bare = {bare_name(full): full for full in tunables}
    full = name if name in tunables else bare.get(name, name)
    symbol = tunables.get(full)
    if symbol is not None and symbol.tuning is not None and value_of(value.strip(), symbol.type) is None:
        limits = f"it takes {value_text(symbol.tuning.low)} to {value_text(symbol.tuning.high)}"
        given = f"{quoted(value.strip())} is not a value for {full}, type {symbol.type.word}"
        raise UserError(given if equals else f"{quoted(text)} is not TASK.NAME=VALUE", limits)
    meant, found = named_setting(f"{full}={value}", tunables, f"task {task} has no tunable")
    return TunableSetting(task, meant.label, found)
