"""Makes a rack file from a configuration task, as far as that one file describes the old rack."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, Span
from automax_ros.core.types import declaration_text
from automax_ros.rackfile.model.module import MAX_TASKS
from automax_ros.rackfile.modules.registry import KINDS
from automax_ros.rackfile.old_plants.configuration_task import Configuration, DefinedCommon, DefinedTask
from automax_ros.rackfile.old_plants.draft import commented, rack_name
from automax_ros.rackfile.old_plants.net_files import NetLines, net_lines, quoted_for

_PROCESSOR = "57C430A"
"""Replaces the 57C430 of a rack with a configuration task, which does not run this software (decision)."""
_EXECUTIVE = "2.1"
"""The last Executive that had configuration tasks (2.1)."""
_MEMORY = "57C413"
_NETWORK = "57C404"
"""The module of NETDEF."""
_IN_MEMORY = ("MEMDEF", "NVMEMDEF")
"""The statements whose variables are in common memory."""


@dataclass
class Imported:
    """A new rack file, and the remaining diagnostics of the configuration task: tasks that it cannot name yet."""

    text: str
    diagnostics: list[Diagnostic] = field(default_factory=list)


def rack_file_of(
    configuration: Configuration, title: str, folder: Path, modules: Mapping[int, str], suffixes: Sequence[str]
) -> Imported:
    """Return the rack file of a configuration task.

    ``title`` gives the rack's name; task sources lie in ``folder`` and end in one of ``suffixes``, such as ``.BLK``.
    ``modules`` are the modules in slots of I/O points. Points in other slots become plain commons, since their module
    is not known: a comment has their place, and the modules that have such registers (decision). Lines of .NET files in
    the folder that name a variable without a place are quoted next to it.
    """
    return _Importing(configuration, folder, modules, suffixes).result(title)


@dataclass
class _Importing:
    configuration: Configuration
    folder: Path
    modules: Mapping[int, str]
    suffixes: Sequence[str]
    diagnostics: list[Diagnostic] = field(default_factory=list)
    _net: NetLines = field(default_factory=NetLines)

    def result(self, title: str) -> Imported:
        self._net = net_lines(self.folder)
        lines = [
            "# Made from a configuration task; docs/rack_yaml.md has every key.",
            f"rack: {rack_name(title)}",
            commented(f"executive: {_EXECUTIVE}", "the last one with configuration tasks"),
            "slots:",
            *self._slots(),
            "common:" if self.configuration.commons else "common: {}",
            *map(self._common, self.configuration.commons),
            *(f"# {name} {reason}: not read" for name, reason in self._net.left_out),
        ]
        return Imported("\n".join(lines) + "\n", self.diagnostics)

    def _slots(self) -> Iterator[str]:
        slots = {task.slot for task in self.configuration.tasks}
        processors = sorted(slots - {0} or slots or {1})
        if processors != [0]:
            yield commented(f"  0: {{module: {_MEMORY}}}", "common memory")
        for slot in processors:
            yield f"  {slot}:"
            yield f"    module: {_PROCESSOR}"
            own = [task for task in self.configuration.tasks if task.slot == slot]
            shown = [line for number, task in enumerate(own) for line in self._task(task, number)]
            there = any(not line.lstrip().startswith("#") for line in shown)
            yield "    tasks:" if there else "    tasks: {}"
            yield from shown
        for task in self.configuration.tasks:
            if task.slot not in processors:
                yield from self._task(task, 0)
        yield from self._points(processors)

    def _task(self, task: DefinedTask, number: int) -> Iterator[str]:
        critical = ", critical: true" if task.critical else ""
        file = f"{task.name}.{task.type}"
        name = "" if task.type == "BLK" else f"file: {file}, "
        line = f"{task.name}: {{{name}priority: {task.priority}{critical}}}"
        reason = self._reason(task, file, number)
        if reason is None:
            yield f"      {line}"
            return
        yield commented(f"      # {line}", reason)
        self.diagnostics.append(Diagnostic("AMX6787", f"task {task.name} is left out: {reason}", Span(task.line, 1, 2)))

    def _reason(self, task: DefinedTask, file: str, number: int) -> str | None:
        if f".{task.type}" not in self.suffixes:
            return f"{file}: tasks of this kind are not run"
        if task.slot == 0 and any(other.slot for other in self.configuration.tasks):
            return "a Processor in slot 0 works alone, and other tasks run in other slots"
        if number >= MAX_TASKS:
            return f"a Processor runs at most {MAX_TASKS} tasks"
        return None if (self.folder / file).is_file() else f"{file} is not in the folder"

    def _points(self, processors: Sequence[int]) -> Iterator[str]:
        used: dict[int, int] = {}
        networks = sorted(self._networks)
        for number, slot in enumerate(networks):
            module = f"  {slot}: {{module: {_NETWORK}, network: NET{number or ''}, drop: 0}}"
            yield commented(module, "its drop and network stand nowhere: 0 is the master")
        for common in self.configuration.commons:
            if common.point is not None and common.point.slot not in self._networks:
                used[common.point.slot] = max(used.get(common.point.slot, 0), common.point.register)
        for slot in sorted({*used, *self.modules} - {*processors, *networks}):
            if slot in self.modules:
                yield f"  {slot}: {{module: {self.modules[slot]}}}"
            else:
                fitting = ", ".join(_with_registers(used[slot])) or "none that the emulator has"
                yield commented(f"  # {slot}: {{module: }}", f"generic, registers up to {used[slot]}: {fitting}")

    @property
    def _networks(self) -> set[int]:
        named = {slot for slot, model in self.modules.items() if model == _NETWORK}
        return named | {item.point.slot for item in self.configuration.commons if item.point and item.drop is not None}

    def _common(self, common: DefinedCommon) -> str:
        declared, point = common.declared, common.point
        text = declaration_text(declared.name, declared.dimensions, declared.length)
        if point is None:
            options = "{non_volatile: true}" if common.non_volatile else "{}"
            line = quoted_for(declared.name, self._net.lines) if common.keyword not in _IN_MEMORY else ""
            return commented(f"  {text}: {options}", f"{common.keyword}, line {common.line}{line}")
        place = f"slot: {point.slot}, " + ("" if common.drop is None else f"drop: {common.drop}, ")
        place += f"register: {point.register}"
        place += "" if point.bit is None else f", bit: {point.bit}"
        if point.slot in self.modules or point.slot in self._networks:
            return f"  {text}: {{{place}}}"
        return commented(f"  {text}: {{}}", place)


def _with_registers(highest: int) -> list[str]:
    return [
        number
        for kind in KINDS
        for number, registers in kind.table.items()
        if highest < registers.count and highest not in registers.reserved
    ]
