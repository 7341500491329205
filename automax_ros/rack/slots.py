"""The slots of a rack: which module stands where, and the rules that bind them together."""

from __future__ import annotations

import re
from dataclasses import dataclass

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.text import quoted
from automax_ros.core.ticks import DEFAULT_TICK_NS, tick_ns
from automax_ros.rack.config import MAX_PROCESSORS, MAX_SLOT, CommonMemoryConfig, ProcessorConfig
from automax_ros.rack.findings import Findings
from automax_ros.rack.modules import COMMON_MEMORY_REGISTERS, NOT_YET, PROCESSORS, SUPPORTED, module_number
from automax_ros.rack.scalars import text_value, wrong_kind
from automax_ros.rack.sections import Entry, Section, entries_of
from automax_ros.rack.tasks import TaskReader
from automax_ros.rack.yaml_text import Mapping, Node, Scalar

_SLOT = re.compile(r"[0-9]{1,3}\Z")
_TICK = re.compile(r"[0-9]{1,6}(\.[0-9]{1,9})?\Z")
_PROCESSOR_SLOTS = range(1, 5)
"""Where Processors stand beside a common memory module (J2-3106-1 p. 10-2)."""


@dataclass(frozen=True)
class Slots:
    """The modules of a rack that are right, in the order of slots."""

    common_memory: CommonMemoryConfig | None = None
    processors: tuple[ProcessorConfig, ...] = ()


