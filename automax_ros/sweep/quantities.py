"""What can vary from run to run: tunables of tasks, commons before RUN, numbers of plants, by the names they have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from automax_ros.core.faults import UserError
from automax_ros.core.names import NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import DataType, Value, bare_name
from automax_ros.core.values import number, value_text, whole_number
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.value_names import Tuning, common_named, setting, tunables_of, tuning
from automax_ros.rackfile.plant_numbers import PlantNumber, plant_number


@dataclass
class Beginning:
    """What one run begins with: other numbers of plants, tunables, and commons as an operator would write them."""

    plants: dict[PlantNumber, str] = field(default_factory=dict)
    tunings: list[Tuning] = field(default_factory=list)
    settings: list[tuple[str, Value]] = field(default_factory=list)


class Quantity(Protocol):
    """Something that varies. ``label`` is its full name; ``text`` writes a value so that it is read as the same one."""

    @property
    def label(self) -> str: ...  # noqa: D102

    def text(self, value: Value, /) -> str: ...  # noqa: D102

    def give(self, value: Value, beginning: Beginning) -> None:
        """Let a run begin with a value."""
        ...


@dataclass(frozen=True)
class VariedTunable:
    """A tunable of a task, ``name`` with its type character."""

    task: str
    name: str

    @property
    def label(self) -> str:
        """``TASK.NAME``."""
        return f"{self.task}.{bare_name(self.name)}"

    def text(self, value: Value) -> str:
        """Return a value as it is read."""
        return value_text(value)

    def give(self, value: Value, beginning: Beginning) -> None:
        """Tune it before RUN."""
        beginning.tunings.append(Tuning(self.task, self.name, value))


@dataclass(frozen=True)
class VariedCommon:
    """A simple common, or an element of an array; ``label`` has its subscripts."""

    label: str

    def text(self, value: Value) -> str:
        """Return a value as it is read."""
        return value_text(value)

    def give(self, value: Value, beginning: Beginning) -> None:
        """Write it before RUN, after the presets."""
        beginning.settings.append((self.label, value))


@dataclass(frozen=True)
class VariedPlant:
    """A number of a plant."""

    number: PlantNumber

    @property
    def label(self) -> str:
        """``PLANT.key.key``."""
        return self.number.label

    def text(self, value: Value) -> str:
        """Return a value as it is read."""
        return repr(value)

    def give(self, value: Value, beginning: Beginning) -> None:
        """Build the plant with it."""
        beginning.plants[self.number] = self.text(value)


@dataclass(frozen=True)
class Variable:
    """A quantity with what it takes: ``accepted`` returns the value that a text gives it, or raises Fault.

    ``is_whole``: whole numbers alone; ``is_number``: it has values between others.
    """

    quantity: Quantity
    accepted: Callable[[str], Value]
    is_whole: bool = False
    is_number: bool = True


def variable_named(rack: Rack, text: str) -> Variable:
    """Return what a name means: ``REF%``, ``TABLE%(3)``, ``SPEED.KP``, ``UNWIND.load.torque_nm``.

    Where a task and a plant have one name, the task's tunables come first (decision).

    Raises:
        Fault: there is no such thing, or it cannot vary.
    """
    owner, dot, name = text.partition(".")
    if not dot:
        return _common(rack, text)
    owner = owner.strip().upper()
    tasks = {task.name for task in rack.tasks}
    plants = {plant.name for plant in rack.config.plants}
    if owner in tasks and (owner not in plants or _is_tunable(rack, owner, name)):
        return _tunable(rack, owner, name)
    if owner in plants:
        return _plant(rack, text)
    raise UserError(
        f"the rack has no task and no plant {quoted(owner)}", near_or_listed(owner, sorted(tasks | plants), "")
    )


def _common(rack: Rack, text: str) -> Variable:
    try:
        meant = common_named(rack.config, text)
    except NameFault as fault:
        raise UserError(fault.message, _tunable_hint(rack, text) or fault.hint) from fault
    kind = meant.variable.type

    def accepted(given: str) -> Value:
        return setting(rack.config, f"{meant.label}={given}")[1]

    return Variable(VariedCommon(meant.label), accepted, kind.is_integer, kind.is_numeric)


def _tunable_hint(rack: Rack, text: str) -> str | None:
    """Return the hint that a name without its task is a tunable's; None where no task has one of it."""
    wanted = text.strip().upper()
    owners = [task.name for task in rack.tasks if _is_tunable(rack, task.name, wanted)]
    return (
        f"a tunable belongs to its task: write {' or '.join(f'{name}.{wanted}' for name in owners)}" if owners else None
    )


def _is_tunable(rack: Rack, task: str, name: str) -> bool:
    known = tunables_of(rack.task(task).compiled.program)
    return name.strip().upper() in {*known, *map(bare_name, known)}


def _tunable(rack: Rack, owner: str, name: str) -> Variable:
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

    return Variable(VariedTunable(owner, full), accepted, known[full].type is not DataType.REAL)


def _plant(rack: Rack, text: str) -> Variable:
    found = plant_number(rack.config, text)

    def accepted(given: str) -> Value:
        try:
            value = whole_number(given) if found.is_whole else number(given)
        except ValueError as error:
            raise UserError(f"{found.label}: {error}") from None
        if not found.low <= value <= found.high:
            raise UserError(f"{found.label} = {value:.10g} lies outside {found.low:.10g} to {found.high:.10g}")
        return value

    return Variable(VariedPlant(found), accepted, found.is_whole)
