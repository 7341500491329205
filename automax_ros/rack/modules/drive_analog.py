"""The drive analog I/O module 57C405: the armature voltage that fast bridge change needs (52.6.1).

``drive`` is the slot of the 57C406 whose armature voltage a transformer of 52.6.1 brings to connector P4. Its nominal
voltage is the one nearest to that of the plant's line (decision). Register 0 shows the signal, 4095 counts at 10 V,
clamped there: at each interrupt of the 57C406, every 5.5 ms while there is none. The other registers are inputs from
outside. No source gives these registers (decision). Without ``drive`` there is no signal: register 0 is an input like
the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import Keys, whole
from automax_ros.rack.config import MAX_SLOT
from automax_ros.rack.modules.configured import Registers
from automax_ros.rack.modules.drive_config import DRIVE_CONTROLLER
from automax_ros.rack.modules.io_config import IoModel, WithoutTasks
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.scalars import integer_value

_ANALOG_REGISTERS = Registers(4, by_itself=True)


@dataclass(frozen=True)
class DriveAnalogConfig(WithoutTasks):
    """A 57C405; ``drive`` is the slot of the 57C406 to whose armature it is wired."""

    slot: int
    model: str
    drive: int | None = None
    line: int = 0
    drive_span: Span | None = field(default=None, compare=False)

    registers: Registers = _ANALOG_REGISTERS

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"drive_analog_{self.slot}"


class DriveAnalogKind:
    """What a rack file may say of a 57C405."""

    word = "drive analog I/O"
    table: Mapping[str, IoModel] = MappingProxyType({"57C405": IoModel("drive analog I/O module", _ANALOG_REGISTERS)})
    models: Mapping[str, str] = MappingProxyType({number: model.title for number, model in table.items()})
    options: Keys = MappingProxyType(
        {"drive": whole("Slot of the 57C406 whose armature voltage is wired to it.", 0, MAX_SLOT)}
    )

    def read(self, found: FoundModule) -> DriveAnalogConfig:
        """Read which drive it is wired to."""
        node = found.section.get("drive")
        what = f"drive of {found.where}"
        drive = None if node is None else integer_value(node, what, found.findings, low=0, high=15, code="AMX6520")
        return DriveAnalogConfig(found.slot, found.model, drive, found.span.line, node.span if node else None)

    def check_places(self, rack: Arrangement) -> None:
        """Report a drive that is not there, and one that has two of these modules."""
        controllers = {item.slot for item in rack.of(DRIVE_CONTROLLER)}
        wired: dict[int, Span] = {}
        for module in rack.modules:
            if not isinstance(module, DriveAnalogConfig) or module.drive is None or module.drive_span is None:
                continue
            drive, span = module.drive, module.drive_span
            if drive in wired:
                message = f"the armature voltage of the drive in slot {drive} goes to another 57C405 already"
                rack.findings.add("AMX6521", message, span, notes=(Note("that one is wired here", wired[drive]),))
            elif drive in controllers or not rack.complete:
                wired[drive] = span
            else:
                hint = "name the slot of the 57C406 whose armature is wired to connector P4"
                rack.findings.add("AMX6520", f"slot {drive} holds no 57C406", span, hint)


DRIVE_ANALOG = DriveAnalogKind()
