"""The tasks of $TASKS in the rack file: their sources, priorities or drives, and stubs of ladder tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.text import count_of, quoted
from automax_ros.rackfile.modules.udc import DRIVES, UDC
from automax_ros.rackfile.old_plants.executive.cards import comment_of
from automax_ros.rackfile.old_plants.executive.document import Entry
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import DiskFolder
from automax_ros.rackfile.old_plants.executive.ladder import MOST_DECLARED, ladder_files, named_in, stub_file, stub_of
from automax_ros.rackfile.old_plants.executive.parts import COMPILED, RUNNING, OldModule, OldTask
from automax_ros.rackfile.old_plants.executive.sources import TaskSource, read_source
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.rackfile.reading.names import DeclarationFault, check_task_name

_NOT_LOADED = "a test task, which is not loaded with the others"
_INCLUDED = "an include file: it is written into the tasks that include it"


@dataclass
class TaskEntries:
    """Makes the entries of tasks; ``drives`` are A or B as the user says it, by names of tasks.

    ``sources`` are the sources that could be read, by names of tasks, ``files`` the new rack's files by their names.
    """

    folder: DiskFolder
    tasks: Sequence[OldTask]
    code_page: str
    drives: Mapping[str, str]
    findings: Findings
    sources: dict[str, TaskSource] = field(init=False, default_factory=dict)
    files: dict[str, bytes] = field(init=False, default_factory=dict)
    _faults: dict[str, str] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        for task in self.tasks:
            if task.kind in COMPILED and task.name:
                try:
                    source = read_source(
                        self.folder, task.name, task.kind, task.is_udc, self.code_page, self.findings
                    )  # fmt: skip
                except FileFault as fault:
                    self._faults[task.name] = f"{task.file} {fault}"
                else:
                    self.sources[task.name] = source
                    self.files[source.file] = source.converted.data

    def entry(self, task: OldTask, module: OldModule, declared: Sequence[str]) -> Entry:
        """Return a task's entry; ``declared`` are the rack's variables. One that is left out is told.

        It is lost (AMX6789), or the Executive does not load it either (AMX6787).
        """
        file = task.file
        place = f"priority: {'' if task.priority is None else task.priority}"
        critical = ", critical: true" if task.record.flag("critical") else ""
        note = task.record.text("desc")
        reason = self._reason(task)
        if module.model in UDC.models and not reason:
            place = f"drive: {self._drive(task)}"
        if task.kind == "PC" and not reason:
            file = stub_file(task.name)
            note = f"a stub of {task.name}.PC" + (f": {note}" if note else "")
            self._ladder(task, file, declared)
        name = "" if file == f"{task.name}.BLK" else f"file: {file}, "
        line = f"{task.name}: {{{name}{place}{critical}}}"
        entry = Entry(line, task.record.file, task.record.number, note=comment_of(note), detail=comment_of(note))
        if reason:
            entry.lessen(reason)
            code, what = ("AMX6787", "left out") if reason in (_NOT_LOADED, _INCLUDED) else ("AMX6789", "lost")
            message = f"task {task.name} is {what}: {reason}"
            self.findings.add(code, message, task.record.file, task.record.number)
        return entry

    def _reason(self, task: OldTask) -> str:
        """Return why a task stands as a comment, "" if it does not."""
        try:
            check_task_name(task.name)
        except DeclarationFault as fault:
            return fault.message
        if task.kind == "INC":
            return _INCLUDED if task.file in self.folder.files else f"{task.file} is not in the folder"
        if task.kind not in RUNNING:
            return f"type {quoted(task.kind)} is none that $TASKS has"
        if task.record.flag("utility"):
            return _NOT_LOADED
        return self._faults.get(task.name, "")

    def _drive(self, task: OldTask) -> str:
        """Return the drive of a UDC task: given, stored as a letter, or found out, which is told."""
        given = self.drives.get(task.name) or task.record.text("drive").upper()
        given = given or task.record.text("priority").upper()
        if given in DRIVES:
            return given
        own = [item for item in self.tasks if item.slot == task.slot and item.kind == task.kind]
        own.sort(key=lambda item: (item.priority if item.priority is not None else 0, item.record.number))
        drive = DRIVES[min(own.index(task), len(DRIVES) - 1)]
        why = "it is alone" if len(own) == 1 else "by the order of PRIORITY and of the records"
        message = f"task {task.name} is taken for drive {drive}, {why}: how the Executive stores A or B is not known"
        hint = f"--drive {task.name}={DRIVES[1 - DRIVES.index(drive)]} if it is the other"
        self.findings.add("AMX6792", message, task.record.file, task.record.number, hint)
        return drive

    def _ladder(self, task: OldTask, file: str, declared: Sequence[str]) -> None:
        """Make the stub of a ladder task."""
        named = ladder_files(task.name)
        data: dict[str, bytes] = {}
        for name in named:
            path = self.folder.files.get(name)
            if path is not None:
                try:
                    data[name] = read_bytes(path)
                except FileFault as fault:
                    self.findings.add("AMX6795", f"the file {fault}", name)
        found = named_in(data.values(), declared)
        self.files[file] = stub_of(task.name, list(data), found[:MOST_DECLARED]).encode()
        message = f"the ladder task {task.name} becomes a stub in BASIC, {file}, that does nothing"
        if data:
            message += f"; {' and '.join(data)} name {count_of(len(found), 'variable')}"
            message += f", of which only the first {MOST_DECLARED} are declared" if len(found) > MOST_DECLARED else ""
        code = "AMX6795" if named[0] in data else "AMX6789"
        message += "" if named[0] in data else f"; {named[0]} is not in the folder, or cannot be read"
        self.findings.add(code, message, task.record.file, task.record.number, "write its logic there")


def file_of(entry: Entry) -> str:
    """Return the name of the file that a task's entry names."""
    name, _, rest = entry.whole.partition(":")
    return rest.partition("file: ")[2].partition(",")[0] if "file: " in rest else f"{name}.BLK"
