"""Digital input and output modules: registers of 16 points, and nothing that they do by themselves.

No source at hand gives their register maps; these are ours (decision): a 57C419 has 32 inputs in the registers 0 and 1,
a 57C402 or 57C403 16 outputs in register 0, a 57C408 16 inputs in register 0 and 16 outputs in register 1.
"""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.compile.cost import Model
from automax_ros.rack.modules.kind import Arrangement, FoundModule, Module, Parts, QuietModule, Registers
from automax_ros.rack.task_config import TaskConfig

_REGISTERS = {
    "57C402": Registers(1, outputs=range(1)),
    "57C403": Registers(1, outputs=range(1)),
    "57C408": Registers(2, outputs=range(1, 2)),
    "57C419": Registers(2),
}


@dataclass(frozen=True)
class DigitalIoConfig:
    """A digital module in any slot."""

    slot: int
    model: str
    line: int = 0

    tick_ns = 0
    times = Model.NONE
    has_battery = False
    common_registers = 0

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"digital_io_{self.slot}"

    @property
    def tasks(self) -> tuple[TaskConfig, ...]:
        """No tasks."""
        return ()

    @property
    def registers(self) -> Registers:
        """Its registers."""
        return _REGISTERS[self.model]

    def build(self, parts: Parts) -> Module:
        """Return the module of a running rack: STOP ALL clears its outputs, its inputs go on (J2-3106-1 p. 10-6)."""
        bank = parts.backplane.bank(self.slot)
        assert bank is not None
        return QuietModule(self, parts.memory.registers.apart_from(bank.view, bank.writable, bank.registers))


class DigitalIoKind:
    """What a rack file may say of a digital module."""

    word = "digital I/O"
    models = {  # noqa: RUF012
        "57C402": "digital output module",
        "57C403": "digital output module",
        "57C408": "drive digital I/O module",
        "57C419": "32-channel digital input module",
    }
    options = ()

    def read(self, found: FoundModule) -> DigitalIoConfig:
        """Read the section, which has no keys of its own."""
        return DigitalIoConfig(found.slot, found.model, found.span.line)

    def check_places(self, rack: Arrangement) -> None:
        """Find nothing wrong: no source tells of a slot where these modules may not stand."""


DIGITAL_IO = DigitalIoKind()
