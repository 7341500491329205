"""The sources of an old rack's tasks: made acceptable, and asked what they say of variables and modules."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import DEFAULT_TICK_NS, UDC_TICK_NS
from automax_ros.core.types import bare_name
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.parse.parser import parse
from automax_ros.language.program import places_that_write
from automax_ros.language.tree.task_kind import TASK_SUFFIXES
from automax_ros.language.tree.tree import Declaration, Declared, Scope
from automax_ros.language.tree.walk import statements_in_order
from automax_ros.rackfile.old_plants.draft import is_udc_task
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import DiskFolder
from automax_ros.rackfile.old_plants.includes import INCLUDE_SUFFIX, include_reader
from automax_ros.rackfile.old_plants.sources import Converted, convert
from automax_ros.rackfile.reading.files import FileFault, read_bytes

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f]")
_MOST_CONTROL = 0.05
"""The most of a text that may be control characters (decision: printers of the time had some in remarks)."""


@dataclass(frozen=True)
class TaskSource:
    """A task's source, converted: ``file`` is its name in the new rack, ``declared`` are its commons in their order.

    ``written`` are the commons that it can write, empty where it has errors; ``on_udc``: it calls a block that only a
    UDC has.
    """

    name: str
    file: str
    converted: Converted
    declared: tuple[Declared, ...] = ()
    written: frozenset[str] = frozenset()
    on_udc: bool = False


@dataclass(frozen=True)
class Declarations:
    """What the tasks' COMMON statements say, by the variable's name without its type character."""

    by_bare: Mapping[str, tuple[tuple[Declared, str], ...]] = field(default_factory=dict)

    def one(self, bare: str) -> tuple[Declared, str] | None:
        """Return the declaration of a name with its task, None if there is none or they have several types."""
        found = self.by_bare.get(bare, ())
        return found[0] if len({declared.name for declared, _ in found}) == 1 else None


def declarations_of(sources: Iterable[TaskSource]) -> Declarations:
    """Return the declarations of all tasks."""
    found: dict[str, list[tuple[Declared, str]]] = {}
    for source in sources:
        for declared in source.declared:
            found.setdefault(bare_name(declared.name), []).append((declared, source.file))
    return Declarations({name: tuple(items) for name, items in found.items()})


def read_source(
    folder: DiskFolder, name: str, kind: str, on_udc: bool, code_page: str, findings: Findings
) -> TaskSource:
    """Return a task's source of a kind BLK or BAS; what is not Unicode is read by ``code_page``.

    Raises:
        FileFault: it is not there, cannot be read, is empty, or is not text.
    """
    file = f"{name}.{kind}"
    path = folder.files.get(file)
    if path is None:
        raise FileFault("is not in the folder")
    target, tick = (Platform.UDC, UDC_TICK_NS) if on_udc else (Platform.AUTOMAX, DEFAULT_TICK_NS)

    def result_of(text: str) -> CheckResult:
        return check(SourceText(file, text), name=name, catalogue=CATALOGUE, target=target, tick_ns=tick)

    converted = convert(
        read_bytes(path),
        lambda text: result_of(text).diagnostics,
        include_reader(folder.files, code_page),
        code_page,
    )
    if not converted.before.strip(" \n\t\0"):
        raise FileFault("is empty")
    if len(_CONTROL.findall(converted.before)) > len(converted.before) * _MOST_CONTROL:
        raise FileFault("is not text")
    for reason in converted.refused:
        findings.add("AMX6795", reason, file)
    module, _ = parse(SourceText(file, converted.after))
    declared = [
        item
        for statement, *_ in statements_in_order(module.statements)
        if isinstance(statement, Declaration) and statement.scope is Scope.COMMON
        for item in statement.variables
    ]
    program = result_of(converted.after).program
    written = frozenset(places_that_write(program)) if program is not None else frozenset()
    return TaskSource(name, file, converted, tuple(declared), written, is_udc_task(module))


_IS_SOURCE = (*TASK_SUFFIXES, INCLUDE_SUFFIX)
_WHAT_THEY_ARE = {
    ".OBJ": "a compiled task",
    ".POB": "compiled parameters of a UDC's drives",
    ".XRF": "a cross reference",
    ".NET": "where variables of networks lie, of version 2",
    ".LOG": "a log of the compiler",
    ".LST": "a list",
    ".CNF": "a configuration task, of version 2.1 or before",
    ".PC": "a ladder task",
    ".NDX": "an index of a table",
    ".SDC": "a document",
    ".CDC": "a document",
    ".RDC": "a document",
    ".TDC": "a document",
    ".IDC": "a document",
    ".BAK": "a copy of an editor",
}
_NOT_TOLD = (".NDX", ".DBF")


def files_not_read(folder: DiskFolder, used: Iterable[str]) -> list[tuple[str, str]]:
    """Return the files of a rack that the import does not use, each with what it is."""
    taken = set(used)
    found: list[tuple[str, str]] = []
    for name in folder.files:
        suffix = f".{name.rpartition('.')[2]}" if "." in name else ""
        if name in taken or suffix in _NOT_TOLD:
            continue
        what = "a source before its last edit" if suffix.startswith(".~") else _WHAT_THEY_ARE.get(suffix, "")
        if suffix in _IS_SOURCE:
            what = "a source that no record of $TASKS names"
        found.append((name, what or "of a kind that is not known"))
    return found
