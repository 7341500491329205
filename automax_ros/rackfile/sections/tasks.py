"""The tasks of a module, as its ``tasks`` section lists them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeGuard

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, entries, flag, line, may_be_empty, section, whole
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.language.tree.task_kind import LADDER_SUFFIX, TASK_SUFFIXES, NotATask, is_task_file, kind_of_file
from automax_ros.rackfile.model.task import MAX_PRIORITY, MAX_TASKS, MIN_PRIORITY, TaskConfig
from automax_ros.rackfile.reading.files import FileFault, read_bytes, stays_next_to
from automax_ros.rackfile.reading.names import TASK_NAME, DeclarationFault, check_task_name
from automax_ros.rackfile.reading.values import (
    ProblemList,
    Section,
    boolean_value,
    entries_of,
    integer_value,
    report_twice,
    text_value,
)

_PATH_LIMIT = 200
_LISTED_FILES = 1000


@dataclass(frozen=True)
class TaskPlace:
    """Where a task stands among those of its module: ``priority`` orders them, ``drive`` is that of a UDC's task."""

    priority: int
    drive: str = ""


class TaskPlaces(Protocol):
    """How a kind of module orders its tasks.

    ``key`` says it in a task's section, for example with ``sample``; ``most`` tasks run on one module.
    """

    @property
    def key(self) -> str: ...  # noqa: D102

    @property
    def sample(self) -> str: ...  # noqa: D102

    @property
    def most(self) -> int: ...  # noqa: D102

    @property
    def schema(self) -> Schema:
        """The schema of what stands after the key."""
        ...

    def read(self, node: Node, what: str, findings: ProblemList) -> TaskPlace | None:
        """Return what the key of a task says, None (reported) where it is wrong."""
        ...


class Priorities:
    """A Processor's tasks: priorities, several tasks of one priority if need be."""

    key, sample, most = "priority", "8", MAX_TASKS
    schema = whole("4 is served first; equal ones in the order of their names.", MIN_PRIORITY, MAX_PRIORITY)

    def read(self, node: Node, what: str, findings: ProblemList) -> TaskPlace | None:
        """Return a priority."""
        what = f"priority of {what}"
        found = integer_value(node, what, findings, low=MIN_PRIORITY, high=MAX_PRIORITY, code="AMX6302")
        return None if found is None else TaskPlace(found)


PRIORITIES = Priorities()


def tasks_schema(places: TaskPlaces) -> Schema:
    """Return the schema of a module's tasks."""
    task = section("A task: one program.", _keys(places), (places.key,))
    return may_be_empty(entries("The tasks of the module, by their names.", TASK_NAME, task, places.most))


def _keys(places: TaskPlaces) -> Keys:
    """Return what may be said of a task."""
    file = "The source, .BLK or .BAS, below the rack file's folder; without the key the task's name with .BLK or .BAS."
    return {
        "file": line(file, _PATH_LIMIT),
        places.key: places.schema,
        "critical": flag("Whether only STOP ALL stops it.", False),
    }


