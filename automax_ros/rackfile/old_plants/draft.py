"""Drafts a rack file for a folder of tasks, when only the sources of a plant exist.

Every COMMON that a task declares becomes a common variable of the rack. The tasks share the Processors evenly; the one
that scans most often is served first (decision).

A task belongs to a UDC if it calls a block that runs only there (table 5), or if the user says so. Two tasks of equal
TICKS share a UDC. A task does not give the places of its commons in the dual port: they get application registers in
turn (decision), which the plant's drawings replace.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.base.cost import Model
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.ticks import NS_PER_MS, UDC_TICK_NS
from automax_ros.core.types import DEFAULT_STRING_LENGTH, TASK_NAME_LIMIT, DataType, declaration_text
from automax_ros.core.user_error import UserError
from automax_ros.core.yaml_text import flow_text
from automax_ros.language.checks.checker import CheckResult
from automax_ros.language.parse.parser import parse
from automax_ros.language.program import CommonSpec, Program, places_that_write
from automax_ros.language.tree.task_kind import TaskKind, is_task_file, kind_of_source
from automax_ros.language.tree.tree import Call, Declaration, Declared, Module, Scope
from automax_ros.language.tree.walk import statements_in_order
from automax_ros.rackfile.checks.tasks import check_source
from automax_ros.rackfile.model.config import DEFAULT_OUT_LIMIT, MAX_SLOT, CommonVariable
from automax_ros.rackfile.model.module import MAX_PRIORITY, MAX_TASKS, MIN_PRIORITY
from automax_ros.rackfile.modules.common_memory import COMMON_REGISTERS
from automax_ros.rackfile.modules.processor import MAX_PROCESSORS
from automax_ros.rackfile.modules.udc import DRIVES, EVERY_SCAN, UDC
from automax_ros.rackfile.reading.files import MAX_BYTES, FileFault, is_inside, read_task_source
from automax_ros.rackfile.reading.names import DeclarationFault, variable_name

_BITS = 16
_PAIR_BITS = 2 * _BITS
"""A UDC writes booleans in pairs of registers: those that it writes and those that it reads are in different pairs."""
_MODEL = next(iter(UDC.models))


_PROCESSOR = "57C435"
_MOST_FILES = 10_000
"""Most entries of a folder that are read (decision: a bound on untrusted folders)."""
_MOST_NAMED = 4
"""Most tasks that are named next to a common that they share."""
_RACK_NAME_LIMIT = 8
_COMMENT_COLUMN = 36
_UNKNOWN_NS = 1 << 62
"""Scan period of a task with errors."""


def is_udc_task(module: Module) -> bool:
    """Return whether a task calls a block that no Processor has."""
    calls = (item.block for item, _ in statements_in_order(module.statements) if isinstance(item, Call))
    blocks = (CATALOGUE[name] for name in calls if name in CATALOGUE)
    return any(Platform.UDC in block.runs_on and Platform.AUTOMAX not in block.runs_on for block in blocks)


@dataclass(frozen=True)
class DraftedUdc:
    """A drafted UDC module: its slot and its tasks, that of drive A first."""

    slot: int
    tasks: tuple[str, ...]


def drafted_udcs(names: Sequence[str], programs: Mapping[str, Program | None], free: Iterator[int]) -> list[DraftedUdc]:
    """Return the modules of UDC tasks, in slots of ``free``."""
    by_ticks: dict[int, list[str]] = {}
    for name in names:
        program = programs[name]
        by_ticks.setdefault(0 if program is None else program.ticks, []).append(name)
    pairs = [own[at : at + 2] for own in by_ticks.values() for at in range(0, len(own), 2)]
    return [DraftedUdc(slot, tuple(pair)) for pair, slot in zip(pairs, free, strict=False)]


def dual_port_places(
    udc: DraftedUdc, programs: Mapping[str, Program | None], commons: Mapping[str, CommonSpec]
) -> dict[str, str]:
    """Return the places of a module's commons, as the rack file writes them, as many as there is room for.

    Arrays and strings get none: `automax check` reports them.
    """
    own = [program for name in udc.tasks if (program := programs[name]) is not None]
    used = [spec for name, spec in commons.items() if any(name in program.symbols for program in own)]
    written = {name for program in own for name in places_that_write(program)}
    places: dict[str, str] = {}
    bit = EVERY_SCAN.start * _BITS
    for group in _groups([spec for spec in used if not spec.dimensions], written):
        bit = -(-bit // _PAIR_BITS) * _PAIR_BITS
        for spec in group:
            size = {DataType.BOOLEAN: 1, DataType.INTEGER: _BITS}.get(spec.type, _PAIR_BITS)
            if bit + size > EVERY_SCAN.stop * _BITS:
                return places
            place = f"slot: {udc.slot}, register: {bit // _BITS}"
            places[spec.name] = place + (f", bit: {bit % _BITS}" if size == 1 else "")
            bit += size
    return places


def _groups(simple: Sequence[CommonSpec], written: set[str]) -> Iterator[list[CommonSpec]]:
    """Yield the groups of commons: booleans that the UDC writes, other booleans, numbers of two registers, of one."""
    flags = [spec for spec in simple if spec.type is DataType.BOOLEAN]
    yield [spec for spec in flags if spec.name in written]
    yield [spec for spec in flags if spec.name not in written]
    yield [spec for spec in simple if spec.type in (DataType.DOUBLE, DataType.REAL)]
    yield [spec for spec in simple if spec.type is DataType.INTEGER]


class DraftFault(UserError):
    """No rack file can be made of a folder."""


@dataclass(frozen=True)
class DraftedTask:
    """A task of the drafted rack: its ``file`` as in the rack file, its text, and whether only a UDC runs it."""

    name: str
    file: str
    source: SourceText
    on_udc: bool = False


@dataclass
class Draft:
    """A drafted rack. ``left_out`` are the names of files that cannot be tasks, each with the reason.

    ``commons`` are by full name, each with the place of its first declaration; ``users`` the tasks that declare it.
    ``results`` are those of the tasks' checks against these commons, by the tasks' names.
    """

    name: str
    tick_ns: int
    tasks: list[DraftedTask] = field(default_factory=list)
    left_out: list[tuple[str, str]] = field(default_factory=list)
    commons: dict[str, CommonSpec] = field(default_factory=dict)
    users: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    results: dict[str, CheckResult] = field(default_factory=dict)

    def text(self, processors: int) -> str:
        """Return the rack file with 1 to 4 Processors.

        Raises:
            DraftFault: more tasks than these Processors run, or more text than a rack file may have.
        """
        count = sum(not task.on_udc for task in self.tasks)
        if count > processors * MAX_TASKS:
            message = f"{count} tasks are more than the {processors * MAX_TASKS} of {processors} Processors"
            needed = -(-count // MAX_TASKS)
            raise DraftFault(message, f"--processors {needed}" if needed <= MAX_PROCESSORS else "make several racks")
        udcs = self._udcs(processors)
        lines = [
            "# Made from the tasks of this folder; docs/rack_yaml.md has every key. `ros: in` lets ROS 2 write a",
            "# common, `preset:` gives it a value at the start, `unit:` and `description:` say what it is.",
            f"rack: {self.name}",
            "slots:",
            commented(f"  0: {{module: {self._memory_module()}}}", "common memory"),
            *self._processor_lines(processors),
            *self._drive_lines(processors),
            *self._udc_lines(udcs),
            "common:" if self.commons else "common: {}",
            *self._common_lines(udcs),
        ]
        text = "\n".join(lines) + "\n"
        if len(text.encode()) > MAX_BYTES:
            raise DraftFault(f"the rack file would have more than {MAX_BYTES} bytes", "make several racks")
        return text

    def _processor_lines(self, processors: int) -> Iterator[str]:
        tasks = [task for task in self.tasks if not task.on_udc]
        programs = [(task.name, self.results[task.name].program) for task in tasks]
        periods = {
            name: program.period_ns if program is not None and not program.is_basic else _UNKNOWN_NS
            for name, program in programs
        }
        ranks = sorted(set(periods.values()))
        share = -(-len(tasks) // processors)
        for number in range(processors):
            own = tasks[number * share : (number + 1) * share]
            yield f"  {number + 1}:"
            yield f"    module: {_PROCESSOR}"
            yield f"    tick_ms: {self.tick_ns / NS_PER_MS:g}"
            yield "    tasks:" if own else "    tasks: {}"
            for task in own:
                priority = min(MIN_PRIORITY + ranks.index(periods[task.name]), MAX_PRIORITY)
                period = periods[task.name]
                comment = f"a scan every {period / NS_PER_MS:g} ms"
                if period >= _UNKNOWN_NS:
                    is_basic = kind_of_source(task.file) is TaskKind.BASIC
                    comment = "a BASIC task" if is_basic else "see `automax check`"
                yield commented(f"      {task.name}: {{{_file_key(task)}priority: {priority}}}", comment)

    @property
    def _programs(self) -> dict[str, Program | None]:
        return {name: result.program for name, result in self.results.items()}

    def _udcs(self, processors: int) -> list[DraftedUdc]:
        drives = {slot for program in self._programs.values() for slot, _ in _drive_modules(program)}
        free = (slot for slot in range(processors + 1, MAX_SLOT + 1) if slot not in drives)
        names = [task.name for task in self.tasks if task.on_udc]
        udcs = drafted_udcs(names, self._programs, free)
        if sum(len(udc.tasks) for udc in udcs) < len(names):
            raise DraftFault(f"{len(names)} tasks of UDCs find no slot", "make several racks")
        return udcs

    def _drive_lines(self, processors: int) -> Iterator[str]:
        """Yield the modules whose slots the tasks of drives name, in the order of slots.

        If two modules want one slot the first gets it, and a comment names the other (decision).
        """
        taken = dict.fromkeys(range(processors + 1), "")
        lines: dict[int, list[str]] = {}
        for task in self.tasks:
            for slot, model in _drive_modules(self.results[task.name].program):
                if taken.setdefault(slot, model) == model:
                    line = commented(f"  {slot}: {{module: {model}}}", f"of the drive of {task.name}")
                    lines.setdefault(slot, [line])
                else:
                    lines.setdefault(slot, []).append(f"  # {task.name} wants a {model} in slot {slot}: choose another")
        if lines:
            yield "  # A drive turns a motor where its 57C406 has a plant: docs/rack_yaml.md."
        for slot in sorted(lines):
            yield from lines[slot]

    def _udc_lines(self, udcs: Sequence[DraftedUdc]) -> Iterator[str]:
        files = {task.name: _file_key(task) for task in self.tasks}
        for udc in udcs:
            yield from (f"  {udc.slot}:", f"    module: {_MODEL}", "    tasks:")
            for name, drive in zip(udc.tasks, DRIVES, strict=False):
                yield f"      {name}: {{{files[name]}drive: {drive}}}"

    def _common_lines(self, udcs: Sequence[DraftedUdc]) -> Iterator[str]:
        simple = 0
        places: dict[str, str] = {}
        for udc in udcs:
            places = {**dual_port_places(udc, self._programs, self.commons), **places}
        for spec in self.commons.values():
            simple += not spec.dimensions
            options = [places[spec.name]] if spec.name in places else []
            options += ["ros: closed"] if not spec.dimensions and simple > DEFAULT_OUT_LIMIT else []
            users = self.users[spec.name]
            more = ", ..." if len(users) > _MOST_NAMED else ""
            text = declaration_text(spec.name, spec.dimensions, spec.length)
            yield commented(f"  {text}: {{{', '.join(options)}}}", ", ".join(users[:_MOST_NAMED]) + more)

    def _memory_module(self) -> str:
        needed = sum(
            CommonVariable(spec.name, spec.type, spec.dimensions, spec.length).registers
            for spec in self.commons.values()
        )
        fitting = (model for model, size in sorted(COMMON_REGISTERS.items()) if needed <= size)
        return next(fitting, max(COMMON_REGISTERS))


def _drive_modules(program: Program | None) -> list[tuple[int, str]]:
    if program is None or program.cml is None:
        return []
    facts = program.cml.facts
    return [(int(facts[item.variable]), item.module) for item in program.cml.block.inputs if item.module]


def _file_key(task: DraftedTask) -> str:
    return "" if task.file == f"{task.name}.BLK" else f"file: {flow_text(task.file)}, "


def draft(folder: Path, rack_folder: Path, tick_ns: int, udc: frozenset[str] = frozenset()) -> Draft:
    """Collect the tasks and commons of a folder for a rack file in ``rack_folder``, which is the folder or above it.

    A file that cannot be a task is left out, a task with errors is used as far as it can be read. ``udc`` names tasks
    that run on a UDC although no block of theirs says so.

    Raises:
        DraftFault: the folder cannot be read, holds no task, or is not below ``rack_folder``, or ``udc`` names a task
            that is not there or that no UDC runs.
    """
    try:
        inner = folder.resolve().relative_to(rack_folder.resolve())
    except (OSError, ValueError, RuntimeError):
        message = f"{rack_folder} is not the folder of the tasks, nor above it"
        raise DraftFault(message, f"put the rack file into {folder}") from None
    found = Draft(rack_name(folder.resolve().name), tick_ns)
    for path in _sources(folder):
        _take(found, path, folder, inner, udc)
    if not found.tasks:
        reasons = "".join(f"; {quoted(name)} {reason}" for name, reason in found.left_out[:3])
        raise DraftFault(f"{folder} holds no task (.BLK, .BAS){reasons}")
    for name in sorted(udc.difference(_names(found))):
        raise DraftFault(f"{folder} holds no task {quoted(name)} for a UDC", did_you_mean(name, _names(found)))
    for task in found.tasks:
        if task.name in udc and not task.on_udc:
            message = f"{task.file} is a BASIC task; a UDC runs control-block tasks (.BLK) only"
            raise DraftFault(message, f"leave out --udc {task.name}: a Processor runs it")
    for task in found.tasks:
        tick, model = (UDC_TICK_NS, Model.UDC) if task.on_udc else (tick_ns, Model.NONE)
        found.results[task.name] = check_source(task.source, task.name, tick, found.commons, model)
    return found


def _sources(folder: Path) -> list[Path]:
    try:
        entries = list(islice(folder.iterdir(), _MOST_FILES + 1))
    except (OSError, ValueError) as error:
        raise DraftFault(f"{folder} cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if len(entries) > _MOST_FILES:
        raise DraftFault(f"{folder} holds more than {_MOST_FILES} files", "put the tasks into a separate folder")
    return sorted(path for path in entries if is_task_file(path))


def _names(found: Draft) -> list[str]:
    return [task.name for task in found.tasks]


def _take(found: Draft, path: Path, folder: Path, inner: Path, udc: frozenset[str]) -> None:
    if not path.name.isprintable():
        found.left_out.append((path.name, "has a name that no rack file can hold: rename it"))
        return
    if not is_inside(path, folder):
        found.left_out.append((path.name, "is a link out of the folder"))
        return
    try:
        source = read_task_source(path)
    except FileFault as fault:
        found.left_out.append((path.name, str(fault)))
        return
    module, _ = parse(source)
    name = _task_name(path.stem, {task.name for task in found.tasks})
    runs_on_udc = kind_of_source(path.name) is TaskKind.CONTROL_BLOCK and (is_udc_task(module) or name in udc)
    task = DraftedTask(name, str(inner / path.name), source, runs_on_udc)
    found.tasks.append(task)
    for statement, *_ in statements_in_order(module.statements):
        if isinstance(statement, Declaration) and statement.scope is Scope.COMMON:
            for declared in statement.variables:
                _add_common(found, task, declared)


def _add_common(found: Draft, task: DraftedTask, declared: Declared) -> None:
    spec = CommonSpec(
        name=declared.name,
        type=declared.type,
        place=f"{task.source.name}:{declared.span.line}:{declared.span.column}",
        dimensions=tuple(subscript + 1 for subscript in declared.subscripts),
        length=(declared.length or DEFAULT_STRING_LENGTH) if declared.type is DataType.STRING else 0,
    )
    try:
        variable_name(declaration_text(spec.name, spec.dimensions, spec.length))
    except DeclarationFault:  # the check of the task reports it
        return
    known = found.commons.setdefault(spec.name, spec)
    if task.name not in found.users[known.name]:
        found.users[known.name].append(task.name)


def _task_name(stem: str, taken: set[str]) -> str:
    plain = re.sub(r"[^A-Z0-9_]", "_", stem.upper())
    plain = plain if plain[:1].isalpha() else f"T{plain}"
    name, number = plain[:TASK_NAME_LIMIT], 1
    while name in taken:
        number += 1
        name = f"{plain[: TASK_NAME_LIMIT - len(str(number))]}{number}"
    return name


def rack_name(title: str) -> str:
    """Return a rack's name made from the valid characters of a title."""
    plain = re.sub(r"[^A-Z0-9]", "", title.upper())
    return plain[:_RACK_NAME_LIMIT] or "RACK1"


def commented(line: str, comment: str) -> str:
    """Return a line of a rack file with a comment."""
    return f"{line:<{_COMMENT_COLUMN}} # {comment}"
