"""What common memory holds before a rack starts."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.names import AUTO_RUN
from automax_ros.rack.config import RackConfig
from automax_ros.rack.modules.running import Module
from automax_ros.rack.writers import PRESET_WRITER
from automax_ros.running.memory import CommonMemory
from automax_ros.running.process_inputs import ProcessInputs


def begin_memory(config: RackConfig, inputs: ProcessInputs, memory: CommonMemory) -> None:
    """Write the presets of the rack's file, as the rack itself."""
    for variable in config.variables:
        for element, value in enumerate(variable.presets):
            inputs.write_from_outside(memory.view(variable.name), value, PRESET_WRITER, element)


def write_status(config: RackConfig, modules: Sequence[Module], memory: CommonMemory, *, battery_good: bool) -> None:
    """Set AUTORUNSTATUS@, and BATTERYSTATUSn@ of the slots that hold a module with a battery (2.4.6)."""
    shown = {f"BATTERYSTATUS{item.config.slot}@": battery_good for item in modules if item.config.has_battery}
    shown[AUTO_RUN] = config.auto_run
    for view, spec in enumerate(memory.specs):
        if spec.name in shown:
            memory.write_from_outside(view, shown[spec.name], PRESET_WRITER)
