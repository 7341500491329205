"""The tasks of a module, from its ``tasks`` section."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Schema, entries, line, may_be_empty, section
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.language.tree.task_kind import LADDER_SUFFIX, TASK_SUFFIXES, NotATask, is_task_file, kind_of_file
from automax_ros.rackfile.model.module import MAX_PRIORITY, MAX_TASKS, MIN_PRIORITY, TaskConfig
from automax_ros.rackfile.reading.files import FileFault, read_bytes, stays_next_to
from automax_ros.rackfile.reading.names import TASK_NAME, DeclarationFault, check_task_name
from automax_ros.rackfile.reading.values import (
    Key,
    ProblemList,
    Section,
    entries_of,
    flag_key,
    report_twice,
    schemas,
    text_key,
    whole_key,
)

_LISTED_FILES = 1000


@dataclass(frozen=True)
class TaskPlace:
    """Place of a task among those of its module: ``priority`` orders them, ``drive`` is that of a UDC's task."""

    priority: int
    drive: str = ""


@dataclass(frozen=True)
class TaskPlaces:
    """How a kind of module orders its tasks.

    ``key`` is the key for it in a task's section, ``sample`` an example of its value; ``most`` tasks run on one module.
    """

    key: Key[TaskPlace]
    sample: str
    most: int


_PRIORITY = whole_key(
    "priority", "4 is served first; equal ones in the order of their names.", MIN_PRIORITY, MAX_PRIORITY, "AMX6302"
)


def _priority(node: Node, what: str, findings: ProblemList) -> TaskPlace | None:
    found = _PRIORITY.read(node, what, findings)
    return None if found is None else TaskPlace(found)


PRIORITIES = TaskPlaces(Key("priority", _PRIORITY.schema, _priority), "8", MAX_TASKS)
"""A Processor's tasks: by priority, of which several tasks may have the same."""
_FILE = text_key(
    "file",
    line(
        "The source, .BLK or .BAS, below the rack file's folder; without the key the task's name with .BLK or .BAS.",
        200,
    ),
    200,
)
_CRITICAL = flag_key("critical", "Whether only STOP ALL stops it.")


def tasks_schema(places: TaskPlaces) -> Schema:
    """Return the schema of a module's tasks."""
    task = section("A task: one program.", schemas(_FILE, places.key, _CRITICAL), (places.key.name,))
    return may_be_empty(entries("The tasks of the module, by their names.", TASK_NAME, task, places.most))


@dataclass
class TaskReader:
    """Reads the tasks of all modules of a rack, whose names must differ.

    Sources lie in the folder of ``rack_file``, or of the file that it is a link to, unless ``allow_outside``. Without a
    rack file none is read: the sources are stored under their tasks' names, whatever their files in the rack file.
    """

    rack_file: Path | None
    allow_outside: bool
    findings: ProblemList
    seen: dict[str, Span] = field(default_factory=dict)

    def read(self, node: Node, where: str, places: TaskPlaces) -> tuple[TaskConfig, ...]:
        """Return the tasks of one module without errors; ``where`` names the module in messages."""
        entries = entries_of(node, f"tasks of {where}", self.findings) or ()
        if len(entries) > places.most:
            message = f"{where} has {len(entries)} tasks; it runs at most {places.most}"
            self.findings.add("AMX6303", message, entries[places.most][0].span)
        tasks = (self._task(key, value, places) for key, value in entries[: places.most])
        return tuple(task for task in tasks if task is not None)

    def _task(self, key: Scalar, node: Node, places: TaskPlaces) -> TaskConfig | None:
        name = self._name(key)
        what, place_key = f"task {quoted(key.text)}", places.key
        if isinstance(node, Scalar) and len(node.text) <= 40 and is_task_file(node.text):
            hint = f"write {quoted(key.text, marks='')}: {{file: {node.text}, {place_key.name}: {places.sample}}}"
            self.findings.add("AMX6008", f"{what} must be keys and values, not a file's name", node.span, hint)
            return None
        section = Section(node, what, schemas(_FILE, place_key, _CRITICAL), self.findings)
        if not section.well_formed:
            return None
        section.require((place_key.name,), what, key.span)
        place = section.read(place_key)
        file = self._file(section, key, name)
        is_critical = bool(section.read(_CRITICAL))
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

    def _file(self, section: Section, key: Scalar, name: str | None) -> Path | None:
        """Return the source's path; without the key it is the task's name with .BLK, as in the Executive (2.4.1).

        If there is no such file, but one with .BAS, that one is used (decision); a ladder task (.PC) is reported as
        such.
        """
        if self.rack_file is None:
            return Path(f"{name}.BLK") if name is not None else None
        node = section.get("file")
        if node is not None:
            text = section.read(_FILE)
            return self._usable(text, node.span, self.rack_file) if text is not None else None
        if name is None:
            return None
        names = [f"{name}{suffix}" for suffix in (*TASK_SUFFIXES, LADDER_SUFFIX)]
        usual = next((item for item in names if (self.rack_file.parent / item).is_file()), names[0])
        return self._usable(usual, key.span, self.rack_file)

    def _usable(self, text: str, span: Span, rack_file: Path) -> Path | None:
        try:
            kind_of_file(text)
        except NotATask as fault:
            self.findings.add("AMX6304", f"{quoted(text)}: {fault}", span)
            return None
        path = rack_file.parent / text
        if not self.allow_outside and not stays_next_to(text, rack_file):
            message = f"{quoted(text)} lies outside the rack file's folder"
            hint = "put the source next to the rack file, or allow it with --allow-outside"
            self.findings.add("AMX6305", message, span, hint)
            return None
        try:
            read_bytes(path)  # whether it can be read: it is checked later, possibly changed
        except FileFault as fault:
            code = "AMX6307" if fault.too_large else "AMX6306"
            hint = "" if fault.too_large else did_you_mean(path.name, _names_in(path.parent)) or ""
            self.findings.add(code, f"{quoted(text)} {fault}", span, hint or None)
            return None
        return path


def _names_in(folder: Path) -> list[str]:
    try:
        names = sorted(item.name for item in folder.iterdir() if is_task_file(item))
    except (OSError, ValueError):
        return []
    return names[:_LISTED_FILES]
