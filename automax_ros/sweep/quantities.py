"""Quantities that vary from run to run, by name: tunables of tasks, commons before RUN, numbers of plants and webs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from automax_ros.core.names import NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import DataType, Value, bare_name
from automax_ros.core.user_error import UserError
from automax_ros.core.values import number, value_text, whole_number
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.value_names import TunableSetting, setting, tunables_of, tuning
from automax_ros.rackfile.plant_numbers import PlantNumber, plant_number


@dataclass
class Beginning:
    """Start values of one run: other numbers of plants, tunables, and commons as an operator would write them."""

    plants: dict[PlantNumber, str] = field(default_factory=dict)
    tunings: list[TunableSetting] = field(default_factory=list)
    settings: list[tuple[str, Value]] = field(default_factory=list)


@dataclass(frozen=True)
class Quantity:
    """A quantity that varies: a number of a plant, a tunable of a task, or a common.

    ``label`` is its full name: ``PLANT.key.key``, ``TASK.NAME``, or a common with its subscripts. ``tunable`` is the
    task with the tunable's name and type character.
    """

    label: str
    plant: PlantNumber | None = None
    tunable: tuple[str, str] | None = None

    def text(self, value: Value) -> str:
        """Return a value as text that is read as the same value."""
        return value_text(value) if self.plant is None else repr(value)

    def give(self, value: Value, beginning: Beginning) -> None:
        """Add a value to a run's start values: tunings and writes are made before RUN, writes after the presets."""
        if self.plant is not None:
            beginning.plants[self.plant] = self.text(value)
        elif self.tunable is not None:
            beginning.tunings.append(TunableSetting(*self.tunable, value))
        else:
            beginning.settings.append((self.label, value))


@dataclass(frozen=True)
class VariedVariable:
    """A quantity with its rules: ``accepted`` returns the value that a text gives it, or raises UserError.

    ``is_whole``: only whole numbers; ``is_number``: it has values between others.
    """

    quantity: Quantity
    accepted: Callable[[str], Value]
    is_whole: bool = False
    is_number: bool = True


def variable_named(rack: Rack, text: str) -> VariedVariable:
    """Return the quantity with a name: ``REF%``, ``TABLE%(3)``, ``SPEED.KP``, ``UNWIND.load.torque_nm``.

    If a task and a plant have the same name, the task's tunables come first (decision).

    Raises:
        UserError: there is no such quantity, or it cannot vary.
    """
    owner, dot, name = text.partition(".")
    if not dot:
        return _common(rack, text)
    owner = owner.strip().upper()
    tasks = {task.name for task in rack.tasks}
    plants = {plant.name for plant in rack.config.plants} | {web.name for web in rack.config.webs}
    if owner in tasks and (owner not in plants or _is_tunable(rack, owner, name)):
        return _tunable(rack, owner, name)
    if owner in plants:
        return _plant(rack, text)
    raise UserError(
        f"the rack has no task and no plant {quoted(owner)}", near_or_listed(owner, sorted(tasks | plants), "")
    )


def _common(rack: Rack, text: str) -> VariedVariable:
    try:
        meant = rack.config.common(text)
    except NameFault as fault:
        raise UserError(fault.message, _tunable_hint(rack, text) or fault.hint) from fault
    kind = meant.variable.type

    def accepted(given: str) -> Value:
        return setting(rack.config, f"{meant.label}={given}")[1]

    return VariedVariable(Quantity(meant.label), accepted, kind.is_integer, kind.is_numeric)


def _tunable_hint(rack: Rack, text: str) -> str | None:
    wanted = text.strip().upper()
    owners = [task.name for task in rack.tasks if _is_tunable(rack, task.name, wanted)]
    return (
        f"a tunable belongs to its task: write {' or '.join(f'{name}.{wanted}' for name in owners)}" if owners else None
    )


def _is_tunable(rack: Rack, task: str, name: str) -> bool:
    known = tunables_of(rack.task(task).compiled.program)
    return name.strip().upper() in {*known, *map(bare_name, known)}


def _tunable(rack: Rack, owner: str, name: str) -> VariedVariable:
    task = rack.task(owner)
    program = task.compiled.program
    known = tunables_of(program)
    wanted = name.strip().upper()
    full = wanted if wanted in known else {bare_name(item): item for item in known}.get(wanted)
    if full is None:
        hint = near_or_listed(wanted, known, f"{owner}.") or "it has none"
        raise UserError(f"task {owner} has no tunable {quoted(wanted)}", hint)

    def accepted(given: str) -> Value:
        value = tuning({owner: program}, f"{owner}.{full}={given}").value
        try:
            return task.tuning(full, value)
        except ValueError as error:
            raise UserError(f"{owner}.{error}") from None

    quantity = Quantity(f"{owner}.{bare_name(full)}", tunable=(owner, full))
    return VariedVariable(quantity, accepted, known[full].type is not DataType.REAL)


def _plant(rack: Rack, text: str) -> VariedVariable:
    found = plant_number(rack.config, text)

    def accepted(given: str) -> Value:
        try:
            value = whole_number(given) if found.is_whole else number(given)
        except ValueError as error:
            raise UserError(f"{found.label}: {error}") from None
        if not found.low <= value <= found.high:
            raise UserError(f"{found.label} = {value:.10g} lies outside {found.low:.10g} to {found.high:.10g}")
        return value

    return VariedVariable(Quantity(found.label, plant=found), accepted, found.is_whole)
