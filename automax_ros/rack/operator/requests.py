"""Requests of an operator to a rack in words: names and values as texts, from services and commands.

Text that cannot be parsed is refused with a reason, and observers receive the refusal, as they do the rack's own.
Values are read by names and patterns, as a program writes them and in their units. Everything but ``prepare`` must be
called between two scans.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import translate
from pathlib import Path
from typing import NoReturn

from automax_ros.compile.base.layout import Role, StateField
from automax_ros.core.diagnostics import SourceText, render
from automax_ros.core.names import NameFault, element_name
from automax_ros.core.text import near_or_listed, printable, quoted
from automax_ros.core.ticks import seconds_ns
from automax_ros.core.types import DataType, Value, type_of_name
from automax_ros.core.values import source_text, value_of, wanted
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import PreparedReload, RackError
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.value_names import common_named
from automax_ros.rackfile.reading.files import MAX_BYTES

MAX_VALUE = 1000
"""Longest text of a value that is accepted, in characters (decision: likewise)."""
MOST_OFF_S = 86_400
"""Longest time for which the power is switched off, s (decision: a day)."""
_MOST_FINDINGS = 100


MAX_NAME = 100
"""Longest name that is accepted, in characters (decision: a bound on what strangers send)."""
MAX_NAMES = 1000
"""Most names in one request, and most values that its patterns mean (decision: likewise)."""
_WILD = "*?"


class ReloadRefused(OperationRefused):
    """A source was refused; ``findings`` are those of its check, each as a text of several lines."""

    def __init__(self, reason: str, findings: Sequence[str]) -> None:
        super().__init__(reason)
        self.findings = tuple(findings)


class OperatorRequests:
    """Executes an operator's requests to one rack.

    Raises:
        OperationRefused: all methods, if the rack refuses or a text cannot be parsed.
    """

    def __init__(self, rack: Rack) -> None:
        self._rack = rack
        self._readings = Readings(rack)

    def run(self, task: str) -> None:
        """Put a task into RUN."""
        self._rack.operations.run(self._task("run", task))

    def stop(self, task: str) -> None:
        """Stop a task."""
        self._rack.operations.stop(self._task("stop", task))

    def run_all(self) -> None:
        """Put all tasks into RUN."""
        self._rack.operations.run_all()

    def stop_all(self) -> None:
        """Stop the rack."""
        self._rack.operations.stop_all("STOP ALL by the operator")

    def clear_errors(self, task: str = "") -> None:
        """Clear the error log of a task, or of all without a name."""
        self._rack.operations.clear_errors(self._task("clear_errors", task) if task.strip() else None)

    def delete(self, task: str) -> None:
        """Delete a resting task; a reload brings it back."""
        self._rack.operations.delete(self._task("delete", task))

    def power(self, what: str, off_for_s: float = 0.0, *, without_battery: bool = False) -> None:
        """Switch the power ``off``, ``on``, or off for a time: ``cycle``."""
        operations, battery = self._rack.operations, not without_battery
        switched = self._short("power", what, MAX_NAME).strip().lower()
        if switched == "off":
            operations.power_off()
        elif switched == "on":
            operations.power_on(battery=battery)
        elif switched != "cycle":
            self._refuse("power", f"{quoted(what)} is not off, on or cycle")
        elif not 0.0 <= off_for_s <= MOST_OFF_S:
            self._refuse("power", f"the power cannot be off for {off_for_s:g} s: it takes 0 to {MOST_OFF_S}")
        else:
            operations.power(seconds_ns(off_for_s), battery=battery)

    def set(self, name: str, value: str) -> None:
        """Write a common or an array's element once."""
        self._rack.adjust.set(name, self._common_value("set", name, value))

    def force(self, name: str, value: str) -> None:
        """Hold a common, or a task's own variable (``TASK.NAME``), at a value."""
        self._rack.adjust.force(name, self._common_value("force", name, value))

    def unforce(self, names: Sequence[str]) -> None:
        """End forces, all of them without names."""
        for name in self._few("unforce", names):
            self._short("unforce", name, MAX_NAME)
        self._rack.adjust.unforce(list(names) or None)

    def tune(self, name: str, value: str) -> None:
        """Set a tunable, ``TASK.NAME``."""
        self._named("tune", name)
        kind = type_of_name("".join(name.split()).upper())
        held = self._value("tune", name, value, kind, 0)
        self._rack.adjust.tune(name, 0 if isinstance(held, str) else held)

    def module(self, slot: str, control: str, value: str) -> None:
        """Move a control of the module in a slot: ``7``, ``test_switch``, ``A``."""
        for text in (slot, control, value):
            self._short("module", text, MAX_NAME)
        SwitchOperations(self._rack).module(slot.strip(), control.strip(), value.strip())

    def plant(self, name: str, verb: str, value: str) -> None:
        """Break, mend or load a plant: ``UNWIND``, ``short_scr``, ``3``."""
        for text in (name, verb, value):
            self._short("plant", text, MAX_NAME)
        SwitchOperations(self._rack).plant(name.strip().upper(), verb.strip(), value.strip())

    def reload(self, task: str, source: str, *, keep_state: bool = False) -> list[str]:
        """Replace a task's source by a text; return the warnings of its check.

        Raises:
            ReloadRefused: the source has errors; the old one continues.
        """
        self.install(self.prepare(*self.admit_reload(task, source)), keep_state=keep_state)
        return []

    def admit_reload(self, task: str, source: str) -> tuple[str, SourceText]:
        """Return the task of a reload and its new source: first part of a reload, short.

        Findings name the task, such as ``SPEED.BLK:1:1``: the text is not the rack's file (decision).
        """
        name = self._task("reload", task)
        if len(source) > MAX_BYTES:
            self._refuse("reload", f"a source of {len(source)} characters: at most {MAX_BYTES} are read", name)
        self._rack.operations.admit_reload(name)
        return name, SourceText(f"{name}{Path(self._rack.sources[name].name).suffix}", source)

    def prepare(self, name: str, source: SourceText) -> PreparedReload:
        """Check and compile a source: second part of a reload, long; on any thread, while the rack scans."""
        return self._rack.operations.installation.prepare(name, source)

    def is_current(self, prepared: PreparedReload) -> bool:
        """Return whether a source was prepared for the tasks as they are now; else it must be prepared again."""
        return self._rack.operations.installation.is_current(prepared)

    def install(self, prepared: PreparedReload, *, keep_state: bool = False) -> str:
        """Install the prepared source of a task: last part of a reload, short.

        Returns in words which tuned values the task has lost, "" if none: an installation takes them from the source.

        Raises:
            ReloadRefused: the source has errors; the old one continues.
        """
        tuned = self._tuned(prepared.task)
        try:
            self._rack.operations.install(prepared, keep_state=keep_state)
        except RackError as error:
            found = [render(item, where) for where, items in error.findings for item in items]
            raise ReloadRefused(str(error), found[:_MOST_FINDINGS]) from error
        return self._lost(prepared.task, tuned)

    def _tuned(self, name: str) -> dict[str, Value]:
        """Return the tunables of a task that differ from its source, with their values."""
        task = self._rack.task(name)
        values = {item.name: (task.value(item.name), item.initial) for item in task.layout.fields if _is_tunable(item)}
        return {key: held for key, (held, initial) in values.items() if held != initial and not isinstance(held, list)}

    def _lost(self, name: str, tuned: Mapping[str, Value]) -> str:
        task = self._rack.task(name)
        now = {item.name: task.value(item.name) for item in task.layout.fields if _is_tunable(item)}
        lost = [
            f"{key} was tuned to {source_text(held)} and is {_source_value(now.get(key))}"
            for key, held in tuned.items()
            if now.get(key) != held
        ]
        return ", ".join(lost)

    def refuse_reload(self, task: str, reason: str) -> NoReturn:
        """Refuse a reload for a reason of the caller's."""
        self._refuse("reload", reason, self._task("reload", task))

    def get(self, names: Sequence[str]) -> list[tuple[str, str]]:
        """Return commons, their elements, and variables of tasks (``TASK.NAME``): each name with its value's text."""
        return [(item.name, item.value) for item in self.read(names)]

    def read(self, names: Sequence[str]) -> list[Reading]:
        """Return the same with units; names may be patterns."""
        return self._readings.get(self._few("get", names))

    def forces(self) -> list[tuple[str, str]]:
        """Return the force table."""
        return [(item.name, source_text(item.value)) for item in self._rack.forces()]

    def tasks_named(self, task: str) -> list[str]:
        """Return a task, or all of the rack without a name."""
        return self._readings.tasks_named(task)

    def task_word(self, task: str) -> str:
        """Return a task's name in the form for a look-up, "" if none is given."""
        return self._task("step", task)

    def _common_value(self, what: str, name: str, text: str) -> Value:
        """Return the value that a text writes for a variable; an unknown name is left for the rack to refuse."""
        self._named(what, name)
        if "." in name:
            return self._value(what, name, text, type_of_name("".join(name.split()).upper()), 0)
        try:
            variable = common_named(self._rack.config, name).variable
        except NameFault:
            return 0
        return self._value(what, name, text, variable.type, variable.length)

    def _value(self, what: str, name: str, text: str, kind: DataType, length: int) -> Value:
        self._short(what, text, MAX_VALUE)
        value = value_of(text if kind is DataType.STRING else text.strip(), kind, length)
        if value is None:
            reason = f"{quoted(text)} is not a value for {printable(name)}: it takes {wanted(kind, length)}"
            self._refuse(what, reason)
        return value

    def _named(self, what: str, name: str) -> None:
        self._short(what, name, MAX_NAME)
        if not name.strip():
            wants = "TASK.NAME" if what == "tune" else "a common, an element, or TASK.NAME to force"
            self._refuse(what, f"the name is empty: it takes {wants}")

    def _task(self, what: str, name: str) -> str:
        self._short(what, name, MAX_NAME)
        return name.strip().upper()

    def _few(self, what: str, names: Sequence[str]) -> Sequence[str]:
        if len(names) > MAX_NAMES:
            self._refuse(what, f"{len(names)} names: at most {MAX_NAMES} are taken at once")
        return names

    def _short(self, what: str, text: str, most: int) -> str:
        if len(text) > most:
            self._refuse(what, f"a text of {len(text)} characters: at most {most} are read")
        return text

    def _refuse(self, what: str, reason: str, task: str = "") -> NoReturn:
        self._rack.observers.operated(Operation(self._rack.now_ns, what, task, ok=False, reason=reason))
        raise OperationRefused(reason)


def _is_tunable(field: StateField) -> bool:
    return field.role is Role.TUNABLE


def _source_value(value: Value | list[Value] | None) -> str:
    return f"{source_text(value)} again" if value is not None and not isinstance(value, list) else "not there any more"


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
            found |= {item.name: item for item in self._meant("".join(name.split()).upper(), name)}
            if len(found) > MAX_NAMES:
                raise OperationRefused(f"the names mean {len(found)} values: at most {MAX_NAMES} are read at once")
        return list(found.values())

    def tasks_named(self, task: str) -> list[str]:
        """Return a task, or all of the rack without a name."""
        return [self._known(task)] if task.strip() else [item.name for item in self._rack.tasks]

    def _meant(self, plain: str, asked: str) -> Iterable[Reading]:
        owner, dot, local = plain.partition(".")
        is_pattern = any(char in plain for char in _WILD)
        if dot:
            task = self._known(owner)
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
            found = common_named(self._rack.config, name)
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

    def _known(self, name: str) -> str:
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
