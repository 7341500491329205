"""Values of a rack by names and patterns, as a program writes them and in their units."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import translate

from automax_ros.compile.base.layout import Role
from automax_ros.core.names import NameFault, element_name
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable

MAX_NAME = 100
"""Longest name that is accepted, in characters (decision: a bound on what strangers send)."""
MAX_NAMES = 1000
"""Most names in one request, and most values that its patterns mean (decision: likewise)."""
_WILD = "*?"


@dataclass(frozen=True)
class Reading:
    """A value that was read; ``shown`` is it in its unit, such as ``7.5 bar``, "" without one."""

    name: str
    value: str
    shown: str = ""


class Readings:
    """Reads values of one rack.

    Raises:
        OperationRefused: all methods, if a name means nothing. Observers are not notified: a question is not an
            operation.
    """

    def __init__(self, rack: Rack) -> None:
        self._rack = rack

    def get(self, names: Sequence[str]) -> list[Reading]:
        """Return commons, their elements, and variables of tasks (``TASK.NAME``), each once.

        A name may be a pattern: ``*`` stands for any characters, ``?`` for one. ``F_*`` means simple commons,
        ``TABLE%(*)`` elements, ``SPEED.*`` a task's own variables (decision).
        """
        found: dict[str, Reading] = {}
        for name in names:
            if len(name) > MAX_NAME:
                raise OperationRefused(f"a name of {len(name)} characters: the longest has {MAX_NAME}")
            found |= {item.name: item for item in self._requested_readings("".join(name.split()).upper(), name)}
            if len(found) > MAX_NAMES:
                raise OperationRefused(f"the names mean {len(found)} values: at most {MAX_NAMES} are read at once")
        return list(found.values())

    def tasks_named(self, task: str) -> list[str]:
        """Return a task, or all of the rack without a name."""
        return [self._check_known(task)] if task.strip() else [item.name for item in self._rack.tasks]

    def _requested_readings(self, plain: str, asked: str) -> Iterable[Reading]:
        owner, dot, local = plain.partition(".")
        is_pattern = any(char in plain for char in _WILD)
        if dot:
            task = self._check_known(owner)
            own = self._matching(local, self._locals(task), f"task {task} has no") if is_pattern else [local]
            return [Reading(f"{task}.{name}", self._local(task, name)) for name in own]
        if not is_pattern:
            return [self._common(asked)]
        places = [
            (variable, index)
            for variable in self._rack.config.variables
            if variable.bank is None and variable.is_array == ("(" in plain)
            for index in range(variable.elements)
        ]
        named = {element_name(variable, index): (variable, index) for variable, index in places}
        wanted = self._matching(plain, named, "the rack has no common")
        return [self._read(name, *named[name]) for name in wanted]

    def _matching(self, pattern: str, names: Iterable[str], absent: str) -> list[str]:
        known = list(names)
        # fnmatch's own form: it does not backtrack, however many stars a stranger writes.
        matches = re.compile(translate(pattern.replace("[", "[[]"))).match
        found = [name for name in known if matches(name)]
        if not found:
            near = near_or_listed("".join(char for char in pattern if char not in _WILD), known)
            raise OperationRefused(f"{absent} variable like {quoted(pattern)}" + (f": {near}" if near else ""))
        return found

    def _common(self, name: str) -> Reading:
        try:
            found = self._rack.config.common(name)
        except NameFault as fault:
            raise OperationRefused(f"{fault.message}: {fault.hint}" if fault.hint else fault.message) from fault
        return self._read(found.label, found.variable, found.index)

    def _read(self, label: str, variable: CommonVariable, index: int) -> Reading:
        value = self._rack.value(variable.name, index)
        return Reading(label, source_text(value), shown_value(variable, value))

    def _local(self, task: str, name: str) -> str:
        try:
            value = self._rack.task(task).value(name)
        except KeyError as error:
            raise OperationRefused(f"task {task} has no variable {quoted(name)} of its own") from error
        return ", ".join(map(source_text, value)) if isinstance(value, list) else source_text(value)

    def _locals(self, task: str) -> list[str]:
        fields = self._rack.task(task).layout.fields
        return [field.name for field in fields if field.role in (Role.LOCAL, Role.TUNABLE)]

    def _check_known(self, name: str) -> str:
        plain = name.strip().upper()
        if plain not in {item.name for item in self._rack.tasks}:
            known = sorted(task.name for _, task in self._rack.config.placed_tasks)
            raise OperationRefused(f"the rack has no task {quoted(name)}: it has {', '.join(known)}")
        return plain


def shown_value(variable: CommonVariable, value: Value) -> str:
    """Return a value in its unit, by its scale if it has one; "" if it has neither."""
    if variable.scale is not None and not isinstance(value, str):
        return f"{variable.scale.value_of(int(value)):.6g} {variable.unit}".rstrip()
    return f"{source_text(value)} {variable.unit}" if variable.unit else ""
