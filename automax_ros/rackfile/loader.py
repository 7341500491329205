"""Reads a rack's YAML file into its configuration and reports all errors in it."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, Note, SourceText, Span
from automax_ros.core.json_schema import Keys, Schema, document, either, entries, named, section
from automax_ros.core.kinds import Direction
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node, Scalar, YamlMapping, read_yaml
from automax_ros.rackfile.model.config import MAX_SLOT, CommonVariable, ModuleLoss, RackConfig, Timing
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.ros_names import namespace
from automax_ros.rackfile.modules.kind import ModuleSection, PlacedModule, RackLayout
from automax_ros.rackfile.modules.registry import KINDS, NOT_YET, REFUSED, SUPPORTED, module_number, spellings
from automax_ros.rackfile.reading.executive import EXECUTIVE, NEWEST
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.rackfile.reading.names import RACK_NAME, is_rack_name
from automax_ros.rackfile.reading.values import (
    MAX_FINDINGS,
    Entry,
    Key,
    ProblemList,
    Section,
    choice_key,
    entries_of,
    flag_key,
    schemas,
    text_value,
    wrong_kind,
)
from automax_ros.rackfile.sections.commons import SCHEMA as COMMON_SCHEMA
from automax_ros.rackfile.sections.commons import CommonReader
from automax_ros.rackfile.sections.feeds import read_feeds
from automax_ros.rackfile.sections.joints import read_commands
from automax_ros.rackfile.sections.meant_so import SCHEMA as MEANT_SO_SCHEMA
from automax_ros.rackfile.sections.meant_so import read_meant_so
from automax_ros.rackfile.sections.plants import SCHEMA as PLANTS_SCHEMA
from automax_ros.rackfile.sections.plants import Plants, read_plants
from automax_ros.rackfile.sections.tasks import TaskReader
from automax_ros.rackfile.sections.watch import ALARMS_SCHEMA, read_alarms, read_watch
from automax_ros.rackfile.sections.watch import SCHEMA as WATCH_SCHEMA
from automax_ros.rackfile.sections.webs import SCHEMA as WEBS_SCHEMA
from automax_ros.rackfile.sections.webs import read_webs

_SLOT = re.compile(r"[0-9]{1,3}\Z")
SLOTS_SCHEMA: Schema = entries(
    "The modules of the rack, by slots 0 to 15.",
    f"^0*({'|'.join(map(str, range(MAX_SLOT + 1)))})$",
    either(
        "A module.",
        *(
            section(f"{model}: {text}.", {"module": spellings(model), **kind.options}, ("module",))
            for kind in KINDS
            for model, text in kind.models.items()
        ),
    ),
)


class SlotReader:
    """Reads the ``slots`` section."""

    def __init__(self, tasks: TaskReader, findings: ProblemList, executive: int, plants: Plants) -> None:
        self._executive, self._plants, self._tasks, self._findings = executive, plants, tasks, findings
        self._placed: dict[int, PlacedModule] = {}
        self._places: dict[int, Span] = {}
        self._complete = True
        self.unread: frozenset[int] = frozenset()

    def read(self, node: Node, span: Span) -> tuple[ModuleConfig, ...]:
        """Return the modules without errors, in the order of slots; ``span`` is the place of the key ``slots``.

        ``unread`` are then the slots of the others: their errors are reported, and consequences of these need not be.
        """
        entries = entries_of(node, "slots", self._findings)
        if entries is None:
            return ()
        modules: list[ModuleConfig] = []
        for key, value in entries:
            slot = self._slot(key)
            if slot is None:
                continue
            self._places[slot] = key.span
            module = self._module(slot, key, value)
            self._complete = self._complete and module is not None
            if module is not None:
                modules.append(module)
        in_order = tuple(sorted(modules, key=lambda item: item.slot))
        self.unread = frozenset(self._places) - {item.slot for item in modules}
        rack = RackLayout(list(self._placed.values()), self._complete, span, self._findings, in_order)
        for kind in KINDS:
            kind.check_places(rack)
        return in_order

    def _slot(self, key: Scalar) -> int | None:
        if not _SLOT.match(key.text) or not 0 <= int(key.text) <= MAX_SLOT:
            self._complete = False
            self._findings.add("AMX6200", f"{quoted(key.text)} is not a slot; slots are 0 to {MAX_SLOT}", key.span)
            return None
        slot = int(key.text)
        if slot not in self._places:
            return slot
        first = self._places[slot]
        held = f"holds {_describe(self._placed[slot])}" if slot in self._placed else "is defined"
        message = f"slot {slot} already {held} (line {first.line})"
        self._findings.add("AMX6201", message, key.span, notes=(Note("first defined here", first),))
        return None

    def _module(self, slot: int, key: Scalar, node: Node) -> ModuleConfig | None:
        what = f"slot {slot}"
        if not isinstance(node, YamlMapping):
            given = module_number(node.text) if isinstance(node, Scalar) and len(node.text) < 10 else ""
            hint = f"write {{module: {given if given in SUPPORTED else '57C435'}}}"
            wrong_kind(node, what, "keys and values", self._findings, hint)
            return None
        model = self._model(node.entries, what, key)
        if model is None:
            return None
        kind = SUPPORTED[model]
        placed = self._placed[slot] = PlacedModule(slot, model, kind, key.span)
        known, what = ("module", *kind.options), _describe(placed)
        section = Section(node, what, known, self._findings, owner=f"{what} in slot {slot}")
        return kind.read(ModuleSection(slot, model, section, key.span, self._tasks, self._executive, self._plants))

    def _model(self, entries: tuple[Entry, ...], what: str, key: Scalar) -> str | None:
        """Return the number of an emulated module; report AMX6202 to AMX6204 and AMX6211 for others."""
        node = next((value for name, value in entries if name.text == "module"), None)
        if node is None:
            self._findings.add("AMX6009", f"{what} lacks the key 'module'", key.span)
            return None
        text = text_value(node, f"module of {what}", self._findings, limit=20)
        if text is None:
            return None
        model = module_number(text)
        if model in SUPPORTED:
            return model
        if model in REFUSED:
            code, message, hint = REFUSED[model]
            self._findings.add(code, message, node.span, hint)
        elif model in NOT_YET:
            self._findings.add("AMX6203", f"the {model} ({NOT_YET[model]}) is not supported yet", node.span)
        else:
            hint = f"the emulator has {', '.join(SUPPORTED)}"
            self._findings.add("AMX6202", f"{quoted(text)} is not a module that the emulator knows", node.span, hint)
        return None


def _describe(placed: PlacedModule) -> str:
    return f"{placed.kind.word} {placed.model}"


_START = Span(1, 1, 2)
_NAME_LINE = re.compile(r"""^rack[ ]*:[ ]*(?:["']?)(\w{1,8})(?:["']?)[ ]*(?:#.*)?$""", re.MULTILINE)
_TIMINGS, _LOSSES = {timing.value: timing for timing in Timing}, {loss.value: loss for loss in ModuleLoss}


def _name(node: Node, _: str, findings: ProblemList) -> str | None:
    text = text_value(node, "the rack's name", findings, limit=100)
    name = findings.upper_case(text, node.span) if text is not None else None
    if text is None or name is None or is_rack_name(name):
        return name
    hint = "for example LINE1: no blank, hyphen or underscore"
    findings.add("AMX6100", f"{quoted(text)}: a rack's name has 1 to 8 letters and digits", node.span, hint)
    return None


_NAME = Key("rack", named("The rack's name; in lower case its ROS 2 namespace.", RACK_NAME), _name)
_OPERATOR = flag_key("operator", "Whether the running rack has services that operate it.")
_EXECUTION = choice_key(
    "execution",
    "`ideal`: a scan takes no time; `modeled`: the time that the manual prints.",
    _TIMINGS,
    ("AMX6430", "{given} is not a way of execution"),
    lambda _: "write ideal (a scan takes no time) or modeled (it takes the manual's time)",
    "ideal",
)
_AUTO_RUN = flag_key("auto_run", "AUTO RUN: whether a power cycle ends with the tasks in RUN that ran before it.")
_MODULE_LOSS = choice_key(
    "on_module_loss",
    "What a rack of several processes does when it loses one.",
    _LOSSES,
    ("AMX6704", f"{{what}} is {{given}}; it must be {' or '.join(_LOSSES)}"),
    lambda word: did_you_mean(word, _LOSSES),
    "stop_all",
)
KEYS: Keys = {
    **schemas(_NAME, _OPERATOR, _EXECUTION, EXECUTIVE, _AUTO_RUN, _MODULE_LOSS),
    "slots": SLOTS_SCHEMA,
    "plants": PLANTS_SCHEMA,
    "webs": WEBS_SCHEMA,
    "common": COMMON_SCHEMA,
    "watch": WATCH_SCHEMA,
    "alarms": ALARMS_SCHEMA,
    "meant_so": MEANT_SO_SCHEMA,
}
"""The top-level keys of a rack file."""
_REQUIRED = ("rack", "slots")


def schema() -> Schema:
    """Return the JSON schema of a rack file, for editors: it checks the form, not how the parts agree."""
    return document("AutoMax rack", section("A rack: its modules, tasks and common variables.", KEYS, _REQUIRED))


@dataclass(frozen=True)
class LoadResult:
    """Result of reading a rack file: ``config`` is None if there are errors. Diagnostics refer to ``source``."""

    config: RackConfig | None
    diagnostics: list[Diagnostic]
    source: SourceText

    @property
    def namespace(self) -> str | None:
        """The rack's namespace, None if not even its name can be read.

        With errors elsewhere, in the YAML itself too, it is that of the first line ``rack: NAME`` (decision: so the
        rack has its place in the graph while the rest of the file is mended).
        """
        if self.config is not None:
            return self.config.namespace
        found = _NAME_LINE.search(self.source.text)
        name = found[1].upper() if found is not None else ""
        return namespace(name) if is_rack_name(name) else None


def load(path: str | Path, *, allow_outside: bool = False) -> LoadResult:
    """Read a rack file; any content becomes a configuration or diagnostics (AMX6000 to AMX6499), by place.

    Task sources must lie in the file's folder, symbolic links followed (also the file's own), unless ``allow_outside``.
    They are read to check that they can be, not compiled.
    """
    path = Path(path)
    findings = ProblemList()
    source = SourceText(str(path), _text_of(path, findings))
    return _make_result(source, TaskReader(path, allow_outside, findings), path, findings)


def load_stored(source: SourceText, path: Path, most_errors: int = MAX_FINDINGS) -> LoadResult:
    """Read a rack file from the text in a recording, with its sources under the names of their tasks.

    ``path`` is the file's path in the configuration. No file is read. At most ``most_errors`` are reported.
    """
    findings = ProblemList(most_errors)
    return _make_result(source, TaskReader(None, False, findings), path, findings)


def _make_result(source: SourceText, tasks: TaskReader, path: Path, findings: ProblemList) -> LoadResult:
    root = read_yaml(source.text, findings.yaml_flaw) if not findings.errors else None
    config = _read_rack(root, source.text, tasks, path, findings) if root is not None else None
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


def _read_rack(root: Node, text: str, tasks: TaskReader, path: Path, findings: ProblemList) -> RackConfig | None:
    section = Section(root, "a rack file", KEYS, findings, owner="")
    if not section.well_formed:
        return None
    section.require(_REQUIRED, "the rack file", _START)
    name = section.read(_NAME)
    operator, auto_run = bool(section.read(_OPERATOR)), bool(section.read(_AUTO_RUN))
    loss = section.read(_MODULE_LOSS) or ModuleLoss.STOP_ALL
    execution = section.read(_EXECUTION) or Timing.IDEAL
    executive = section.read(EXECUTIVE) or NEWEST
    plants = read_plants(section.get("plants"), findings)
    webs = read_webs(section.get("webs"), plants.known, findings)
    slots, common, watch = section.get("slots"), section.get("common"), section.get("watch")
    reader = SlotReader(tasks, findings, executive, plants)
    modules = reader.read(slots, section.key_span("slots")) if slots is not None else ()
    variables = CommonReader(modules, findings, reader.unread).read(common) if common is not None else ()
    if common is not None:
        _check_size(variables, modules, section.key_span("common"), findings)
    feeds = read_feeds([*plants.feeds, *webs.feeds], variables, modules, findings)
    commands = read_commands(plants.joints, variables, findings)
    everything = (*variables, *_bank_variables(modules))
    shown = read_watch(watch, everything, findings) if watch is not None else None
    alarms = section.get("alarms")
    named_alarms = read_alarms(alarms, everything, findings) if alarms is not None else ()
    intended = section.get("meant_so")
    meant_so = read_meant_so(intended, variables, plants.known, modules, findings) if intended is not None else {}
    if name is None or findings.errors:
        return None
    return RackConfig(
        name=name,
        namespace=namespace(name),
        path=path,
        text=text,
        operator=operator,
        modules=modules,
        variables=everything,
        execution=execution,
        executive=executive,
        auto_run=auto_run,
        on_module_loss=loss,
        plants=tuple(plants.known.values()),
        webs=tuple(webs.known.values()),
        feeds=feeds,
        joint_commands=commands,
        watch=shown,
        alarms=named_alarms,
        meant_so=meant_so,
    )


def _check_size(
    variables: tuple[CommonVariable, ...], modules: tuple[ModuleConfig, ...], span: Span, findings: ProblemList
) -> None:
    """Compare the size of the commons with the module that holds them, the first that can (J-3636 p. 1-1)."""
    holder = next((module for module in modules if module.common_registers), None)
    needed = sum(variable.registers for variable in variables if variable.point is None)
    if holder is not None and needed > holder.common_registers:
        message = f"the common variables take {needed} registers; the {holder.model} has {holder.common_registers}"
        findings.add("AMX6409", message, span)


def _bank_variables(modules: Iterable[ModuleConfig]) -> list[CommonVariable]:
    """Return a variable for the registers of each module that has some; it is not visible on ROS."""
    return [
        CommonVariable(
            f"SLOT:{module.slot}%",
            DataType.INTEGER,
            (module.registers.count,),
            direction=Direction.CLOSED,
            line=module.line,
            bank=module.slot,
        )
        for module in modules
        if module.registers.count
    ]
