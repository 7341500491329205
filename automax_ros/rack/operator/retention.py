"""The state that a rack keeps over a power cycle, in a folder between two runs (2.4.5, J2-3106-1 p. 10-6).

Kept are non-volatile commons, forces, the registers of a module that are not the process's inputs, such as the test
switches of a UDC, and of each task tunables, locals and the error log (2.4.5, J2-3106-1 p. 13-4); with ``auto_run``
also which tasks ran; and outside the rack the web on rolls and between them (decision: yesterday's roll is not full
again). The folder holds one file, ``state.json``, replaced as a whole.

A start from it is a power-up: what a module loses without power is lost. A task whose source was edited starts as
installed, since to load it again is an installation (decision). With ``auto_run`` the tasks that ran are put into RUN;
without it all are, since starting the emulator acts as RUN ALL (decision). Values of commons come back as writes at the
start, after the presets, so that recordings have them (decision). In a distributed rack each process keeps the state of
its own modules and tasks, and the one with common memory the commons with their forces (decision).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from automax_ros.compile.base.layout import Role, StateField
from automax_ros.core.names import NameFault, element_name
from automax_ros.core.safe_file import replace_file
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.rack.base.local_names import local_named
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.tasks.task import Status, Task

KeptTask = dict[str, Any]
"""``source`` is the hash of the text that ran, ``values`` the variables by name, ``errors`` the log as numbers."""
_VARIABLES = (Role.LOCAL, Role.TUNABLE)


FORMAT = 2
MOST_BYTES = 64_000_000
"""Largest state file (decision: common memory and locals of four Processors are far below)."""
_FILE = "state.json"
Document = dict[str, Any]
_T = TypeVar("_T")
"""The whole kept state, as JSON has it."""


def kept_task(task: Task, source: str) -> KeptTask:
    """Return the present state of a task that is to be kept, between two scans."""
    flat, at = task.snapshot(), 0
    values: dict[str, Value | list[Value]] = {}
    errors: list[Value] = []
    for field in task.layout.fields:
        part = flat[at : at + field.size]
        at += field.size
        if field.role in _VARIABLES:
            values[field.name] = part if field.is_array else part[0]
        elif field.role is Role.LOG:
            errors = part
    return {"source": source, "values": values, "errors": errors}


def restore_task(task: Task, kept: KeptTask) -> int:
    """Restore the kept state of an installed task; return how many tunables are not as installed.

    Raises:
        KeyError: something is missing.
        ValueError: a value does not fit its variable, or lies outside the limits of tuning; nothing is restored.
        TypeError: it is not what ``kept_task`` returns.
    """
    flat: list[Value] = []
    fresh, at, tuned = task.snapshot(), 0, 0
    for field in task.layout.fields:
        part = fresh[at : at + field.size]
        at += field.size
        if field.role in _VARIABLES:
            part = _values_of(field, kept["values"][field.name])
        elif field.role is Role.LOG:
            part = [_whole(number) for number in kept["errors"]]
        if field.role is Role.TUNABLE:
            part = [task.tuning(field.name, part[0])]
            tuned += part[0] != field.initial
        if len(part) != field.size:
            raise ValueError(f"{field.name} of task {task.name} has {field.size} values, not {len(part)}")
        flat += part
    try:
        task.restore(flat)
    except OverflowError as error:
        raise ValueError(f"a value of task {task.name} is out of range") from error
    return tuned


def _values_of(field: StateField, value: Value | list[Value]) -> list[Value]:
    if isinstance(value, list) is not field.is_array:
        raise ValueError(f"{field.name} is {'an array' if field.is_array else 'not an array'}")
    part = value if isinstance(value, list) else [value]
    if not all(isinstance(item, bool | int | float | str) for item in part):
        raise TypeError(f"{field.name} cannot hold that")
    return part


def _whole(number: object) -> int:
    if not isinstance(number, int) or isinstance(number, bool):
        raise TypeError("an error log is whole numbers")
    return number


class RetentionFault(UserError):
    """A state folder cannot be read or written, its file is damaged or another rack's, or it does not fit the rack."""


@dataclass(frozen=True)
class Restored:
    """Result of restoring a state.

    ``settings`` are for ``Rack.start``; ``commons``, ``tunables`` and ``forces`` are how many differ from an
    installation; ``notes`` list kept values that are not used any more.
    """

    settings: tuple[tuple[str, Value], ...] = ()
    commons: int = 0
    tunables: int = 0
    forces: int = 0
    notes: tuple[str, ...] = ()


def default_folder(config: RackConfig) -> Path:
    """Return the default state folder of a rack on the wall clock: next to the rack file."""
    return config.path.parent / ".automax" / config.name


def kept_forces(config: RackConfig, folder: Path) -> dict[str, Value]:
    """Return what the state in a folder holds as forced, by the names of commons and of TASK.NAME; {} without a state.

    Raises:
        RetentionFault: the file cannot be read, is damaged, or is another rack's.
    """
    found: dict[str, Value] = {}

    def take(document: Document) -> None:
        forced = document["forced"].items()
        found.update((str(name), value) for name, value in forced if isinstance(value, (bool, int, float, str)))

    _read(folder / _FILE, config.name, take)
    return found


