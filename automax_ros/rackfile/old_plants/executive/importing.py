"""Makes a rack file, with the sources of its tasks, from the databases of a Programming Executive 3.x or 4.x."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.core.text import count_of, printable, quoted
from automax_ros.rackfile.model.config import MAX_SLOT
from automax_ros.rackfile.modules.processor import PROCESSOR
from automax_ros.rackfile.modules.registry import SUPPORTED
from automax_ros.rackfile.modules.udc import DRIVES, UDC
from automax_ros.rackfile.old_plants.draft import rack_name
from automax_ros.rackfile.old_plants.executive.cards import (
    comment_of,
    described,
    network_keys,
    tick_keys,
    values_of,
    why_not,
)
from automax_ros.rackfile.old_plants.executive.commons import CommonEntries
from automax_ros.rackfile.old_plants.executive.dbase import DEFAULT_CODE_PAGE
from automax_ros.rackfile.old_plants.executive.disks import OldRack, read_old_rack
from automax_ros.rackfile.old_plants.executive.document import Document, ModuleEntry
from automax_ros.rackfile.old_plants.executive.fields import FieldChoice, Record
from automax_ros.rackfile.old_plants.executive.findings import Findings, Unplaced
from automax_ros.rackfile.old_plants.executive.folders import DiskFolder, RackPlace
from automax_ros.rackfile.old_plants.executive.ladder import ladder_files, stub_file
from automax_ros.rackfile.old_plants.executive.parts import (
    NETWORK,
    PROCESSORS,
    OldModule,
    OldTask,
    by_slot,
    is_memory,
    modules_of,
    tasks_of,
)
from automax_ros.rackfile.old_plants.executive.sources import declarations_of, files_not_read
from automax_ros.rackfile.old_plants.executive.tasks import TaskEntries, file_of
from automax_ros.rackfile.old_plants.executive.variables import variables_of
from automax_ros.rackfile.old_plants.net_files import net_lines
from automax_ros.rackfile.reading.executive import NEWEST, version_text

_OLDER = 32
"""The newest Executive whose databases have SYSTEM_VER 0."""
_TIMED = tuple(PROCESSOR.models)
"""Modules whose tick WIRE_NOTE1 holds (J2-3106-1 p. F-2)."""


@dataclass(frozen=True)
class Choices:
    """What the user says of an old rack: modules by part codes and by slots, fields, code page, Executive, drives.

    ``executive`` is a version in tenths, ``drives`` are A or B by names of UDC tasks.
    """

    parts: Mapping[int, str] = field(default_factory=dict)
    modules: Mapping[int, str] = field(default_factory=dict)
    fields: Sequence[FieldChoice] = ()
    code_page: str | None = None
    executive: int | None = None
    drives: Mapping[str, str] = field(default_factory=dict)


@dataclass
class ImportedRack:
    """A new rack: the text of its file, the sources of its tasks by file name, counts, and what its reader says of it.

    ``known`` are the part codes whose modules were found out or given.
    """

    name: str
    text: str
    sources: dict[str, bytes]
    tasks: int
    commons: int
    diagnostics: list[Diagnostic]
    known: dict[int, str]


def import_rack(place: RackPlace, choices: Choices, findings: Findings) -> ImportedRack:
    """Return the rack file of a rack of the Executive; everything that is damaged, guessed or left out is told.

    Raises:
        UserError: the rack file would be larger than one may be.
    """
    return _Import(read_old_rack(place, choices.fields, choices.code_page, findings), choices, findings).result()


class _Import:
    def __init__(self, old: OldRack, choices: Choices, findings: Findings) -> None:
        self._old, self._choices, self._findings = old, choices, findings
        self._code_page = choices.code_page or DEFAULT_CODE_PAGE
        self._unplaced = Unplaced()
        self._net_lines: dict[str, str] = {}
        for folder in (old.place.system, old.place.rack):
            if folder is not None:
                self._net_lines |= self._lines_of_networks(folder)
        self._tasks = tasks_of(old.of("TASKS"), findings)
        self._task_entries = TaskEntries(old.place.rack, self._tasks, self._code_page, choices.drives, findings)
        self._sources = self._task_entries.sources
        declarations = declarations_of(self._sources.values())
        self._variables = variables_of(old.of("SWVAR"), old.of("NET"), declarations, findings)
        own = [card for card in old.of("CARD") if not card.whole("drop")]
        written = frozenset(name for source in self._sources.values() for name in source.written)
        given = (choices.parts, choices.modules)
        self._modules = modules_of(own, self._tasks, self._variables, written, given, findings)
        self._udcs = frozenset(slot for slot, module in self._modules.items() if module.model in UDC.models)
        self._declared = [item.text for item in self._variables if item.declared is not None]

    def _lines_of_networks(self, folder: DiskFolder) -> dict[str, str]:
        found = net_lines(folder.path)
        for name, reason in found.left_out:
            self._findings.add("AMX6795", f"the file {reason}: not read", name)
        return found.lines

    def result(self) -> ImportedRack:
        document = Document(self._head())
        tasks = by_slot(self._tasks)
        document.modules = [self._module(module, tasks.get(module.slot, ())) for module in self._modules.values()]
        document.elsewhere = list(self._elsewhere())
        document.commons = CommonEntries(self._modules, self._net_lines, self._unplaced).entries(self._variables)
        self._tell_choices()
        self._unplaced.tell(self._findings)
        diagnostics = document.settle(self._findings)
        running = [task for module in document.modules for task in module.tasks if not task.is_comment]
        files = {file_of(task): None for task in running}
        sources = {file: data for file, data in self._task_entries.files.items() if file in files}
        document.tail = list(self._tail(sources))
        commons = sum(not entry.is_comment for entry in document.commons)
        known = {
            module.code: module.model
            for module in self._modules.values()
            if module.code is not None and module.model is not None
        }
        return ImportedRack(self._name, document.text(), sources, len(running), commons, diagnostics, known)

    # Head

    @property
    def _name(self) -> str:
        return rack_name(self._old.place.name)

    def _head(self) -> list[str]:
        lines = ["# Made from the databases of an AutoMax Programming Executive; docs/rack_yaml.md has every key."]
        system = next(iter(self._old.of("SYSTEM")), None)
        own = self._old.own
        section = own.text("section") if own is not None else ""
        sections = [item for item in self._old.of("SECT") if item.text("id") == section] if section else []
        for word, record in (("system", system), ("section", next(iter(sections), None)), ("rack", own)):
            if record is not None:
                lines.append(comment_of(f"# {word} {record.text('id')}: {described(record)}"))
        if self._old.of("RACK") and own is None:
            message = f"no record names the rack {self._old.place.name}: its folder's name is taken"
            self._findings.add("AMX6795", message, "$RACK.DBF")
        if self._name != self._old.place.name:
            message = f"{quoted(self._old.place.name)} is not a rack's name: it becomes {self._name}"
            self._findings.add("AMX6795", message, "$RACK.DBF")
        return [*lines, f"rack: {self._name}", self._executive(system)]

    def _executive(self, system: Record | None) -> str:
        version = system.text("version") if system is not None else ""
        if self._choices.executive is not None:
            return f"executive: {version_text(self._choices.executive)}"
        taken, says = (NEWEST, "3.3 to 4.2") if version != "0" else (_OLDER, "3.0 to 3.2")
        what = f"SYSTEM_VER {version} says {says}" if version in ("0", "1") else "no SYSTEM_VER says which"
        if system is not None:
            message = f"{what}: Executive {version_text(taken)} is taken"
            self._findings.add("AMX6792", message, system.file, system.number, "--executive 3.8 says another")
        return f"executive: {version_text(taken)}                   # {what}"

    # Modules

    def _module(self, module: OldModule, tasks: Sequence[OldTask]) -> ModuleEntry:
        card = module.card
        file, record = (card.file, card.number) if card is not None else ("$TASKS.DBF", 0)
        if card is None and tasks:
            record = tasks[0].record.number
        desc = card.text("desc") if card is not None else "no record of $CARD"
        shown = "" if module.code is None else f"part code {module.code}"
        note = comment_of(
            "; ".join(part for part in (desc, module.why and f"{shown}: {module.why}".lstrip(": ")) if part)
        )
        keys = network_keys(card) if module.model == NETWORK and card is not None else ""
        entry = ModuleEntry(
            f"{module.slot}: {{module: {module.model or ''}{keys}}}", file, record, note=note,
            detail=comment_of("; ".join(part for part in (desc, shown) if part)),
            slot=module.slot, model=module.model or "",
            fixed=module.slot in range(MAX_SLOT + 1) and (module.model in PROCESSORS or is_memory(module)),
            takes_tasks=module.model in PROCESSORS or module.model in UDC.models,
        )  # fmt: skip
        if module.model in _TIMED and card is not None:
            entry.keys = tick_keys(card, self._findings)
        entry.tasks = [self._task_entries.entry(task, module, self._declared) for task in tasks]
        entry.comments = list(self._drives(module))
        if module.model not in SUPPORTED:
            entry.lessen(why_not(module))
            if module.model is not None:
                self._unplaced.add(file, f"the emulator has no {module.model}", record)
        return entry

    def _drives(self, module: OldModule) -> Iterator[str]:
        """Yield what is known of a UDC's drives: codes whose meaning is not known, and parameters as they stand."""
        if module.model not in UDC.models:
            return
        if module.card is not None:
            for drive, key in zip(DRIVES, ("note1", "note2"), strict=True):
                code = module.card.whole(key)
                if code:
                    yield f"drive {drive} is of type {code} (WIRE_{key.upper()}): the table of types is not known"
        for record in self._old.of("PARAM"):
            if record.whole("slot") == module.slot:
                yield comment_of(f"{record.place}: {values_of(record)}")
                reason = "parameters of a UDC's drives have no place in a rack file"
                self._unplaced.add(record.file, reason, record.number)

    def _elsewhere(self) -> Iterator[str]:
        """Yield remote racks, modules in them, and tasks and parameters of slots that have no module."""
        for name, what in (("IORACK", "remote rack"), ("CARD", "module on remote I/O")):
            for record in self._old.of(name):
                if name == "IORACK" or record.whole("drop"):
                    yield comment_of(f"{record.place}: {what}: {values_of(record)}")
                    self._unplaced.add(record.file, f"a {what}: the emulator has no remote I/O", record.number)
        for record in self._old.of("CARD"):
            slot = record.whole("slot")
            module = self._modules.get(-1 if slot is None else slot)
            if not record.whole("drop") and (module is None or module.card is not record):
                yield comment_of(f"{record.place}: {values_of(record)}")
                reason = "a module without a slot, or in one that another record has, is lost"
                self._unplaced.add(record.file, reason, record.number, lost=True)
        for task in self._tasks:
            if task.slot is None or task.slot not in self._modules:
                yield comment_of(f"{task.record.place}: task {task.name}.{task.kind} has no slot")
                self._unplaced.add(task.record.file, "a task without a slot is lost", task.record.number, lost=True)
        for record in self._old.of("PARAM"):
            if record.whole("slot") not in self._udcs:
                yield comment_of(f"{record.place}: {values_of(record)}")
                self._unplaced.add(record.file, "parameters of a slot without a UDC", record.number)

    # What is told

    def _tell_choices(self) -> None:
        """Tell choices that fit nothing: a slip of the pen should not pass silently."""
        lost = "CARD" in self._old.unread or self._findings.lost_of("$CARD.DBF")
        codes = {card.whole("part") for card in self._old.of("CARD")}
        for code in self._choices.parts:
            if code not in codes and not lost:
                self._findings.add("AMX6794", f"--part {code}: no module has this code", "$CARD.DBF")
        for slot, model in self._choices.modules.items():
            if self._modules[slot].card is None:
                message = f"--module {slot}={model}: no record has slot {slot}; the module is added"
                self._findings.add("AMX6794", message, "$CARD.DBF")
        on_udc = {task.name for task in self._tasks if task.slot in self._udcs}
        for name in self._choices.drives:
            if name not in on_udc:
                there = any(task.name == name for task in self._tasks)
                what = "it is not a task of a UDC" if there else "there is no such task"
                self._findings.add("AMX6794", f"--drive {quoted(name)}: {what}", "$TASKS.DBF")

    def _tail(self, sources: Mapping[str, bytes]) -> Iterator[str]:
        used: set[str] = set()
        for task in self._tasks:
            if task.kind != "PC":
                used.add(task.file)
            elif stub_file(task.name) in sources:
                used.update(ladder_files(task.name))
        left = files_not_read(self._old.place.rack, used)
        if left:
            yield "Files of the old rack that were not used:"
            yield from (comment_of(f"  {printable(name)}: {what}") for name, what in left)
            message = f"{count_of(len(left), 'file')} of the rack are not used: the end of the rack file lists them"
            self._findings.add("AMX6795", message, self._old.place.name)
