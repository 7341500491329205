"""The drive modules in a rack file: the controller 57C406 with the plant that it drives, and the analog I/O 57C405.

The 57C405 shows the armature voltage that fast bridge change needs (52.6.1). Its ``drive`` is the slot of the 57C406
whose armature voltage a transformer of 52.6.1 brings to connector P4. Its nominal voltage is the one nearest to that of
the plant's line (decision). Register 0 shows the signal, 4095 counts at 10 V, clamped there: at each interrupt of the
57C406, every 5.5 ms while there is none. The other registers are inputs from outside. No source gives these registers
(decision). Without ``drive`` there is no signal: register 0 is an input like the others.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

from automax_ros.core.diagnostics import Note, Span
from automax_ros.rackfile.model.config import MAX_SLOT
from automax_ros.rackfile.model.module import ModuleConfig, Registers
from automax_ros.rackfile.model.plants import PlantConfig, plant_name
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection, RackLayout
from automax_ros.rackfile.reading.values import schemas, whole_key

TACH_THRESHOLD, PHASE_STEP, PERIOD_STEP, OPTIONS = 4136, 4137, 4138, 4146
"""The registers that an application may write (52.7)."""
DEFAULTS = {TACH_THRESHOLD: 109, PHASE_STEP: 4, PERIOD_STEP: 2, OPTIONS: 0}
"""Values that the CML task writes to them at initialisation (52.4.1, 52.5.1, 52.6.2, 52.7)."""
ACCESS_NS = 5_000
"""Delay of the microprocessor by an access of the application, ns (52.7, decision: no manual says how much)."""
_COUNT = max(DEFAULTS) + 1
_REGISTERS = Registers(
    _COUNT,
    outputs=frozenset(DEFAULTS),
    reserved=frozenset(range(_COUNT)) - frozenset(DEFAULTS),
    by_itself=True,
)


_ANALOG_REGISTERS = Registers(4, by_itself=True)
_DRIVE = whole_key("drive", "Slot of the 57C406 whose armature voltage is wired to it.", 0, MAX_SLOT, "AMX6520")


class DriveConfig(ModuleConfig):
    """A 57C406; without a ``plant`` it has registers and switches only, and its loop measures no line."""

    @property
    def plant(self) -> PlantConfig | None:
        """The plant of its one drive."""
        return self.plants.get("")


class DriveControllerKind(ModuleKind):
    """The options of a 57C406 in a rack file."""

    word = "drive I/O controller"
    models = MappingProxyType({"57C406": "drive I/O controller module"})
    table = MappingProxyType({"57C406": _REGISTERS})
    options = MappingProxyType({"plant": plant_name("The plant that the module drives.")})

    def read(self, found: ModuleSection) -> DriveConfig:
        """Read the plant."""
        node = found.section.get("plant")
        what = f"plant of {found.where}"
        plant = None if node is None else found.plants.claim(node, what)
        if node is not None and plant is not None and plant.motor is None and not found.findings.errors:
            found.findings.add("AMX6522", f"{what}: the plant {plant.name} has no motor", node.span)
        plants = {} if plant is None else {"": plant}
        return DriveConfig(**found.placed("drive"), registers=_REGISTERS, plants=plants)


DRIVE_CONTROLLER = DriveControllerKind()


@dataclass(frozen=True, kw_only=True)
class DriveAnalogConfig(ModuleConfig):
    """A 57C405; ``drive_span`` is the place of its key ``drive``."""

    drive_span: Span | None = field(default=None, compare=False)


class DriveAnalogKind(ModuleKind):
    """The options of a 57C405 in a rack file."""

    word = "drive analog I/O"
    models = MappingProxyType({"57C405": "drive analog I/O module"})
    table = MappingProxyType({"57C405": _ANALOG_REGISTERS})
    options = MappingProxyType(schemas(_DRIVE))

    def read(self, found: ModuleSection) -> DriveAnalogConfig:
        """Read the drive to which it is wired."""
        node, drive = found.section.get("drive"), found.section.read(_DRIVE)
        span = node.span if node is not None else None
        place = found.placed("drive_analog")
        return DriveAnalogConfig(**place, registers=_ANALOG_REGISTERS, drive=drive, drive_span=span)

    def check_places(self, rack: RackLayout) -> None:
        """Report a drive that does not exist, and one that has two of these modules."""
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
