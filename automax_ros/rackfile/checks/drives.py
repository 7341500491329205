"""The drives of a rack: a plant that a module drives, or a task with a current minor loop, or both.

``drive_cases`` combines the rack file and its tasks into the drives that ``drive/assess/assessment`` judges.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi, sqrt

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.base.functions import BUILTINS
from automax_ros.compile.scan_times import command_ns
from automax_ros.core.ticks import NS_PER_US
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.drive.assess.drive_case import Computing, DriveCase, GivenValue, RollCase, Unjudged
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.plant import PlantData
from automax_ros.drive.web.data import Roll
from automax_ros.language.checks.rules.constant_values import constant_value
from automax_ros.language.printer import print_expression
from automax_ros.language.program import BoundCall, Program, places_that_write
from automax_ros.language.tree.tree import Assignment, Expression, FunctionCall, Reference, Scope, Unary
from automax_ros.language.tree.walk import statements_in_order
from automax_ros.rackfile.checks.register_writes import numbered_writes
from automax_ros.rackfile.model.config import IoPoint, RackConfig, Timing
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import PlantConfig, plant_data
from automax_ros.rackfile.modules.drive import DEFAULTS, OPTIONS, PERIOD_STEP, PHASE_STEP, TACH_THRESHOLD
from automax_ros.rackfile.modules.processor import PROCESSOR

SLOT = "IO_CNTL_SLOT"
"""The input of the loop that names its 57C406."""


@dataclass(frozen=True)
class RackDrive:
    """One drive of a rack: its module, None if the task names an empty slot, and its plant.

    ``letter`` is A or B if the module has two drives, otherwise ""; ``program`` the task with its current minor loop.
    """

    module: ModuleConfig | None
    slot: int
    letter: str = ""
    plant: PlantConfig | None = None
    program: Program | None = None

    @property
    def name(self) -> str:
        """The drive's name: that of its plant, or of its loop's task."""
        if self.plant is not None:
            return self.plant.name
        return self.program.name if self.program is not None else f"slot {self.slot}{self.letter}"

    @property
    def where(self) -> str:
        """The module in words."""
        if self.module is None:
            return f"no module in slot {self.slot}"
        return f"{self.module.model} in slot {self.slot}{f', drive {self.letter}' if self.letter else ''}"

    @property
    def call(self) -> BoundCall | None:
        """The CALL of its current minor loop."""
        return self.program.cml if self.program is not None else None

    @property
    def data(self) -> PlantData | None:
        """The data of its plant, None without a plant or a motor.

        Raises:
            ParameterError: such a plant is impossible.
        """
        return plant_data(self.plant) if self.plant is not None else None


def rack_drives(config: RackConfig, programs: Iterable[Program]) -> list[RackDrive]:
    """Return the drives of a rack in the order of slots, those of one module in the order of its drives.

    ``programs`` are the rack's tasks without errors.
    """
    slots = ((program.cml.facts.get(SLOT.lower()), program) for program in programs if program.cml is not None)
    loops = {slot: program for slot, program in slots if isinstance(slot, int)}
    found: list[RackDrive] = []
    for module in config.modules:
        loop = loops.pop(module.slot, None)
        plants = module.plants
        found += [RackDrive(module, module.slot, item, plant, None if item else loop) for item, plant in plants.items()]
        if loop is not None and "" not in plants:
            found.append(RackDrive(module, module.slot, program=loop))
    found += [RackDrive(None, slot, program=loop) for slot, loop in loops.items()]
    return sorted(found, key=lambda drive: (drive.slot, drive.letter))


def given_inputs(
    drive: RackDrive, config: RackConfig, programs: Iterable[Program], settings: Mapping[str, Value]
) -> dict[str, GivenValue]:
    """Return the programmed inputs of a drive's current minor loop, by keyword, defaults included.

    Of a loop that is in no task only LIM_BAR is known, which is the drive's Motor Overload Ratio (36).

    A variable counts as its value from ``--set``, as the one constant that tasks ever assign to it, as the present
    value of a tunable, or as its preset, in this order; otherwise it is not known (decision).
    """
    call = drive.call
    if call is None or drive.program is None:
        ratio = drive.plant.motor_overload_ratio if drive.plant is not None else None
        return {} if ratio is None else {"LIM_BAR": GivenValue(ratio, f"{ratio} (motor_overload_ratio)")}
    assigned: dict[str, Value | None] = {}
    for program in programs:
        for name, value in written_constants(program, Scope.COMMON).items():
            assigned[name] = None if name in assigned else value
    assigned |= written_constants(drive.program, Scope.LOCAL)
    given = {name: _make_given(value, source_text(value), "default") for name, value in call.defaults.items()}
    for item in call.block.inputs:
        expression = call.arguments.get(item.name)
        if expression is not None:
            given[item.name] = _evaluate_programmed(expression, drive.program, config, assigned, settings)
    return given


def _make_given(value: Value | None, text: str, source: str = "") -> GivenValue:
    number = float(value) if isinstance(value, (bool, int, float)) else None
    return GivenValue(number, f"{text} ({source})" if source else text)


def _evaluate_programmed(
    expression: Expression,
    program: Program,
    config: RackConfig,
    assigned: Mapping[str, Value | None],
    settings: Mapping[str, Value],
) -> GivenValue:
    value = constant_value(expression)
    if value is not None:
        return _make_given(value, source_text(value))
    operand = expression.operand if isinstance(expression, Unary) else expression
    name = print_expression(operand)
    value, source = _present(name, program, config, assigned, settings)
    if value is None:
        return _make_given(None, name, "not known")
    if isinstance(expression, Unary):
        value = not value if isinstance(value, bool) else -value if isinstance(value, (int, float)) else value
    return _make_given(value, f"{print_expression(expression)} = {source_text(value)}", source)


def _present(
    name: str,
    program: Program,
    config: RackConfig,
    assigned: Mapping[str, Value | None],
    settings: Mapping[str, Value],
) -> tuple[Value | None, str]:
    """Return the value of a variable, None if it is not known, and its source."""
    if name in settings:
        return settings[name], "--set"
    if name in assigned:
        return assigned[name], "assigned"
    symbol = program.symbols.get(name)
    if symbol is not None and symbol.tuning is not None:
        return symbol.tuning.current, "tunable"
    variable = config.by_name.get(name)
    if variable is not None and not variable.is_array and variable.presets:
        return variable.presets[0], "preset"
    return None, ""


def written_constants(program: Program, scope: Scope, start: int | None = None) -> dict[str, Value | None]:
    """Return the variables that a task writes, with the value of those that get one constant in one place.

    ``start`` is a variable's value before, for functions such as BIT_SET% of the variable itself; None: not known.
    """
    constants: dict[str, list[Value | None]] = {}
    for statement, _ in statements_in_order((*program.startup, *program.scan)):
        if isinstance(statement, Assignment):
            name = print_expression(statement.target)
            constants.setdefault(name, []).append(_value(statement.value, name, start))
    return {
        name: constants[name][0] if len(places) == 1 and name in constants else None
        for name, places in places_that_write(program, scope).items()
    }


def _value(expression: Expression, name: str, start: int | None) -> Value | None:
    """Return the value of an expression, None if it is not known; ``start`` was the value of the variable ``name``."""
    if isinstance(expression, Reference) and expression.name == name:
        return start
    if not isinstance(expression, FunctionCall) or expression.name not in BUILTINS:
        return constant_value(expression)
    arguments = [_value(item, name, start) for item in expression.arguments]
    if None in arguments:
        return None
    builtin = BUILTINS[expression.name]
    result = builtin.carry_out(*arguments)
    if builtin.fallible:
        assert isinstance(result, tuple)
        result = result[0]
    return result if isinstance(result, (bool, int, float, str)) else None


def drive_cases(
    config: RackConfig, programs: Sequence[Program], settings: Mapping[str, Value]
) -> list[DriveCase | Unjudged]:
    """Return the drives of a rack, in the order of slots; ``settings`` are the commons' values from ``--set``."""
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
        voltage=any(module.drive == drive.slot for module in config.modules),
        registers=not drive.letter,
        computing=_computing(drive, config),
        roll=_roll(drive.plant, config),
    )


