"""What a rack keeps over a power cycle, in a folder between two runs: non-volatile commons and tunables (2.4.5).

The folder holds one file, ``state.json``, replaced as a whole. A tunable belongs to its task's source: after an edit of
the task it begins at CURRENT again, as after an installation (decision). A common that the rack file no longer defines,
or defines with another type or size, begins as installed. Values come back as writes at the start, after the presets,
so that recordings have them (decision).
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.core.faults import Fault
from automax_ros.core.names import element_name
from automax_ros.core.types import Value
from automax_ros.rack.config import CommonVariable, RackConfig
from automax_ros.rack.files import FileFault, read_bytes
from automax_ros.rack.rack import Rack
from automax_ros.running.task import Task
from automax_ros.running.views import MemoryValueError

FORMAT = 1
MOST_BYTES = 64_000_000
"""Largest state file (decision: common memory and tunables of four Processors are far below)."""
_FILE = "state.json"


class RetentionFault(Fault):
    """A state folder cannot be read or written, or its file is damaged or another rack's."""


@dataclass(frozen=True)
class Restored:
    """What came back: ``settings`` for ``Rack.start``, how many commons and tunables differ from an installation."""

    settings: tuple[tuple[str, Value], ...] = ()
    commons: int = 0
    tunables: int = 0


def default_folder(config: RackConfig) -> Path:
    """Return where a rack on the wall clock keeps its state: next to the rack file."""
    return config.path.parent / ".automax" / config.name


class Retention:
    """Keeps one rack's state in a folder."""

    def __init__(self, rack: Rack, folder: Path) -> None:
        """Take a rack that was not started; nothing is read or written yet."""
        self._rack = rack
        self.path = folder / _FILE
        self._views = [view for view, variable in enumerate(rack.config.variables) if variable.non_volatile]
        self._saved: list[list[Any]] = self._present()

    def restore(self) -> Restored:
        """Set the tunables, and return what the start must write; nothing where nothing was kept.

        Raises:
            RetentionFault: the file cannot be read, is damaged, or is another rack's.
        """
        try:
            data = read_bytes(self.path, MOST_BYTES)
        except FileFault as fault:
            if isinstance(fault.__cause__, FileNotFoundError | NotADirectoryError):
                return Restored()
            raise self._fault(str(fault)) from fault
        try:
            return self._restored(json.loads(data, parse_constant=_no_number))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise self._fault(f"is damaged: {_reason(error)}") from error

    def save(self, *, durable: bool = False) -> bool:
        """Write the present state if it has changed; ``durable`` waits until it is on the disk. Return whether it had.

        Raises:
            RetentionFault: it cannot be written.
        """
        present = self._present()
        if present == self._saved:
            return False
        text = json.dumps(self._document(), indent=1, allow_nan=False)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            _replace(self.path, text, durable=durable)
        except OSError as error:
            raise self._fault(f"cannot be written: {error.strerror}") from error
        self._saved = present
        return True

    @property
    def _tunables(self) -> list[tuple[Task, str]]:
        """The tunables of the tasks as they are now: a task may have been reloaded."""
        return [(task, name) for task in self._rack.tasks for name in _tunables(task)]

    @property
    def _sources(self) -> dict[str, str]:
        sources = self._rack.sources.items()
        return {name: hashlib.sha256(source.text.encode()).hexdigest() for name, source in sources}

    def _present(self) -> list[list[Any]]:
        memory = self._rack.memory
        commons: list[Any] = [memory.present(view) for view in self._views]
        return [commons, [task.value(name) for task, name in self._tunables]]

    def _document(self) -> dict[str, Any]:
        variables = self._rack.config.variables
        values, tunables = self._present()
        commons: dict[str, Any] = {}
        for view, value in zip(self._views, values, strict=True):
            elements = value if isinstance(value, list) else [value]
            commons[variables[view].name] = {**_shape(variables[view]), "values": elements}
        tasks: dict[str, Any] = {name: {"source": source, "tunables": {}} for name, source in self._sources.items()}
        for (task, name), value in zip(self._tunables, tunables, strict=True):
            tasks[task.name]["tunables"][name] = value
        return {"format": FORMAT, "rack": self._rack.config.name, "commons": commons, "tasks": tasks}

    def _restored(self, document: dict[str, Any]) -> Restored:
        if document["format"] != FORMAT:
            raise ValueError(f"its format is {document['format']!r}, not {FORMAT}")
        if document["rack"] != self._rack.config.name:
            raise ValueError(f"it is that of rack {str(document['rack'])[:40]!r}")
        settings = list(self._settings(document["commons"]))
        commons = len({name.partition("(")[0] for name, _ in settings})
        tunables = self._tune(document["tasks"])
        self._saved = []
        return Restored(tuple(settings), commons, tunables)

    def _settings(self, commons: dict[str, Any]) -> Iterator[tuple[str, Value]]:
        """Yield the elements that an installation would set otherwise."""
        for view in self._views:
            variable = self._rack.config.variables[view]
            kept = commons.get(variable.name)
            if kept is None or {key: kept[key] for key in _shape(variable)} != _shape(variable):
                continue
            if len(kept["values"]) != variable.elements:
                raise ValueError(f"{variable.name} has {variable.elements} elements")
            for index, value in enumerate(kept["values"]):
                fitting = self._rack.memory.accepted(view, value, index)
                if fitting != (variable.presets[index] if variable.presets else variable.type.zero):
                    yield element_name(variable, index), fitting

    def _tune(self, tasks: dict[str, Any]) -> int:
        """Set the tunables of tasks that are as they were; all of them fit, or none is set."""
        wanted = []
        sources = self._sources
        for task, name in self._tunables:
            kept = tasks.get(task.name)
            if kept is not None and kept["source"] == sources[task.name]:
                value = task.tuning(name, kept["tunables"][name])
                if value != task.value(name):
                    wanted.append((task, name, value))
        for task, name, value in wanted:
            self._rack.tune(task, name, value)
        return len(wanted)

    def _fault(self, message: str) -> RetentionFault:
        hint = "remove it to start the rack as installed, or name another folder with --state"
        return RetentionFault(f"the kept state {message}", hint, place=str(self.path))


def _tunables(task: Task) -> list[str]:
    return [symbol.name for symbol in task.compiled.program.symbols.values() if symbol.tuning is not None]


def _shape(variable: CommonVariable) -> dict[str, Any]:
    return {"type": variable.type.word, "dimensions": list(variable.dimensions), "length": variable.length}


def _replace(path: Path, text: str, *, durable: bool) -> None:
    """Put a whole file in the place of another: whoever reads it gets one or the other."""
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


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