def _read(path: Path, rack: str, take: Callable[[Document], _T]) -> _T | None:
    """Return what ``take`` returns for the kept state of a rack, None if there is none.

    Raises:
        RetentionFault: the file cannot be read, is damaged, or is another rack's.
    """
    try:
        data = read_bytes(path, MOST_BYTES)
    except FileFault as fault:
        if isinstance(fault.__cause__, FileNotFoundError | NotADirectoryError):
            return None
        raise _fault(path, "AMX6710", f"cannot be used: it {fault}") from fault
    try:
        document = json.loads(data, parse_constant=_no_number)
        if document["format"] != FORMAT:
            raise ValueError(f"its format is {document['format']!r}, not {FORMAT}")
        if document["rack"] != rack:
            raise ValueError(f"it is that of rack {str(document['rack'])[:40]!r}")
        return take(document)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise _fault(path, "AMX6711", f"is damaged: {_reason(error)}") from error


def _fault(path: Path, code: str, message: str) -> RetentionFault:
    hint = "remove it to start the rack as installed, or name another folder with --state"
    return RetentionFault(f"the kept state {message}", hint, code=code, place=str(path))


class Retention:
    """Keeps one rack's state in a folder."""

    def __init__(self, rack: Rack, folder: Path) -> None:
        """Create for a rack that was not started; nothing is read or written yet."""
        self._rack = rack
        self.path = folder / _FILE
        volatile = (
            not variable.non_volatile or not rack.part.holds_common_memory for variable in rack.config.variables
        )
        self._views = [view for view, lost in enumerate(volatile) if not lost]
        self._registers = list(_kept_registers(rack))
        self._saved: Document = self._capture_installed()

    def restore(self) -> Restored:
        """Restore tasks and forces, and return the settings to be written at the start; nothing if no state was kept.

        To be called before the rack is observed, so that the first data of observers has it.

        Raises:
            RetentionFault: the file cannot be read, is damaged, is another rack's, or does not fit this one.
        """
        return _read(self.path, self._rack.config.name, self._restore) or Restored()

    def present(self) -> Document:
        """Return the present state that is to be kept, between two scans."""
        rack, variables = self._rack, self._rack.config.variables
        commons: Document = {}
        for view in self._views:
            value = rack.memory.present(view)
            commons[variables[view].name] = {
                **_shape(variables[view]),
                "values": value if isinstance(value, list) else [value],
            }
        tasks = {item.name: kept_task(item.task, hash_of(item.source.text)) for item in rack.scheduled}
        document: Document = {"format": FORMAT, "rack": rack.config.name, "commons": commons}
        document["registers"] = {name: value for name, value in self._present_registers() if value}
        own = (item for item in rack.forces() if rack.part.holds_common_memory or "." in item.name)
        document |= {"forced": {item.name: item.value for item in own}, "tasks": tasks}
        if rack.plants.ends:
            document["stock"] = rack.plants.stock()
        if rack.config.auto_run:
            # While the power is off those that ran before count as running.
            ran = frozenset() if rack.operations.powered else rack.operations.ran_at_power_off
            document["status"] = {
                task.name: (Status.RUNNING if task.name in ran else task.status).name for task in rack.tasks
            }
        return document

    def save(self, document: Document | None = None) -> bool:
        """Write a state, or the present one, to the disk, if it differs from the one written last.

        Raises:
            RetentionFault: it cannot be written.
        """
        present = self.present() if document is None else document
        if present == self._saved:
            return False
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self.path, json.dumps(present, allow_nan=False).encode())
        except OSError as error:
            raise _fault(self.path, "AMX6712", f"cannot be written: {error.strerror}") from error
        self._saved = present
        return True

    def _present_registers(self) -> Iterator[tuple[str, Value]]:
        variables, memory = self._rack.config.variables, self._rack.memory
        for view, element in self._registers:
            yield element_name(variables[view], element), memory.read_now(view, element)

    def _capture_installed(self) -> Document:
        """Return the state at the start of a rack without a kept state: it need not be written."""
        document = self.present()
        for view in self._views:
            variable = self._rack.config.variables[view]
            if variable.presets:
                document["commons"][variable.name]["values"] = list(variable.presets)
        return document

    def _restore(self, document: Document) -> Restored:
        notes: list[str] = []
        settings = list(self._settings(document["commons"], notes))
        commons = len({name.partition("(")[0] for name, _ in settings})
        settings += self._register_settings(document["registers"])
        tunables = self._restore_tasks(document["tasks"], notes)
        forces = self._force(document["forced"], notes)
        edited = self._rack.plants.restock(document.get("stock", {}))
        notes += [f"{name} was edited in the rack file: its roll, roller or web begins as installed" for name in edited]
        if self._rack.config.auto_run:
            self._begin_with(document.get("status", {}))
        for module in self._rack.modules:
            module.power_off()
        self._saved = {}
        return Restored(tuple(settings), commons, tunables, forces, tuple(notes))

    def _settings(self, commons: Mapping[str, Document], notes: list[str]) -> Iterator[tuple[str, Value]]:
        """Yield the elements whose kept values differ from an installation's."""
        variables = self._rack.config.variables
        defined = {variables[view].name: view for view in self._views}
        for name, kept in commons.items():
            view = defined.get(name)
            if view is None:
                notes.append(f"{name[:40]} was kept and is not non_volatile any more: its value is lost")
                continue
            variable = variables[view]
            self._compare_shapes(variable, {key: kept[key] for key in _shape(variable)})
            if len(kept["values"]) != variable.elements:
                raise ValueError(f"{variable.name} has {variable.elements} elements")
            for index, value in enumerate(kept["values"]):
                fitting = self._rack.memory.accepted(view, value, index)
                if fitting != (variable.presets[index] if variable.presets else variable.type.zero):
                    yield element_name(variable, index), fitting

    def _register_settings(self, kept: Mapping[str, Value]) -> Iterator[tuple[str, Value]]:
        variables, memory = self._rack.config.variables, self._rack.memory
        for view, element in self._registers:
            name = element_name(variables[view], element)
            if name in kept:
                yield name, memory.accepted(view, kept[name], element)

    def _compare_shapes(self, variable: CommonVariable, kept: Document) -> None:
        if kept != _shape(variable):
            place = f"{self._rack.config.path}:{variable.line}"
            message = f"{variable.name} was kept as {_describe(kept)}; {place} defines {_describe(_shape(variable))}"
            raise self._misfit(message)

    def _restore_tasks(self, kept: Mapping[str, KeptTask], notes: list[str]) -> int:
        tunables = 0
        for item in self._rack.scheduled:
            state = kept.get(item.name)
            if state is None:
                continue
            if state["source"] != hash_of(item.source.text):
                notes.append(f"task {item.name} was edited: it begins as installed")
                continue
            tunables += restore_task(item.task, state)
        names = {item.name for item in self._rack.scheduled}
        notes += [f"task {name[:40]} was kept and is not in the rack any more" for name in kept if name not in names]
        return tunables

    def _force(self, forced: Mapping[str, Value], notes: list[str]) -> int:
        """Restore forces; a variable that no longer exists is noted, one that cannot be forced is an error.

        A local that its edited task has no longer as a simple variable is noted too (decision).
        """
        lines = {variable.name: variable.line for variable in self._rack.config.declared}
        lines |= {name: 0 for name in forced if self._may_hold(name)}
        known = [name for name in forced if name in lines]
        notes += [f"{name[:40]} was forced and is not defined any more" for name in forced if name not in lines]
        for name in known:
            try:
                self._rack.force(name, forced[name])
            except MemoryValueError as error:
                place = f" ({self._rack.config.path}:{lines[name]})" if lines[name] else ""
                raise self._misfit(f"{name} was kept as forced{place}: {error}") from error
        return len(known)

    def _may_hold(self, name: str) -> bool:
        """Return whether a task has a local of that name that may be forced."""
        try:
            return "." in name and local_named(self._rack.tasks, name).why_not_forced is None
        except NameFault:
            return False

    def _begin_with(self, statuses: Mapping[str, str]) -> None:
        """Select the tasks that ran to be started, as AUTO RUN does; a new one starts too."""
        for task in self._rack.tasks:
            task.status = Status[statuses.get(task.name, "RUNNING")]
        running = [task for task in self._rack.tasks if task.status is Status.RUNNING]
        self._rack.operations.starting = frozenset(task.name for task in running)
        for task in running:
            task.status = Status.STOPPED

    def _misfit(self, message: str) -> RetentionFault:
        hint = "change the rack file back, or remove the state to start the rack as installed"
        return RetentionFault(f"the kept state does not fit: {message}", hint, code="AMX6713", place=str(self.path))


