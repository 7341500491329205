"""AutoMax Processors: each runs up to 32 tasks on a tick of its own (J2-3106-1 p. 2-5, 10-1).

The AutoMax PC3000 is a Processor on a card in a personal computer, a rack without a backplane. The card is the
Processor/Scanner module 57C560; a 57C570 is an enclosure with one in it. The Serial module 57C565 is not a Processor
(1.3). It is written as the only module of a rack, in slot 0, though the hardware has none (decision). It holds its
common variables itself; no I/O module can be next to it, so there are neither points nor interrupts, hardware events
and current minor loops (J-3675 p. 6-17). Its times are those of table 6.
"""

from __future__ import annotations

import re
from types import MappingProxyType

from automax_ros.compile.base.cost import Model
from automax_ros.core.json_schema import steps
from automax_ros.core.ticks import DEFAULT_TICK_NS, MAX_TICK_NS, MIN_TICK_NS, NS_PER_MS, TICK_STEP_NS, tick_ns
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.common_memory import COMMON_MEMORY
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection, RackLayout
from automax_ros.rackfile.reading.executive import OLDEST, tick_fault, version_text
from automax_ros.rackfile.reading.values import Key, ProblemList, schemas, wrong_kind
from automax_ros.rackfile.sections.tasks import PRIORITIES, tasks_schema

MAX_PROCESSORS = 4
"""Most Processors of one rack (J2-3106-1 p. 2-5)."""
_COMMON_REGISTERS = 65536
"""Registers for commons of a Processor without a common memory module (decision: as many as the 57C413 has)."""
_TICKS_MS = tuple(time / NS_PER_MS for time in (MIN_TICK_NS, MAX_TICK_NS, TICK_STEP_NS, DEFAULT_TICK_NS))
_TICK = re.compile(r"[0-9]{1,6}(\.[0-9]{1,9})?\Z")
_SINCE = {"57C435": 30}
"""First version of the Executive for a module, in tenths, if that is not the oldest (1.1)."""
_SLOTS = range(1, 5)
"""Slots of Processors next to a common memory module (J2-3106-1 p. 10-2)."""


NODE = "pc3000"


def _tick(node: Node, what: str, findings: ProblemList) -> int | None:
    if not isinstance(node, Scalar) or not node.plain or not _TICK.match(node.text):
        wrong_kind(node, what, "a number of milliseconds such as 5.5", findings)
        return None
    try:
        return tick_ns(node.text)
    except ValueError as error:
        findings.add("AMX6210", f"{what.removeprefix('tick_ms of ')}: {error}", node.span)
        return None


_TICK_MS = Key("tick_ms", steps("Tick rate in ms; the scan time of a task is its TICKS times this.", *_TICKS_MS), _tick)


class ProcessorConfig(ModuleConfig):
    """A Processor module; ``model`` is its number as the manuals write it (``57C430A``), tasks in the file's order."""


class Pc3000Config(ProcessorConfig):
    """A PC3000 with its tasks."""


class ProcessorKind(ModuleKind):
    """The options of a Processor in a rack file."""

    word = "processor"
    models = MappingProxyType({"57C430A": "6010", "57C431": "6011", "57C435": "7010"})
    options = MappingProxyType({**schemas(_TICK_MS), "tasks": tasks_schema(PRIORITIES)})

    def read(self, found: ModuleSection) -> ProcessorConfig:
        """Read tick and tasks; the Executive may be too old for the module or for the tick."""
        since = _SINCE.get(found.model, OLDEST)
        if found.executive < since:
            version = version_text(found.executive)
            message = f"{found.where} needs executive {version_text(since)} or later, not {version}"
            found.findings.add("AMX6703", message, found.span)
        node, tick = found.section.get("tick_ms"), found.section.read(_TICK_MS)
        fault = tick_fault(found.executive, tick) if tick is not None else None
        if fault is not None and node is not None:
            found.findings.add("AMX6702", f"{found.where}: {fault}", node.span)
        return ProcessorConfig(
            **found.placed("processor"),
            tick_ns=tick or DEFAULT_TICK_NS,
            tasks=found.read_tasks(),
            common_registers=_COMMON_REGISTERS,
            has_battery=True,
            times=Model.PC3000 if self is PC3000 else Model(found.model),
        )

    def check_places(self, rack: RackLayout) -> None:
        """Report too few or too many Processors, and those in slots other than 1 to 4, or 0 for a lone Processor."""
        own = rack.of(self)
        if not rack.complete:
            return
        has_memory = any(item.slot == 0 for item in rack.of(COMMON_MEMORY))
        if not any(isinstance(item.kind, ProcessorKind) for item in rack.placed):
            hint = f"Processors are {', '.join(self.models)}"
            rack.findings.add("AMX6209", "the rack has no Processor", rack.span, hint)
        elif len(own) > MAX_PROCESSORS:
            message = f"the rack has {len(own)} Processors; it may have at most {MAX_PROCESSORS}"
            rack.findings.add("AMX6207", message, own[MAX_PROCESSORS].span)
        elif len(own) > 1 and not has_memory:
            message = "more than one Processor needs a common memory module in slot 0"
            hint = f"put {' or '.join(COMMON_MEMORY.models)} into slot 0 and the Processors into slots 1 to 4"
            rack.findings.add("AMX6205", message, own[1].span, hint)
        else:
            allowed = _SLOTS if has_memory else range(1)
            where = "slots 1 to 4 next to common memory" if has_memory else "slot 0 of a rack without common memory"
            for item in own:
                if item.slot not in allowed:
                    message = f"a Processor stands in {where}, not in slot {item.slot}"
                    rack.findings.add("AMX6206", message, item.span)


PROCESSOR = ProcessorKind()


class Pc3000Kind(ProcessorKind):
    """The options of a PC3000 in a rack file: those of a Processor."""

    word = "PC3000"
    models = MappingProxyType(dict.fromkeys(("57C560", "57C570"), "PC3000"))

    def read(self, found: ModuleSection) -> Pc3000Config:
        """Read tick and tasks; the module's name is that of its node, since there is only one."""
        plain = super().read(found)
        return Pc3000Config(**{**vars(plain), "name": NODE})

    def check_places(self, rack: RackLayout) -> None:
        """Report a PC3000 in a slot other than 0, and any module next to one."""
        own = rack.of(self)
        for item in own[:1]:
            if item.slot != 0:
                message = f"the PC3000 {item.model} is in slot 0 of a separate rack, not in slot {item.slot}"
                rack.findings.add("AMX6773", message, item.span)
        for item in rack.placed if own else ():
            if item is not own[0]:
                message = f"the {item.model} in slot {item.slot} cannot stand next to a PC3000, which has no slots"
                hint = "write a separate rack for each of them"
                rack.findings.add("AMX6773", message, item.span, hint)


PC3000 = Pc3000Kind()
