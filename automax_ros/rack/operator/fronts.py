"""The lamps on the fronts of a rack's modules: those that a source names, and one for each I/O point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from automax_ros.rack.base.views import bank_views
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.common_memory import CommonMemoryConfig
from automax_ros.rackfile.modules.io import DIGITAL_IO
from automax_ros.rackfile.modules.processor import ProcessorConfig

_LAMP_REGISTERS, _BITS = 2, 16
"""The first registers of a digital module are its points; those after them have no lamps."""
Register = tuple[int, int]
"""The view of a module's registers, and a register's number."""


@dataclass(frozen=True)
class Lamp:
    """A lamp: ``colour`` is that of its light; a point is named like its common."""

    name: str
    on: bool
    colour: str = "green"


class Fronts:
    """The fronts of one rack. ``registers`` are those that points show."""

    def __init__(self, config: RackConfig) -> None:
        banks = bank_views(config.variables)
        points = ((item.point, item.name) for item in config.variables)
        self._names = {(point.slot, point.register, point.bit): name for point, name in points if point is not None}
        self._points = {
            module.slot: [
                (banks[module.slot], number) for number in range(min(module.registers.count, _LAMP_REGISTERS))
            ]
            for module in config.modules
            if module.model in DIGITAL_IO.models
        }
        self.registers: list[Register] = [item for points in self._points.values() for item in points]

    def lamps(
        self, module: ModuleConfig, words: Mapping[Register, int], *, powered: bool, battery_good: bool
    ) -> Iterable[Lamp]:
        """Return the lamps of a module; ``words`` are the present values of ``registers``, as far as they are known.

        The OK lamp of a Processor stays on with every code on its display (decision: no fault here is one that shuts it
        down). Inputs are green, outputs amber (decision).
        """
        if isinstance(module, ProcessorConfig):
            yield Lamp("OK", powered)
        if module.has_battery:
            yield Lamp("BAT.OK", powered and battery_good)
        if isinstance(module, CommonMemoryConfig) and not module.slot:
            yield Lamp("SYSTEM WATCHDOG", powered)
        for view, register in self._points.get(module.slot, ()):
            colour = "green" if module.registers.direction(register) == "input" else "amber"
            for bit in range(_BITS):
                name = self._names.get((module.slot, register, bit), f"{register}.{bit}")
                yield Lamp(name, powered and bool(words.get((view, register), 0) >> bit & 1), colour)
