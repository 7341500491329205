"""The node of an I/O module: ``digital_io_SLOT``, ``analog_io_SLOT``, ``pulsetach_SLOT``, ``drive_SLOT`` and others.

Publishes: its part of ``/diagnostics``, with its registers. Its points are common variables, which have their own
topics (``common_memory``).
"""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus

from automax_ros.rack.modules.module import Module
from automax_ros.ros.base.node import ModuleNode, RackContext


class IoModuleNode(ModuleNode):
    """Serves one I/O module."""

    def __init__(self, rack_context: RackContext, module: Module) -> None:
        super().__init__(rack_context, module.config.name)
        self._module = module.config
        self._bank = rack_context.rack.backplane.bank(module.config.slot)
        registers = module.config.registers
        self._shown = [number for number in range(registers.count) if number not in registers.reserved]
        self.diagnose(self._health)

    def _health(self, _: int) -> list[DiagnosticStatus]:
        values = {}
        if self._bank is not None:
            for register in self._shown:
                word = self.rack_context.rack.memory.read_now(self._bank.view, register)
                values[f"register_{register}"] = f"{int(word) & 0xFFFF:04X}H"
        return [self.status(self._module.model, DiagnosticStatus.OK, "running", self._module.slot, values)]
