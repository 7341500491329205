"""The drives of a rack: a plant that a module drives, or a task with a current minor loop, or both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from automax_ros.compile.functions import BUILTINS
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.drive.drive_case import Given
from automax_ros.drive.plant import PlantData
from automax_ros.language.checks.constant_values import constant_value
from automax_ros.language.program import BoundCall, Program
from automax_ros.language.syntax.statement_text import print_expression
from automax_ros.language.syntax.tree import Assignment, Expression, FunctionCall, Reference, Scope, Unary
from automax_ros.language.syntax.walk import statements_in_order
from automax_ros.language.written import places_that_write
from automax_ros.rack.config import RackConfig
from automax_ros.rack.modules.configured import ModuleConfig
from automax_ros.rack.plants.building import plant_data
from automax_ros.rack.plants.config import PlantConfig
from automax_ros.rack.plants.driven import Driving

SLOT = "IO_CNTL_SLOT"
"""The input of the loop that names its 57C406."""


@dataclass(frozen=True)
class RackDrive:
    """One drive of a rack.

    Attributes:
        module: the module that drives it; None where the task names a slot without one.
        slot: its slot.
        letter: A or B where the module has two drives, otherwise "".
        plant: its plant, None for a drive without one.
        program: the task with its current minor loop, None where there is none.
    """

    module: ModuleConfig | None
    slot: int
    letter: str = ""
    plant: PlantConfig | None = None
    program: Program | None = None

    @property
    def name(self) -> str:
        """What it is called: its plant, or its loop's task."""
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
        """What its plant is made of, None without a plant or a motor.

        Raises:
            ParameterError: it cannot be.
        """
        return plant_data(self.plant) if self.plant is not None else None


def rack_drives(config: RackConfig, programs: Iterable[Program]) -> list[RackDrive]:
    """Return the drives of a rack in the order of slots, those of one module in the order of its drives.

    ``programs`` are its tasks as far as they have no errors.
    """
    loops = {slot: program for program in programs if (slot := _slot_of(program)) is not None}
    found: list[RackDrive] = []
    for module in config.modules:
        loop = loops.pop(module.slot, None)
        plants = module.plants if isinstance(module, Driving) else {}
        found += [RackDrive(module, module.slot, item, plant, None if item else loop) for item, plant in plants.items()]
        if loop is not None and "" not in plants:
            found.append(RackDrive(module, module.slot, program=loop))
    found += [RackDrive(None, slot, program=loop) for slot, loop in loops.items()]
    return sorted(found, key=lambda drive: (drive.slot, drive.letter))


def _slot_of(program: Program) -> int | None:
    """Return the slot of the 57C406 that a task's loop commands, None for a task without a loop."""
    slot = program.cml.facts.get(SLOT.lower()) if program.cml is not None else None
    return slot if isinstance(slot, int) else None


def given_inputs(
    drive: RackDrive, config: RackConfig, programs: Iterable[Program], settings: Mapping[str, Value]
) -> dict[str, Given]:
    """Return what is programmed for the inputs of a drive's current minor loop, by keyword, defaults included.

    Of a loop that is in no task only LIM_BAR is known, which is the drive's Motor Overload Ratio (36).

    A variable counts as what ``--set`` gives it, as the one constant that tasks ever assign to it, as the present value
    of a tunable, or as its preset, in this order; otherwise it is not known (decision).
    """
    call = drive.call
    if call is None or drive.program is None:
        ratio = drive.plant.motor_overload_ratio if drive.plant is not None else None
        return {} if ratio is None else {"LIM_BAR": Given(ratio, f"{ratio} (motor_overload_ratio)")}
    assigned = _assigned(drive.program, programs)
    given = {name: _given(value, source_text(value), "default") for name, value in call.defaults.items()}
    for item in call.block.inputs:
        expression = call.arguments.get(item.name)
        if expression is not None:
            given[item.name] = _programmed(expression, drive.program, config, assigned, settings)
    return given


def _given(value: Value | None, text: str, source: str = "") -> Given:
    number = float(value) if isinstance(value, (bool, int, float)) else None
    return Given(number, f"{text} ({source})" if source else text)


def _programmed(
    expression: Expression,
    program: Program,
    config: RackConfig,
    assigned: Mapping[str, Value | None],
    settings: Mapping[str, Value],
) -> Given:
    value = constant_value(expression)
    if value is not None:
        return _given(value, source_text(value))
    operand = expression.operand if isinstance(expression, Unary) else expression
    name = print_expression(operand)
    value, source = _present(name, program, config, assigned, settings)
    if value is None:
        return _given(None, name, "not known")
    if isinstance(expression, Unary):
        value = not value if isinstance(value, bool) else -value if isinstance(value, (int, float)) else value
    return _given(value, f"{print_expression(expression)} = {source_text(value)}", source)


def _present(
    name: str,
    program: Program,
    config: RackConfig,
    assigned: Mapping[str, Value | None],
    settings: Mapping[str, Value],
) -> tuple[Value | None, str]:
    """Return the value of a variable, None where it is not known, and where it comes from."""
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


def _assigned(own: Program, programs: Iterable[Program]) -> dict[str, Value | None]:
    """Return the constants that tasks assign to commons and one task to its locals; None for what else is written."""
    found: dict[str, Value | None] = {}
    for program in programs:
        for name, value in written_constants(program, Scope.COMMON).items():
            found[name] = None if name in found else value
    return found | written_constants(own, Scope.LOCAL)


def written_constants(program: Program, scope: Scope, start: int | None = None) -> dict[str, Value | None]:
    """Return the variables that a task writes, with the value of those that get one constant in one place.

    ``start`` is what a variable held before, for functions such as BIT_SET% of the variable itself; None: not known.
    """
    constants = _constants(program, start)
    return {
        name: constants[name][0] if len(places) == 1 and name in constants else None
        for name, places in places_that_write(program, scope).items()
    }


def _constants(program: Program, start: int | None) -> dict[str, list[Value | None]]:
    """Return what the assignments of a task give each simple variable, None for what is not a constant."""
    found: dict[str, list[Value | None]] = {}
    for statement, _ in statements_in_order((*program.startup, *program.scan)):
        if isinstance(statement, Assignment):
            name = print_expression(statement.target)
            found.setdefault(name, []).append(_value(statement.value, name, start))
    return found


def _value(expression: Expression, name: str, start: int | None) -> Value | None:
    """Return what an expression gives, None where that is not known; ``start`` is what the variable ``name`` held."""
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