class SlotReader:
    """Reads the ``slots`` section."""

    def __init__(self, tasks: TaskReader, findings: Findings) -> None:
        """Take the reader of tasks, which knows the names of the whole rack."""
        self._tasks = tasks
        self._findings = findings
        self._models: dict[int, tuple[str, Span]] = {}
        self._places: dict[int, Span] = {}
        self._complete = True

    def read(self, node: Node, span: Span) -> Slots:
        """Return the modules; ``span`` is the place of the key ``slots``."""
        entries = entries_of(node, "slots", self._findings)
        if entries is None:
            return Slots()
        processors: list[ProcessorConfig] = []
        memory: CommonMemoryConfig | None = None
        for key, value in entries:
            slot = self._slot(key)
            if slot is None:
                continue
            self._places[slot] = key.span
            module = self._module(slot, key, value)
            self._complete = self._complete and module is not None
            if isinstance(module, ProcessorConfig):
                processors.append(module)
            elif module is not None and slot == 0:
                memory = module
        self._check_layout(span)
        return Slots(memory, tuple(sorted(processors, key=lambda item: item.slot)))

    def _slot(self, key: Scalar) -> int | None:
        if not _SLOT.match(key.text) or not 0 <= int(key.text) <= MAX_SLOT:
            self._complete = False
            self._findings.add("AMX6200", f"{quoted(key.text)} is not a slot; slots are 0 to {MAX_SLOT}", key.span)
            return None
        slot = int(key.text)
        if slot not in self._places:
            return slot
        first = self._places[slot]
        held = f"holds {_described(self._models[slot][0])}" if slot in self._models else "is defined"
        message = f"slot {slot} already {held} (line {first.line})"
        self._findings.add("AMX6201", message, key.span, notes=(Note("first defined here", first),))
        return None

    def _module(self, slot: int, key: Scalar, node: Node) -> ProcessorConfig | CommonMemoryConfig | None:
        what = f"slot {slot}"
        if not isinstance(node, Mapping):
            given = module_number(node.text) if isinstance(node, Scalar) and len(node.text) < 10 else ""
            hint = f"write {{module: {given if given in SUPPORTED else '57C435'}}}"
            wrong_kind(node, what, "keys and values", self._findings, hint)
            return None
        model = self._model(node.entries, what, key)
        if model is None:
            return None
        self._models[slot] = (model, key.span)
        if model in COMMON_MEMORY_REGISTERS:
            Section(node.entries, _described(model), ("module",), self._findings)
            return CommonMemoryConfig(slot, model, key.span.line)
        section = Section(node.entries, _described(model), ("module", "tick_ms", "tasks"), self._findings)
        where = f"{_described(model)} in slot {slot}"
        tick = self._tick(section.get("tick_ms"), where)
        tasks = section.get("tasks")
        return ProcessorConfig(slot, model, tick, self._tasks.read(tasks, where) if tasks else (), key.span.line)

    def _model(self, entries: tuple[Entry, ...], what: str, key: Scalar) -> str | None:
        """Return the number of a module that the emulator has; report AMX6202 to AMX6204 for others."""
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
        if model == "57C430":
            message = "the 57C430 Processor may not share a rack with the others and does not run this software"
            self._findings.add("AMX6204", message, node.span, "the module that does is the 57C430A")
        elif model in NOT_YET:
            self._findings.add("AMX6203", f"the {model} ({NOT_YET[model]}) is not supported yet", node.span)
        else:
            hint = f"the emulator has {', '.join(SUPPORTED)}"
            self._findings.add("AMX6202", f"{quoted(text)} is no module that the emulator knows", node.span, hint)
        return None

    def _tick(self, node: Node | None, where: str) -> int:
        if node is None:
            return DEFAULT_TICK_NS
        if not isinstance(node, Scalar) or not node.plain or not _TICK.match(node.text):
            wrong_kind(node, f"tick_ms of {where}", "a number of milliseconds such as 5.5", self._findings)
            return DEFAULT_TICK_NS
        try:
            return tick_ns(node.text)
        except ValueError as error:
            self._findings.add("AMX6210", f"{where}: {error}", node.span)
            return DEFAULT_TICK_NS

    def _check_layout(self, span: Span) -> None:
        """Report what is wrong with the modules together; if one is not known, it may be the one that is missing."""
        for slot, (model, place) in self._models.items():
            if model in COMMON_MEMORY_REGISTERS and slot != 0:
                self._report_memory_place(slot, model, place)
        if not self._complete:
            return
        processors = sorted(slot for slot, (model, _) in self._models.items() if model in PROCESSORS)
        has_memory = 0 in self._models and self._models[0][0] in COMMON_MEMORY_REGISTERS
        if not processors:
            self._findings.add("AMX6209", "the rack has no Processor", span, f"Processors are {', '.join(PROCESSORS)}")
        elif len(processors) > MAX_PROCESSORS:
            place = self._places[processors[MAX_PROCESSORS]]
            message = f"the rack has {len(processors)} Processors; it may have at most {MAX_PROCESSORS}"
            self._findings.add("AMX6207", message, place)
        elif len(processors) > 1 and not has_memory:
            message = "more than one Processor needs a common memory module in slot 0"
            hint = f"put {' or '.join(COMMON_MEMORY_REGISTERS)} into slot 0 and the Processors into slots 1 to 4"
            self._findings.add("AMX6205", message, self._places[processors[1]], hint)
        else:
            self._check_processor_slots(processors, has_memory)

    def _check_processor_slots(self, processors: list[int], has_memory: bool) -> None:
        allowed = _PROCESSOR_SLOTS if has_memory else range(1)
        where = "slots 1 to 4 beside common memory" if has_memory else "slot 0 of a rack without common memory"
        for slot in processors:
            if slot not in allowed:
                message = f"a Processor stands in {where}, not in slot {slot}"
                self._findings.add("AMX6206", message, self._places[slot])

    def _report_memory_place(self, slot: int, model: str, place: Span) -> None:
        reason = "plain registers, which are not supported yet" if slot % 2 == 0 else "not possible"
        self._findings.add(
            "AMX6208", f"the {model} in slot {slot} is {reason}", place, "common memory stands in slot 0"
        )


def _described(model: str) -> str:
    return f"{'processor' if model in PROCESSORS else 'common memory'} {model}"
