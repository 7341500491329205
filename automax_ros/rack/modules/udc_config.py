"""UDC modules as a rack file configures them: 57552, with a task for drive A, one for drive B, or one alone (2.3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

from automax_ros.compile.cost import Model
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import Keys, may_be_empty, section, words
from automax_ros.core.text import quoted
from automax_ros.core.ticks import UDC_TICK_NS
from automax_ros.core.yaml_text import Node
from automax_ros.drive.pmi_table import DRIVE_B, WRITTEN
from automax_ros.rack.findings import Findings
from automax_ros.rack.modules.configured import Registers
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.modules.udc_registers import UDC_REGISTERS
from automax_ros.rack.plants.config import PlantConfig, plant_name
from automax_ros.rack.scalars import text_value
from automax_ros.rack.sections import Section, entries_of
from automax_ros.rack.task_config import TaskConfig
from automax_ros.rack.tasks import TaskPlace, tasks_schema

MAX_UDCS = 10
"""UDC modules of one rack (J2-3106-1 p. 2-5)."""
DRIVES = ("A", "B")
"""The drives of a UDC, in the order in which their tasks run."""


@dataclass(frozen=True)
class UdcConfig:
    """A UDC module. ``tasks`` stand in the order of their drives; ``plants`` are by drive."""

    slot: int
    model: str
    tasks: tuple[TaskConfig, ...] = ()
    plants: Mapping[str, PlantConfig] = field(default_factory=dict)
    line: int = 0

    tick_ns = UDC_TICK_NS
    times = Model.UDC
    has_battery = False
    keeps_locals = False
    common_registers = 0

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"udc_{self.slot}"

    @cached_property
    def registers(self) -> Registers:
        """Its registers: of a drive with a PMI the module writes feedback and communication status itself."""
        bases = [DRIVE_B if drive == "B" else 0 for drive, plant in self.plants.items() if plant.motor is not None]
        shown = frozenset(base + number for base in bases for number in WRITTEN)
        return replace(UDC_REGISTERS, shown=shown) if shown else UDC_REGISTERS


class _Drives:
    """The tasks of one UDC: each drive has at most one."""

    key, sample, most = "drive", "A", len(DRIVES)
    schema = words("The drive that the task is for; A runs before B.", DRIVES)

    def __init__(self) -> None:
        self._taken: dict[str, Span] = {}

    def read(self, node: Node, what: str, findings: Findings) -> TaskPlace | None:
        """Return a drive."""
        text = text_value(node, f"drive of {what}", findings, limit=100)
        if text is None:
            return None
        if text not in DRIVES:
            findings.add("AMX6470", f"drive of {what} is {quoted(text)}; it must be A or B", node.span)
        elif text in self._taken:
            note = Note("that task is here", self._taken[text])
            findings.add("AMX6470", f"drive {text} has a task already", node.span, notes=(note,))
        else:
            self._taken[text] = node.span
            return TaskPlace(DRIVES.index(text), text)
        return None


_PLANTS = may_be_empty(
    section("The plants that its drives turn.", {drive: plant_name(f"The plant of drive {drive}.") for drive in DRIVES})
)


class UdcKind:
    """What a rack file may say of a UDC."""

    word = "UDC"
    models = {"57552": "UDC module"}  # noqa: RUF012
    options: Keys = MappingProxyType({"tasks": tasks_schema(_Drives()), "plants": _PLANTS})

    def read(self, found: FoundModule) -> UdcConfig:
        """Read tasks and plants."""
        node = found.section.get("tasks")
        tasks = found.tasks.read(node, found.where, _Drives()) if node else ()
        for task in tasks:
            _check_source_kind(task, found)
        in_order = tuple(sorted(tasks, key=lambda task: task.priority))
        return UdcConfig(found.slot, found.model, in_order, _plants(found), found.span.line)

    def check_places(self, rack: Arrangement) -> None:
        """Report too many UDCs; no source tells of a slot where one may not stand."""
        own = rack.of(self)
        if len(own) > MAX_UDCS:
            message = f"the rack has {len(own)} UDC modules; it may have at most {MAX_UDCS}"
            rack.findings.add("AMX6471", message, own[MAX_UDCS].span)


UDC = UdcKind()


def _check_source_kind(task: TaskConfig, found: FoundModule) -> None:
    """Report a task in a language that a UDC does not have (J2-3106-1 p. 2-5)."""
    suffix = task.file.suffix.upper()
    if suffix != ".BLK":
        message = f"task {task.name} of {found.where} is a {suffix} file; a UDC runs control-block tasks (.BLK) only"
        found.findings.add("AMX6304", message, Span(task.line, 1, 2))


def _plants(found: FoundModule) -> Mapping[str, PlantConfig]:
    node = found.section.get("plants")
    if node is None:
        return {}
    what = f"plants of {found.where}"
    section = Section(entries_of(node, what, found.findings) or (), what, DRIVES, found.findings)
    named = ((drive, section.get(drive)) for drive in DRIVES)
    claimed = ((drive, found.plants.claim(node, f"drive {drive} of {found.where}")) for drive, node in named if node)
    return {drive: plant for drive, plant in claimed if plant is not None}
