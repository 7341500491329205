"""Reads a rack's YAML file into its configuration and finds everything that is wrong with it."""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, SourceText, Span
from automax_ros.core.json_schema import Keys, Schema, document, flag, named, number, section, words
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.yaml_text import Node, read_yaml
from automax_ros.rackfile.model.config import CommonVariable, ModuleLoss, RackConfig, Timing, bank_variables
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.ros_names import namespace
from automax_ros.rackfile.reading.executive import NEWEST, OLDEST, executive_value
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.rackfile.reading.names import RACK_NAME, is_rack_name
from automax_ros.rackfile.reading.values import ProblemList, Section, boolean_value, entries_of, text_value
from automax_ros.rackfile.sections.commons import SCHEMA as COMMON_SCHEMA
from automax_ros.rackfile.sections.commons import CommonReader
from automax_ros.rackfile.sections.feeds import read_feeds
from automax_ros.rackfile.sections.joints import read_commands
from automax_ros.rackfile.sections.plants import SCHEMA as PLANTS_SCHEMA
from automax_ros.rackfile.sections.plants import Plants, read_plants
from automax_ros.rackfile.sections.tasks import TaskReader
from automax_ros.rackfile.sections.watch import SCHEMA as WATCH_SCHEMA
from automax_ros.rackfile.sections.watch import read_watch
from automax_ros.rackfile.slots import SCHEMA as SLOTS_SCHEMA
from automax_ros.rackfile.slots import SlotReader

_START = Span(1, 1, 2)
_NAME = re.compile(r"""^rack[ ]*:[ ]*(?:["']?)(\w{1,8})(?:["']?)[ ]*(?:#.*)?$""", re.MULTILINE)
_TIMINGS, _LOSSES = [timing.value for timing in Timing], [loss.value for loss in ModuleLoss]
KEYS: Keys = {
    "rack": named("The rack's name; in lower case its ROS 2 namespace.", RACK_NAME),
    "operator": flag("Whether the running rack has services that operate it.", False),
    "execution": words(
        "`ideal`: a scan takes no time; `modeled`: the time that the manual prints.",
        _TIMINGS,
        "ideal",
    ),
    "executive": number("Version of the AutoMax Programming Executive.", OLDEST / 10, NEWEST / 10, NEWEST / 10),
    "auto_run": flag("AUTO RUN: whether a power cycle ends with the tasks in RUN that ran before it.", False),
    "on_module_loss": words("What a rack of several processes does when it loses one.", _LOSSES, "stop_all"),
    "slots": SLOTS_SCHEMA,
    "plants": PLANTS_SCHEMA,
    "common": COMMON_SCHEMA,
    "watch": WATCH_SCHEMA,
}
"""What a rack file may say at its top."""
_REQUIRED = ("rack", "slots")


def schema() -> Schema:
    """Return the JSON schema of a rack file, for editors: what its form can be wrong in, not how its parts agree."""
    return document("AutoMax rack", section("A rack: its modules, tasks and common variables.", KEYS, _REQUIRED))


@dataclass(frozen=True)
class LoadResult:
    """What came of a rack file: ``config`` is None if there are errors. ``source`` is what the diagnostics refer to."""

    config: RackConfig | None
    diagnostics: list[Diagnostic]
    source: SourceText

    @property
    def namespace(self) -> str | None:
        """The rack's namespace, None where even its name cannot be made out.

        With errors elsewhere, in the YAML itself too, it is that of the first line ``rack: NAME`` (decision: so the
        rack has its place in the graph while the rest of the file is mended).
        """
        if self.config is not None:
            return self.config.namespace
        found = _NAME.search(self.source.text)
        name = found[1].upper() if found is not None else ""
        return namespace(name) if is_rack_name(name) else None


def load(path: str | Path, *, allow_outside: bool = False) -> LoadResult:
    """Read a rack file; whatever it holds becomes a configuration or diagnostics (AMX6000 to AMX6499), by place.

    Task sources must lie in the file's folder, symbolic links followed (also the file's own), unless ``allow_outside``.
    They are read to see that they can be, not compiled.
    """
    path = Path(path)
    findings = ProblemList()
    source = SourceText(str(path), _text_of(path, findings))
    return _loaded(source, TaskReader(path, allow_outside, findings), path, findings)


def load_stored(source: SourceText, path: Path) -> LoadResult:
    """Read a rack file whose text stands in a recording, with its sources under the names of their tasks.

    ``path`` is what the configuration calls the file. No file is touched.
    """
    findings = ProblemList()
    return _loaded(source, TaskReader(None, False, findings), path, findings)


def _loaded(source: SourceText, tasks: TaskReader, path: Path, findings: ProblemList) -> LoadResult:
    root = read_yaml(source.text, findings.yaml_flaw) if not findings.errors else None
    config = _RackReader(path, source.text, tasks, findings).read(root) if root is not None else None
    return LoadResult(config if not findings.errors else None, findings.in_order(), source)


