"""Common memory modules: in slot 0 they hold the rack's common variables, in any other even slot plain registers.

With several Processors one is needed in slot 0. Elsewhere a module of either kind has 64K registers of user data and no
arrays (J-3636 p. 1-1): tasks may write any of them, a variable with ``ros: in`` is an input. STOP ALL and a power cycle
clear them, as volatile common memory (decision). They do not arbitrate the bus.
"""

from __future__ import annotations

from types import MappingProxyType

from automax_ros.rackfile.model.module import NO_REGISTERS, ModuleConfig, Registers
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection, RackLayout

COMMON_REGISTERS = {"57C413": 65536, "57C423": 131072}
"""16-bit registers for common variables in slot 0 (J-3636 p. 1-1)."""
NODE = "common_memory"
_USER_REGISTERS = Registers(65536, either=range(65536))
"""Registers of a module in an even slot other than 0 (J-3636 p. 1-1)."""


class CommonMemoryConfig(ModuleConfig):
    """A common memory module; in slot 0 its name is that of the node of all common variables."""


class CommonMemoryKind(ModuleKind):
    """The options of a common memory module in a rack file."""

    word = "common memory"
    models = MappingProxyType(dict.fromkeys(COMMON_REGISTERS, "common memory module"))

    def read(self, found: ModuleSection) -> CommonMemoryConfig:
        """Read the section, which has no keys of its own."""
        return CommonMemoryConfig(
            **{**found.placed(NODE), **({} if found.slot else {"name": NODE})},
            registers=_USER_REGISTERS if found.slot else NO_REGISTERS,
            common_registers=0 if found.slot else COMMON_REGISTERS[found.model],
            has_battery=True,
        )

    def check_places(self, rack: RackLayout) -> None:
        """Report common memory in an odd slot (J-3636 p. 1-1)."""
        for item in rack.of(self):
            if item.slot % 2:
                message = f"the {item.model} cannot be in slot {item.slot}"
                hint = "common memory stands in slot 0, or with registers of user data in another even slot"
                rack.findings.add("AMX6208", message, item.span, hint)


COMMON_MEMORY = CommonMemoryKind()