def _kept_registers(rack: Rack) -> Iterator[tuple[int, int]]:
    """Yield view and element of the registers that a module keeps and that are not inputs of the process."""
    variables = rack.config.variables
    for module in rack.modules:
        for view, element in sorted(module.kept):
            if variables[view].bank is not None and module.config.registers.direction(element) != "input":
                yield view, element


def hash_of(text: str) -> str:
    """Return the hash that identifies the text of a source."""
    return hashlib.sha256(text.encode()).hexdigest()


def _shape(variable: CommonVariable) -> Document:
    return {"type": variable.type.word, "dimensions": list(variable.dimensions), "length": variable.length}


def _describe(shape: Document) -> str:
    largest = ",".join(str(size - 1) for size in shape["dimensions"])
    length = f" of {shape['length']} characters" if shape["length"] else ""
    return f"{shape['type']}{length}{f' ({largest})' if largest else ''}"


def _no_number(text: str) -> None:
    raise ValueError(f"{text} is not a number")


def _reason(error: Exception) -> str:
    if isinstance(error, MemoryValueError):
        return str(error)
    if isinstance(error, KeyError):
        return f"it lacks {str(error)[:60]}"
    if isinstance(error, RecursionError):
        return "it is nested too deep"
    return str(error)[:200] if isinstance(error, ValueError) else "it is not what a rack has written"