def _text_of(path: Path, findings: ProblemList) -> str:
    try:
        data = read_bytes(path).removeprefix(codecs.BOM_UTF8)
    except FileFault as fault:
        code = "AMX6001" if fault.too_large else "AMX6000"
        findings.add(code, f"the rack file {fault}", _START)
        return ""
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        before = SourceText("", data[: error.start].decode()).lines
        column = len(before[-1]) + 1
        message = f"the rack file is not UTF-8: here is a byte {data[error.start]:#04x}"
        findings.add("AMX6002", message, Span(len(before), column, column + 1), "save the file as UTF-8")
        return data.decode(errors="replace")


class _RackReader:
    def __init__(self, path: Path, text: str, tasks: TaskReader, findings: ProblemList) -> None:
        self._path = path
        self._text = text
        self._findings = findings
        self._tasks = tasks

    def read(self, root: Node) -> RackConfig | None:
        entries = entries_of(root, "a rack file", self._findings)
        if entries is None:
            return None
        section = Section(entries, "a rack file", KEYS, self._findings)
        section.require(_REQUIRED, "the rack file", _START, self._findings)
        name = self._name(section.get("rack"))
        operator = self._flag(section, "operator")
        auto_run = self._flag(section, "auto_run")
        loss = self._module_loss(section.get("on_module_loss"))
        execution = self._execution(section.get("execution"))
        executive = self._executive(section.get("executive"))
        plants = read_plants(section.get("plants"), self._findings)
        modules, unread = self._modules(section, executive, plants)
        common = section.get("common")
        variables = CommonReader(modules, self._findings, unread).read(common) if common is not None else ()
        if common is not None:
            self._check_size(variables, modules, section.key_span("common"))
        feeds = read_feeds(plants.feeds, variables, modules, self._findings)
        commands = read_commands(plants.joints, variables, self._findings)
        everything = (*variables, *bank_variables(modules))
        watch = section.get("watch")
        shown = read_watch(watch, everything, self._findings) if watch is not None else None
        if name is None or self._findings.errors:
            return None
        return RackConfig(
            name=name,
            namespace=namespace(name),
            path=self._path,
            text=self._text,
            operator=operator,
            modules=modules,
            variables=everything,
            execution=execution,
            executive=executive,
            auto_run=auto_run,
            on_module_loss=loss,
            plants=tuple(plants.known.values()),
            feeds=feeds,
            joint_commands=commands,
            watch=shown,
        )

    def _name(self, node: Node | None) -> str | None:
        if node is None:
            return None
        text = text_value(node, "the rack's name", self._findings, limit=100)
        if text is None:
            return None
        name = self._findings.upper_case(text, node.span)
        if not is_rack_name(name):
            hint = "for example LINE1: no blank, hyphen or underscore"
            self._findings.add(
                "AMX6100", f"{quoted(text)}: a rack's name has 1 to 8 letters and digits", node.span, hint
            )
            return None
        return name

    def _flag(self, section: Section, key: str) -> bool:
        node = section.get(key)
        return bool(node is not None and boolean_value(node, key, self._findings))

    def _execution(self, node: Node | None) -> Timing:
        text = text_value(node, "execution", self._findings, limit=100) if node is not None else None
        for timing in Timing:
            if text == timing.value:
                return timing
        if node is not None and text is not None:
            hint = "write ideal (a scan takes no time) or modeled (it takes the manual's time)"
            self._findings.add("AMX6430", f"{quoted(text)} is not a way of execution", node.span, hint)
        return Timing.IDEAL

    def _executive(self, node: Node | None) -> int:
        return executive_value(node, self._findings) if node is not None else NEWEST

    def _module_loss(self, node: Node | None) -> ModuleLoss:
        text = text_value(node, "on_module_loss", self._findings, limit=100) if node is not None else None
        words = [loss.value for loss in ModuleLoss]
        if node is None or text is None:
            return ModuleLoss.STOP_ALL
        if text not in words:
            message = f"on_module_loss is {quoted(text)}; it must be {' or '.join(words)}"
            self._findings.add("AMX6704", message, node.span, did_you_mean(text, words))
            return ModuleLoss.STOP_ALL
        return ModuleLoss(text)

    def _modules(
        self, section: Section, executive: int, plants: Plants
    ) -> tuple[tuple[ModuleConfig, ...], frozenset[int]]:
        """Return the modules, and the slots of those that could not be read."""
        node = section.get("slots")
        if node is None:
            return (), frozenset()
        reader = SlotReader(self._tasks, self._findings, executive, plants)
        return reader.read(node, section.key_span("slots")), reader.unread

    def _check_size(self, variables: tuple[CommonVariable, ...], modules: tuple[ModuleConfig, ...], span: Span) -> None:
        """Compare the commons with the module that holds them, the first that can (J-3636 p. 1-1)."""
        holder = next((module for module in modules if module.common_registers), None)
        needed = sum(variable.registers for variable in variables if variable.point is None)
        if holder is not None and needed > holder.common_registers:
            message = f"the common variables take {needed} registers; the {holder.model} has {holder.common_registers}"
            self._findings.add("AMX6409", message, span)
