"""The rack of a recording, built from the YAML file and the sources that are stored inside.

Stored files are untrusted: sizes and numbers are bounded, no name in them becomes a path, no file is accessed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.core.diagnostics import Diagnostic, SourceText, has_errors
from automax_ros.core.text import did_you_mean
from automax_ros.language.checks.checker import CheckResult
from automax_ros.language.program import CommonSpec, Program, lines_that_write
from automax_ros.messages.types.messages import VariableTable
from automax_ros.messages.types.rack_files import RACK_FILE, RackFile
from automax_ros.rackfile.checks.tasks import check_source, commons_of
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.module import MAX_TASKS, ModuleConfig
from automax_ros.rackfile.modules.processor import MAX_PROCESSORS
from automax_ros.rackfile.modules.udc import DRIVES, MAX_UDCS
from automax_ros.rackfile.reading.files import MAX_BYTES
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import sent_files

_SOURCE = re.compile(r"([A-Z][A-Z0-9_]{0,7})\.(?:BLK|BAS)")
_MOST_SOURCES = MAX_PROCESSORS * MAX_TASKS + MAX_UDCS * len(DRIVES)
MOST_RELOADS = 100
"""Most further sources of reloaded tasks that are read from a recording (decision: a bound on its compilation)."""


class SourceRefused(Exception):
    """A rack file or a source has errors; ``findings`` are the diagnostics with the texts that they refer to."""

    def __init__(self, findings: Sequence[tuple[SourceText, list[Diagnostic]]]) -> None:
        super().__init__(", ".join(source.name for source, _ in findings))
        self.findings = list(findings)


@dataclass(frozen=True)
class ReplaySource:
    """The source of a replayed task.

    ``compiled`` runs in the replay; ``recorded`` is the task that ran when the recording was made, None if that is
    unknown; ``edited``: ``compiled`` replaces it. ``versions`` are all sources that ran, by hash: a task may have
    been reloaded. An edited source runs in place of each of them (decision). ``keeps_locals``: locals are kept over
    STOP ALL.
    """

    name: str
    source: SourceText
    compiled: CompiledTask
    recorded: CompiledTask | None
    edited: bool
    warnings: tuple[Diagnostic, ...] = ()
    versions: Mapping[str, CompiledTask] = field(default_factory=dict)
    keeps_locals: bool = True

    def reloaded(self, source_hash: str) -> ReplaySource | None:
        """Return the source to execute after a reload with a source of this hash, None if it is not stored inside."""
        recorded = self.versions.get(source_hash)
        if recorded is None:
            return None
        return replace(self, recorded=recorded, compiled=self.compiled if self.edited else recorded)

    def edit_notes(self) -> list[str]:
        """Return notes for the user about the edit."""
        if not self.edited:
            return []
        if self.recorded is None:
            return ["what it ran with when it was recorded cannot be compiled here; states are taken over by name"]
        before, after = self.recorded.program.period_ns, self.compiled.program.period_ns
        if before == after or not before or not after:
            return []
        periods = f"its scan period was {before / 1e6:g} ms and is {after / 1e6:g} ms now"
        return [f"{periods}; it is executed at the recorded scans nevertheless"]

    @property
    def written_at(self) -> Mapping[str, tuple[int, ...]]:
        """The BASIC lines that can write each common."""
        return lines_that_write(self.compiled.program)


@dataclass(frozen=True)
class StoredRack:
    """The rack file and sources in a recording; ``sources`` are those that ran when it began, ``later`` the others."""

    bag: Path
    config: RackConfig
    sources: Mapping[str, SourceText]
    later: Mapping[str, tuple[SourceText, ...]] = field(default_factory=dict)

    @property
    def task_names(self) -> list[str]:
        """All tasks of the rack, in the order of its file."""
        return [task.name for _, task in self.config.placed_tasks]

    def require_tasks(self, names: Iterable[str]) -> None:
        """Check that the rack has these tasks.

        Raises:
            BagError: it lacks one.
        """
        known = self.task_names
        for name in names:
            if name not in known:
                hint = did_you_mean(name, known) or f"it has {', '.join(known[:8])}"
                raise BagError("AMX6827", self.bag, f"has no task {name[:40]!r}", hint)

    def replay_sources(self, names: Sequence[str], new: Mapping[str, SourceText]) -> list[ReplaySource]:
        """Check and compile tasks: the stored source, or the one in ``new``.

        Raises:
            BagError: a task is not in the recording, or its source.
            SourceRefused: a source has errors.
        """
        self.require_tasks([*names, *new])
        modules = {task.name: module for module, task in self.config.placed_tasks}
        views = {variable.name: view for view, variable in enumerate(self.config.variables)}
        made: list[ReplaySource] = []
        refused: list[tuple[SourceText, list[Diagnostic]]] = []
        for name in names:
            stored = self.sources.get(name)
            source = new.get(name, stored)
            if source is None:
                hint = f"give it with --task {name}=FILE, or leave the task out with --only"
                raise BagError("AMX6830", self.bag, f"lacks the source of task {name}", hint)
            result = self._check(source, modules[name], name)
            if result.program is None or has_errors(result.diagnostics):
                refused.append((source, result.diagnostics))
                continue
            compiled = compile_program(result.program, views)
            # A given source runs in place of all that ran, even if it equals the one before a reload.
            edited = stored is None or name in new
            recorded: CompiledTask | None = compiled
            if edited:
                before = self._check(stored, modules[name], name).program if stored else None
                recorded = compile_program(before, views) if before else None
            later = [self._check(text, modules[name], name).program for text in self.later.get(name, ())]
            ran = [*([recorded] if recorded else ()), *(compile_program(item, views) for item in later if item)]
            versions = {item.program.source_hash: item for item in ran}
            made.append(
                ReplaySource(
                    name,
                    source,
                    compiled,
                    recorded,
                    edited,
                    tuple(result.diagnostics),
                    versions,
                    keeps_locals=modules[name].keeps_locals,
                )
            )
        if refused:
            raise SourceRefused(refused)
        return made

    @cached_property
    def _commons(self) -> Mapping[str, CommonSpec]:
        return commons_of(self.config)

    def _check(self, source: SourceText, module: ModuleConfig, name: str) -> CheckResult:
        return check_source(source, name, module.tick_ns, self._commons, module.times)

    def programs(self) -> list[Program]:
        """Return the tasks of the rack as they ran when the recording began, those without errors."""
        modules = {task.name: module for module, task in self.config.placed_tasks}
        checked = (self._check(source, modules[name], name) for name, source in self.sources.items() if name in modules)
        return [result.program for result in checked if result.program is not None]

    def check_table(self, table: VariableTable) -> None:
        """Check that the recording numbers its variables as its own rack file does.

        Raises:
            BagError: it does not.
        """
        expected = [
            (number, item.name, item.type.number, item.dimensions, item.length)
            for number, item in enumerate(self.config.variables)
        ]
        recorded = [(item.id, item.name, item.type, tuple(item.dimensions), item.length) for item in table.variables]
        if recorded != expected:
            raise BagError("AMX6831", self.bag, "its table of variables is not that of the rack.yaml stored in it")


def stored_rack(reader: BagReader) -> StoredRack:
    """Read the rack stored in a recording: as attachments, of which each file has all, or as the rack's own message.

    Raises:
        BagError: there is no rack file inside, or it is too large, or the recording cannot be read.
        SourceRefused: the rack file has errors.
    """
    bag = reader.path
    stored = _StoredFiles(bag)
    for record in reader.attachments():
        stored.keep(record.name, record.data)
    if not stored.rack_file:
        for file in sent_files(reader):
            stored.keep(file.name, file.data)
    if not stored.rack_file:
        hint = (
            "`automax run --record` and `automax record` store rack file and sources; for `ros2 bag record` name the "
            "topic /<rack>/config too"
        )
        raise BagError("AMX6830", bag, "has no rack.yaml inside, so its tasks cannot be executed again", hint)
    return stored.rack()


def rack_of_files(place: Path, files: Iterable[RackFile]) -> StoredRack:
    """Return the rack of files that a running rack has sent; ``place`` is its name in messages.

    Raises:
        SourceRefused: the rack file has errors, or is not among them.
    """
    stored = _StoredFiles(place)
    for file in files:
        stored.keep(file.name, file.data)
    return stored.rack()


def unknown_value(bag: Path, source: ReplaySource, variable: CommonVariable, when: str) -> BagError:
    """Return the error for a variable that a task reads and whose value is not in the recording before a time."""
    symbol = source.compiled.program.symbols.get(variable.name)
    place = f"{source.source.name}:{symbol.span.line}" if symbol else source.source.name
    return BagError(
        "AMX6833",
        bag,
        f"does not contain {variable.name} before {when} s; task {source.name} reads it ({place})",
        "record with `automax`, or with the topics /<rack>/backplane and /<rack>/backplane/snapshot",
    )


class _StoredFiles:
    """Collects the rack file of a recording, empty at first, and the sources of its tasks, each text once."""

    def __init__(self, bag: Path) -> None:
        self.rack_file = ""
        self.sources: dict[str, list[SourceText]] = {}
        self._bag, self._count = bag, 0

    def keep(self, name: str, data: bytes) -> None:
        """Keep the first rack file, or a task's source; a further one of a name ran after a reload."""
        match = _SOURCE.fullmatch(name)
        if match is None and (name != RACK_FILE or self.rack_file):
            return
        if len(data) > MAX_BYTES:
            raise BagError("AMX6814", self._bag, f"{name} inside has more than {MAX_BYTES} bytes")
        text = data.decode("utf-8", "replace")
        if match is None:
            self.rack_file = text
            return
        source = SourceText(f"{self._bag.name}:{name}", text)
        known = self.sources.setdefault(match[1], [])
        if source not in known and self._count < _MOST_SOURCES + MOST_RELOADS:
            self._count += 1
            known.append(source)

    def rack(self) -> StoredRack:
        """Return the rack of the kept files."""
        source = SourceText(f"{self._bag.name}:{RACK_FILE}", self.rack_file)
        result = load_stored(source, Path(RACK_FILE))
        if result.config is None:
            raise SourceRefused([(source, result.diagnostics)])
        first = {name: texts[0] for name, texts in self.sources.items()}
        later = {name: tuple(texts[1:]) for name, texts in self.sources.items()}
        return StoredRack(self._bag, result.config, first, later)
