"""The drives of a rack as ``drive/assessment`` judges them: what the rack file and its tasks say, put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from automax_ros.compile.cost import CostModel, Model
from automax_ros.compile.scan_times import command_ns
from automax_ros.core.ticks import NS_PER_US
from automax_ros.core.types import Value
from automax_ros.drive.drive_case import Computing, DriveCase, Given, Unjudged
from automax_ros.drive.errors import ParameterError
from automax_ros.language.program import Program
from automax_ros.language.syntax.tree import Scope
from automax_ros.rack.config import Point, RackConfig, Timing
from automax_ros.rack.drives import RackDrive, given_inputs, rack_drives, written_constants
from automax_ros.rack.modules.drive_config import DEFAULTS, OPTIONS, PERIOD_STEP, PHASE_STEP, TACH_THRESHOLD
from automax_ros.rack.modules.processor import PROCESSOR
from automax_ros.rack.register_writes import numbered_writes


@runtime_checkable
class _WiredToDrive(Protocol):
    drive: int | None
    """The slot of the 57C406 whose armature voltage it gets."""


def drive_cases(
    config: RackConfig, programs: Sequence[Program], settings: Mapping[str, Value]
) -> list[DriveCase | Unjudged]:
    """Return the drives of a rack, in the order of slots; ``settings`` are what ``--set`` gives commons."""
    return [_case(drive, config, programs, settings) for drive in rack_drives(config, programs)]


def _case(
    drive: RackDrive, config: RackConfig, programs: Sequence[Program], settings: Mapping[str, Value]
) -> DriveCase | Unjudged:
    try:
        data = drive.data
    except ParameterError as error:
        return Unjudged(drive.name, drive.where, str(error))
    if data is None:
        lacking = "a motor" if drive.plant is not None else "a plant"
        return Unjudged(drive.name, drive.where, f"without {lacking} in the rack file there is nothing to compute from")
    registers = _Registers(config, drive.slot, programs)
    inputs = given_inputs(drive, config, programs, settings)
    return DriveCase(
        name=drive.name,
        where=drive.where,
        parameters=data.parameters,
        inertia=data.inertia,
        source_ohm=data.resistance_ohm,
        task=drive.program.name if drive.program is not None else "",
        inputs=inputs,
        threshold=registers.given(TACH_THRESHOLD),
        phase_step=registers.given(PHASE_STEP),
        period_step=registers.given(PERIOD_STEP),
        fast_change=registers.bit_0(OPTIONS),
        voltage=any(_is_wired(module, drive.slot) for module in config.modules),
        registers=not drive.letter,
        computing=_computing(drive, config),
    )


def _computing(drive: RackDrive, config: RackConfig) -> Computing | None:
    """Return how long the scans of a drive's task compute, on its Processor and on the slowest that may run it."""
    program = drive.program
    if program is None:
        return None
    model = next(module.model for module, task in config.placed_tasks if task.name == program.name)
    times_us = {item: command_ns(program, CostModel(Model(item))) / NS_PER_US for item in PROCESSOR.models}
    slowest = max(times_us, key=lambda item: times_us[item])
    modeled, sixth_us = config.execution is Timing.MODELED, program.period_ns / NS_PER_US
    return Computing(modeled, model, times_us[model], slowest, times_us[slowest], sixth_us)


def _is_wired(module: object, slot: int) -> bool:
    return isinstance(module, _WiredToDrive) and module.drive == slot


@dataclass(frozen=True)
class _Registers:
    """What the registers of a 57C406 hold once the tasks have initialised them, as far as it can be known.

    The loop's task gives them their defaults: presets and ``--set`` do not count, what tasks write later does (52.4.1).
    """

    config: RackConfig
    slot: int
    programs: Sequence[Program]

    def given(self, register: int) -> Given:
        """Return a register's value."""
        return _of(self._words(register), DEFAULTS[register])

    def bit_0(self, register: int) -> Given:
        """Return whether bit 0 of a register is on."""
        words = [None if word is None else word & 1 for word in self._words(register)]
        return _of([*words, *self._points(register, 0)], DEFAULTS[register] & 1)

    def _words(self, register: int) -> list[int | None]:
        numbered = numbered_writes(self.programs).get((self.slot, register), [])
        return [*self._points(register, None), *numbered]

    def _points(self, register: int, bit: int | None) -> list[int | None]:
        """Return what tasks write to the points of a register, or of one of its bits."""
        place = Point(self.slot, register, bit)
        names = {variable.name for variable in self.config.declared if variable.point == place}
        written = (
            item
            for program in self.programs
            for item in written_constants(program, Scope.COMMON, DEFAULTS[register]).items()
        )
        return [None if value is None else int(value) for name, value in written if name in names]


def _of(written: Sequence[int | None], default: int) -> Given:
    if not written:
        return Given(default, f"{default} (default)")
    if None in written or len(set(written)) > 1:
        return Given(None, "written by tasks, value not known")
    return Given(written[0], f"{written[0]} (written by a task)")