@dataclass
class TaskReader:
    """Reads the tasks of all modules of a rack, whose names must differ.

    Sources lie in the folder of ``rack_file``, or of the file that it is a link to, unless ``allow_outside``. Without
    a rack file none is touched: the sources are stored under their tasks' names, whatever the rack file calls them.
    """

    rack_file: Path | None
    allow_outside: bool
    findings: ProblemList
    seen: dict[str, Span] = field(default_factory=dict)

    def read(self, node: Node, where: str, places: TaskPlaces = PRIORITIES) -> tuple[TaskConfig, ...]:
        """Return the tasks of one module that are right; ``where`` names it in messages."""
        entries = entries_of(node, f"tasks of {where}", self.findings) or ()
        if len(entries) > places.most:
            message = f"{where} has {len(entries)} tasks; it runs at most {places.most}"
            self.findings.add("AMX6303", message, entries[places.most][0].span)
        tasks = (self._task(key, value, places) for key, value in entries[: places.most])
        return tuple(task for task in tasks if task is not None)

    def _task(self, key: Scalar, node: Node, places: TaskPlaces) -> TaskConfig | None:
        name = self._name(key)
        what = f"task {quoted(key.text)}"
        if _is_file_name(node):
            hint = f"write {quoted(key.text, marks='')}: {{file: {node.text}, {places.key}: {places.sample}}}"
            self.findings.add("AMX6008", f"{what} must be keys and values, not a file's name", node.span, hint)
            return None
        entries = entries_of(node, what, self.findings)
        if entries is None:
            return None
        section = Section(entries, what, _keys(places), self.findings)
        section.require((places.key,), what, key.span, self.findings)
        given = section.get(places.key)
        place = places.read(given, what, self.findings) if given is not None else None
        file = self._file(section.get("file"), key, name, what)
        critical = section.get("critical")
        is_critical = bool(critical and boolean_value(critical, f"critical of {what}", self.findings))
        if name is None or place is None or file is None:
            return None
        return TaskConfig(name, file, place.priority, key.span.line, is_critical, place.drive)

    def _name(self, key: Scalar) -> str | None:
        name = self.findings.upper_case(key.text, key.span)
        try:
            check_task_name(name)
        except DeclarationFault as fault:
            self.findings.add(fault.code, f"{quoted(key.text)}: {fault.message}", key.span, fault.hint)
            return None
        if name in self.seen:
            report_twice(key, f"task {name}", self.seen[name], self.findings, "AMX6301")
            return None
        self.seen[name] = key.span
        return name

    def _file(self, node: Node | None, key: Scalar, name: str | None, what: str) -> Path | None:
        """Return the source's path; without the key it is the task's name with .BLK, as in the Executive (2.4.1).

        Where there is no such file, but one with .BAS, that is it (decision); a ladder task (.PC) is told as such.
        """
        if self.rack_file is None:
            return Path(f"{name}.BLK") if name is not None else None
        if node is None:
            return self._usable(self._usual(name), key.span) if name is not None else None
        text = text_value(node, f"file of {what}", self.findings, limit=_PATH_LIMIT)
        return self._usable(text, node.span) if text is not None else None

    def _usual(self, name: str) -> str:
        """Return the name of the source of a task whose entry does not give one."""
        assert self.rack_file is not None
        names = [f"{name}{suffix}" for suffix in (*TASK_SUFFIXES, LADDER_SUFFIX)]
        return next((item for item in names if (self.rack_file.parent / item).is_file()), names[0])

    def _usable(self, text: str, span: Span) -> Path | None:
        try:
            kind_of_file(text)
        except NotATask as fault:
            self.findings.add("AMX6304", f"{quoted(text)}: {fault}", span)
            return None
        assert self.rack_file is not None
        path = self.rack_file.parent / text
        if not self.allow_outside and not stays_next_to(text, self.rack_file):
            message = f"{quoted(text)} lies outside the rack file's folder"
            hint = "put the source next to the rack file, or allow it with --allow-outside"
            self.findings.add("AMX6305", message, span, hint)
            return None
        return path if self._readable(text, path, span) else None

    def _readable(self, text: str, path: Path, span: Span) -> bool:
        try:
            read_bytes(path)
        except FileFault as fault:
            code = "AMX6307" if fault.too_large else "AMX6306"
            hint = None if fault.too_large else did_you_mean(path.name, _names_in(path.parent))
            self.findings.add(code, f"{quoted(text)} {fault}", span, hint)
            return False
        return True


def _is_file_name(node: Node) -> TypeGuard[Scalar]:
    return isinstance(node, Scalar) and len(node.text) <= 40 and is_task_file(node.text)


def _names_in(folder: Path) -> list[str]:
    """Return the sources in a folder, in a fixed order."""
    try:
        names = sorted(item.name for item in folder.iterdir() if is_task_file(item))
    except (OSError, ValueError):
        return []
    return names[:_LISTED_FILES]
