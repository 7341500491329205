"""What common memory holds before a rack starts."""

from __future__ import annotations

from automax_ros.rack.config import RackConfig
from automax_ros.rack.writers import PRESET_WRITER
from automax_ros.running.memory import CommonMemory
from automax_ros.running.process_inputs import ProcessInputs


def begin_memory(config: RackConfig, inputs: ProcessInputs, memory: CommonMemory) -> None:
    """Write the presets of the rack's file, as the rack itself."""
    for variable in config.variables:
        for element, value in enumerate(variable.presets):
            inputs.write_from_outside(memory.view(variable.name), value, PRESET_WRITER, element)
