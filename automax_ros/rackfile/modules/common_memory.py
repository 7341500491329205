"""Common memory modules: in slot 0 they hold the rack's common variables, in any other even slot plain registers.

With several Processors one is needed in slot 0. Elsewhere a module has 64K registers of user data, whichever it is, and
no arrays (J-3636 p. 1-1): tasks may write any of them, a variable with ``ros: in`` is an input. STOP ALL and a power
cycle clear them, as volatile common memory (decision). They do not arbitrate the bus.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

from automax_ros.compile.base.cost import Model
from automax_ros.core.json_schema import Keys
from automax_ros.rackfile.model.module import NO_REGISTERS, Registers
from automax_ros.rackfile.model.task import TaskConfig
from automax_ros.rackfile.modules.kind import ModuleSection, RackLayout

COMMON_REGISTERS = {"57C413": 65536, "57C423": 131072}
"""16-bit registers for common variables in slot 0 (J-3636 p. 1-1)."""
NODE = "common_memory"
_USER_REGISTERS = Registers(65536, either=range(65536))
"""What a module in an even slot other than 0 has (J-3636 p. 1-1)."""


@dataclass(frozen=True)
class CommonMemoryConfig:
    """A common memory module."""

    slot: int
    model: str
    line: int = 0

    tick_ns = 0
    times = Model.NONE
    has_battery = True
    keeps_locals = True

    @property
    def name(self) -> str:
        """The module's name in the rack; in slot 0 it is that of the node of all common variables."""
        return f"{NODE}_{self.slot}" if self.slot else NODE

    @property
    def tasks(self) -> tuple[TaskConfig, ...]:
        """No tasks: they are never stored here (J2-3106-1 p. 10-2)."""
        return ()

    @property
    def registers(self) -> Registers:
        """Registers of user data, but not in slot 0."""
        return _USER_REGISTERS if self.slot else NO_REGISTERS

    @property
    def common_registers(self) -> int:
        """16-bit registers that common variables may take, in slot 0 alone."""
        return 0 if self.slot else COMMON_REGISTERS[self.model]


class CommonMemoryKind:
    """What a rack file may say of a common memory module."""

    word = "common memory"
    models = dict.fromkeys(COMMON_REGISTERS, "common memory module")
    options: Keys = MappingProxyType({})

    def read(self, found: ModuleSection) -> CommonMemoryConfig:
        """Read the section, which has no keys of its own."""
        return CommonMemoryConfig(found.slot, found.model, found.span.line)

    def check_places(self, rack: RackLayout) -> None:
        """Report common memory in an odd slot (J-3636 p. 1-1)."""
        for item in rack.of(self):
            if item.slot % 2:
                message = f"the {item.model} cannot stand in slot {item.slot}"
                hint = "common memory stands in slot 0, or with registers of user data in another even slot"
                rack.findings.add("AMX6208", message, item.span, hint)


COMMON_MEMORY = CommonMemoryKind()
