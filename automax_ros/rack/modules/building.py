"""Makes the module of a running rack for each kind of configuration: the one table of these pairs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.modules.drive_io import DriveAnalogModule
from automax_ros.rack.modules.io_module import IoModule
from automax_ros.rack.modules.module import Module, ProcessorModule, QuietModule
from automax_ros.rack.modules.network import NetworkModule
from automax_ros.rack.modules.udc import UdcModule
from automax_ros.rack.tasks.services import RackServices
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import full_speeds
from automax_ros.rackfile.modules.common_memory import CommonMemoryConfig
from automax_ros.rackfile.modules.drive import DriveAnalogConfig, DriveConfig
from automax_ros.rackfile.modules.io import IoConfig
from automax_ros.rackfile.modules.network import NetworkConfig
from automax_ros.rackfile.modules.processor import Pc3000Config, ProcessorConfig
from automax_ros.rackfile.modules.udc import UdcConfig


def build_module(config: ModuleConfig, parts: RackServices) -> Module:
    """Return the module of a running rack for a configuration."""
    return _BUILDERS[type(config)](config, parts)


def _processor(config: ProcessorConfig, parts: RackServices) -> Module:
    in_order = sorted(config.tasks, key=lambda item: (item.priority, item.name))
    execution = parts.execution(config.name)
    return ProcessorModule(config, tasks=[parts.install(item, execution) for item in in_order])


def _drive(config: DriveConfig, parts: RackServices) -> Module:
    plant = None if config.plant is None else parts.plants.get(config.plant.name)
    full_rpm = None if config.plant is None else full_speeds(parts.config.feeds).get(config.plant.name)
    return DriveControllerModule(config, parts, plant, full_rpm)


def _drive_analog(config: DriveAnalogConfig, parts: RackServices) -> Module:
    module = DriveAnalogModule(config, parts)
    if config.drive is not None:
        parts.drives.wire_voltage(config.drive, module.show_voltage)
    return module


_BUILDERS: dict[type, Callable[[Any, RackServices], Module]] = {
    ProcessorConfig: _processor,
    Pc3000Config: _processor,
    CommonMemoryConfig: lambda config, _: QuietModule(config),
    IoConfig: IoModule,
    DriveConfig: _drive,
    DriveAnalogConfig: _drive_analog,
    NetworkConfig: NetworkModule,
    UdcConfig: UdcModule,
}
