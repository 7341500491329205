"""Common memory modules: they hold the rack's common variables; with several Processors one is needed in slot 0."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.compile.cost import Model
from automax_ros.rack.modules.kind import NO_REGISTERS, Arrangement, FoundModule, Module, Parts, QuietModule, Registers
from automax_ros.rack.task_config import TaskConfig

COMMON_REGISTERS = {"57C413": 65536, "57C423": 131072}
"""16-bit registers for common variables in slot 0 (J-3636 p. 1-1)."""
NODE = "common_memory"


@dataclass(frozen=True)
class CommonMemoryConfig:
    """The common memory module in slot 0."""

    slot: int
    model: str
    line: int = 0

    tick_ns = 0
    times = Model.NONE
    has_battery = True
    registers: Registers = NO_REGISTERS

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return NODE

    @property
    def tasks(self) -> tuple[TaskConfig, ...]:
        """No tasks: they are never stored here (J2-3106-1 p. 10-2)."""
        return ()

    @property
    def common_registers(self) -> int:
        """16-bit registers that common variables may take."""
        return COMMON_REGISTERS[self.model]

    def build(self, _: Parts) -> Module:
        """Return the module of a running rack."""
        return QuietModule(self)


class CommonMemoryKind:
    """What a rack file may say of a common memory module."""

    word = "common memory"
    models = dict.fromkeys(COMMON_REGISTERS, "common memory module")
    options = ()

    def read(self, found: FoundModule) -> CommonMemoryConfig:
        """Read the section, which has no keys of its own."""
        return CommonMemoryConfig(found.slot, found.model, found.span.line)

    def check_places(self, rack: Arrangement) -> None:
        """Report common memory outside slot 0 (J2-3106-1 p. 10-2)."""
        for item in rack.of(self):
            if item.slot != 0:
                reason = "plain registers, which are not supported yet" if item.slot % 2 == 0 else "not possible"
                message = f"the {item.model} in slot {item.slot} is {reason}"
                rack.findings.add("AMX6208", message, item.span, "common memory stands in slot 0")


COMMON_MEMORY = CommonMemoryKind()