def _roll(plant: PlantConfig | None, config: RackConfig) -> RollCase | None:
    surface = plant.surface if plant is not None else None
    if plant is None or surface is None or not isinstance(surface.surface, Roll):
        return None
    web = next((item for item in config.webs if plant.name in (item.start, item.end)), None)
    scales = {
        signal: abs(feed.scale.counts[1] - feed.scale.counts[0]) / abs(feed.scale.value[1] - feed.scale.value[0])
        for feed in reversed(config.feeds)
        if feed.scale is not None and feed.plant in (plant.name, web.name if web is not None else "")
        for signal in ("speed" if feed.signal in ("tach_rpm", "speed_rpm") else feed.signal,)
    }
    return RollCase(
        surface.surface,
        surface.gear,
        full_diameter(plant.name, surface.surface, config),
        web.data.stiffness_n if web is not None else None,
        web.data.length_m if web is not None else 1.0,
        scales.get("speed"),
        scales.get("tension_n"),
    )


def full_diameter(name: str, roll: Roll, config: RackConfig) -> float:
    """Return the diameter of a full roll, m: the given one, or for a winder that with all of its unwinder's web.

    The web is as thick on the winder as its own caliper says (decision).
    """
    starts, plants = {item.end: item.start for item in config.webs}, {item.name: item for item in config.plants}
    at = name
    while at in starts:
        at = starts[at]
    source = plants[at].surface
    if at == name or source is None or not isinstance(source.surface, Roll):
        return roll.diameter_m
    stock_m = source.surface.wound_m(source.surface.diameter_m)
    return sqrt(roll.diameter_m**2 + 4 / pi * roll.caliper_um * 1e-6 * stock_m)


