"""Checks that drives have plants and plants have drives.

A plant is driven where a module names it and a task works that drive: one with a DC_DRIVE_CML for a 57C406, one that
writes command registers for a UDC. What a coupling or a web joins to a plant that is driven is turned by that one, and
a shaft that is held at a speed by what holds it (decision).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.drive.pmi.registers import DRIVE_B
from automax_ros.language.program import Program, lines_that_write
from automax_ros.rackfile.checks.common_use import Finding, first_word
from automax_ros.rackfile.checks.register_writes import numbered_writes
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.webs import joined_plants
from automax_ros.rackfile.modules.drive import DriveConfig


def drives_without_plant(config: RackConfig, programs: Mapping[str, Program]) -> Iterator[Finding]:
    """Yield the 57C406 of current minor loops that have no plant (AMX6498), by slot."""
    drives = {module.slot: module for module in config.modules if isinstance(module, DriveConfig)}
    for program in programs.values():
        drive = drives.get(_slot_of_loop(program))
        if drive is not None and drive.plant is None:
            message = (
                f"the {drive.model} in slot {drive.slot} has no plant: task {program.name} finds no line and no motor"
            )
            hint = f"write plant: NAME in slot {drive.slot}, and the plant under plants: (docs/plants.md)"
            yield str(drive.slot), Diagnostic("AMX6498", message, first_word(config, drive.line), hint=hint)


def plants_without_drive(config: RackConfig, programs: Mapping[str, Program]) -> Iterator[Finding]:
    """Yield the plants that nothing drives (AMX6499), by name."""
    joined = joined_plants(config.plants, config.webs)
    places = {plant.name: (module, drive) for module in config.modules for drive, plant in module.plants.items()}
    worked = {name for name, place in places.items() if _is_worked(*place, config, programs)}
    moved = worked | {plant.name for plant in config.plants if plant.load.speed_rpm is not None}
    for plant in config.plants:
        place = places.get(plant.name)
        if not moved.isdisjoint(joined[plant.name]):
            continue
        if place is None:
            why = "no module names it"
            hint = "write plant: NAME at its 57C406, or plants: {A: NAME} at its UDC; or take it out"
        elif plant.motor is None:
            continue
        else:
            why, hint = _idle(*place)
        message = f"nothing drives the plant {plant.name}: {why}"
        yield plant.name, Diagnostic("AMX6499", message, first_word(config, plant.line), hint=hint)


def _idle(module: ModuleConfig, drive: str) -> tuple[str, str]:
    if isinstance(module, DriveConfig):
        why = f"no task has a DC_DRIVE_CML for the {module.model} in slot {module.slot}"
        return why, f"is a task missing, or its IO_CNTL_SLOT={module.slot}?"
    why = f"no task writes the command registers of drive {drive} in slot {module.slot}"
    return why, "is a task missing?"


def _is_worked(module: ModuleConfig, drive: str, config: RackConfig, programs: Mapping[str, Program]) -> bool:
    if isinstance(module, DriveConfig):
        return any(_slot_of_loop(program) == module.slot for program in programs.values())
    first = DRIVE_B if drive == "B" else 0
    commands = frozenset(number for number in module.registers.commands if first <= number < first + DRIVE_B)
    written = {name for program in programs.values() for name in lines_that_write(program)}
    named = {
        item.name
        for item in config.declared
        if item.point is not None and item.point.slot == module.slot and item.point.register in commands
    }
    numbered = numbered_writes(programs.values())
    return bool(named & written) or any(slot == module.slot and number in commands for slot, number in numbered)


def _slot_of_loop(program: Program) -> int:
    """Return the slot of the 57C406 of a task's current minor loop, -1 for a task without one."""
    return -1 if program.cml is None else int(program.cml.facts["io_cntl_slot"])