def _computing(drive: RackDrive, config: RackConfig) -> Computing | None:
    program = drive.program
    if program is None:
        return None
    model = next(module.model for module, task in config.placed_tasks if task.name == program.name)
    times_us = {item: command_ns(program, CostModel(Model(item))) / NS_PER_US for item in PROCESSOR.models}
    slowest = max(times_us, key=lambda item: times_us[item])
    modeled, sixth_us = config.execution is Timing.MODELED, program.period_ns / NS_PER_US
    return Computing(modeled, model, times_us[model], slowest, times_us[slowest], sixth_us)


@dataclass(frozen=True)
class _Registers:
    """Values of the registers of a 57C406 after the tasks have initialised them, if they can be known.

    The loop's task gives them their defaults: presets and ``--set`` do not count, later writes of tasks do (52.4.1).
    """

    config: RackConfig
    slot: int
    programs: Sequence[Program]

    def given(self, register: int) -> GivenValue:
        return _of(self._words(register), DEFAULTS[register])

    def bit_0(self, register: int) -> GivenValue:
        words = [None if word is None else word & 1 for word in self._words(register)]
        return _of([*words, *self._points(register, 0)], DEFAULTS[register] & 1)

    def _words(self, register: int) -> list[int | None]:
        numbered = numbered_writes(self.programs).get((self.slot, register), [])
        return [*self._points(register, None), *numbered]

    def _points(self, register: int, bit: int | None) -> list[int | None]:
        place = IoPoint(self.slot, register, bit)
        names = {variable.name for variable in self.config.declared if variable.point == place}
        written = (
            item
            for program in self.programs
            for item in written_constants(program, Scope.COMMON, DEFAULTS[register]).items()
        )
        return [None if value is None else int(value) for name, value in written if name in names]


def _of(written: Sequence[int | None], default: int) -> GivenValue:
    if not written:
        return GivenValue(default, f"{default} (default)")
    if None in written or len(set(written)) > 1:
        return GivenValue(None, "written by tasks, value not known")
    return GivenValue(written[0], f"{written[0]} (written by a task)")
