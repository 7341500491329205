"""The processes of a distributed rack: which modules need their own process, and which must share one.

Exchange through registers and common variables crosses from process to process. Anything else must stay in one process:
modules share a process where one acts on another at an instant of rack time, and only there (decision). So these share
one:

- a Processor, the 57C406 whose gates one of its tasks fires, and the drive digital I/O module of that drive (52.1.1);
- a 57C405 and the 57C406 whose armature voltage is wired to it (52.6.1);
- modules whose plants are joined by couplings or webs, other plants between them too: they are one mechanical system;
- a module that interrupts and the Processors with an EVENT for that interrupt (J-3675 p. 6-17);
- the modules of tasks that declare one software event, or that open one channel (J-3675 p. 6-17, 6-20).

The common clock joins none of them (decision): which module drives it is a bit of a register, and each process follows
that bit on its own image. Neither do plants that feed commons, nor forces, STOP ALL or power: they cross as writes and
orders.

A process is named after its first module.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.user_error import UserError
from automax_ros.language.program import Program
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig, driven_plants
from automax_ros.rackfile.model.webs import joined_plants

MEMORY_PROCESS = "common_memory"
"""Name of the process with common memory, as that of its node, also if a lone Processor holds the commons."""
_LOOP_SLOTS = {"io_cntl_slot": "fires the gates of", "dig_io_slot": "reads the permissive of"}
"""The inputs of a current minor loop that name modules, with the action of its task there."""


class NoSuchProcess(UserError):
    """A text names no module of the rack."""


@dataclass(frozen=True)
class RackProcess:
    """A process of a distributed rack; ``slots`` and names of its ``modules`` are in the order of slots.

    Its name is that of its first module. The one that ``holds_common_memory`` has that as its name; it alone publishes
    the rack's topics and receives the requests of operators. ``reasons`` are why its modules share a process.
    """

    name: str
    slots: tuple[int, ...]
    holds_common_memory: bool
    modules: tuple[str, ...]
    reasons: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The process and its modules, for messages."""
        return self.name if self.modules == (self.name,) else f"{self.name} ({' '.join(self.modules)})"


def processes_of(config: RackConfig, programs: Iterable[Program] | None = None) -> tuple[RackProcess, ...]:
    """Return the processes of a distributed rack: the one with common memory first, the others by their first slots.

    ``programs`` are its tasks without errors; if they are not given, the tasks are checked here. A task with errors
    joins no modules: a rack with one does not start anyway.
    """
    if programs is None:
        programs = [item.result.program for item in check_tasks(config) if item.result.program is not None]
    bonds = list(_bonds(config, list(programs)))
    found = []
    for slots in _groups([module.slot for module in config.modules], [bond.slots for bond in bonds]):
        modules = tuple(module.name for module in config.modules if module.slot in slots)
        holds_memory = config.common_memory_slot in slots
        reasons = tuple(bond.reason for bond in bonds if bond.slots[0] in slots and len(set(bond.slots)) > 1)
        found.append(RackProcess(MEMORY_PROCESS if holds_memory else modules[0], slots, holds_memory, modules, reasons))
    return tuple(sorted(found, key=lambda process: (not process.holds_common_memory, process.slots)))


def process_named(processes: Sequence[RackProcess], text: str) -> RackProcess:
    """Return the process of a module, which is named by its slot or by its name, such as ``3`` or ``processor_3``.

    Raises:
        NoSuchProcess: the rack has no such module.
    """
    wanted = text.strip().lower()
    for process in processes:
        if wanted in (process.name, *process.modules, *map(str, process.slots)):
            return process
    known = [name for process in processes for name in process.modules]
    raise NoSuchProcess(f"the rack has no module {quoted(text)}", near_or_listed(wanted, known))


class _Bond(NamedTuple):
    slots: tuple[int, ...]
    reason: str


def _bonds(config: RackConfig, programs: Sequence[Program]) -> Iterator[_Bond]:
    names = {module.slot: module.name for module in config.modules}
    task_slots = {task.name: module.slot for module, task in config.placed_tasks}
    for program in programs:
        yield from _task_bonds(program, task_slots[program.name], names, config)
    for module in config.modules:
        if module.drive is not None and module.drive in names:
            yield _Bond((module.slot, module.drive), f"{module.name} has the armature voltage of {names[module.drive]}")
    yield from _plant_bonds(config)
    yield from _exchange_bonds(programs, task_slots)


def _plant_bonds(config: RackConfig) -> Iterator[_Bond]:
    """Yield the modules whose plants are coupled or hold one web, then those with other plants between theirs."""
    slots = {driven.name: driven.slot for driven in driven_plants(config)}
    for plant in config.plants:
        other = plant.couple.to if plant.couple is not None else ""
        if plant.name in slots and other in slots:
            yield _Bond((slots[plant.name], slots[other]), f"the shafts of {plant.name} and {other} are coupled")
    for web in config.webs:
        if web.start in slots and web.end in slots:
            yield _Bond((slots[web.start], slots[web.end]), f"the web {web.name} runs from {web.start} to {web.end}")
    for chain in dict.fromkeys(joined_plants(config.plants, config.webs).values()):
        driven = [plant.name for plant in config.plants if plant.name in chain and plant.name in slots]
        if len(driven) > 1 and len(driven) < len(chain):
            yield _Bond(tuple(slots[name] for name in driven), f"{' and '.join(driven)} hang together by other plants")


def _task_bonds(program: Program, slot: int, names: dict[int, str], config: RackConfig) -> Iterator[_Bond]:
    """Yield the modules that a task's current minor loop commands, and those whose interrupts set its events."""
    facts = program.cml.facts if program.cml is not None else {}
    for key, does in _LOOP_SLOTS.items():
        other = facts.get(key)
        if isinstance(other, int) and other in names:
            yield _Bond((slot, other), f"task {program.name} {does} {names[other]}")
    for event in program.events:
        variable = config.by_name.get(event.interrupt_status.name) if event.interrupt_status is not None else None
        if variable is not None and variable.point is not None:
            other = variable.point.slot
            yield _Bond((slot, other), f"task {program.name} waits for the interrupt {event.name} of {names[other]}")


def _exchange_bonds(programs: Sequence[Program], task_slots: dict[str, int]) -> Iterator[_Bond]:
    shared: dict[str, list[Program]] = {}
    for program in programs:
        events = [f"the event {event.name}" for event in program.events]
        channels = [f"channel {file.number}" for file in program.files if file.direction is not None]
        for what in dict.fromkeys((*events, *channels)):
            shared.setdefault(what, []).append(program)
    for what, group in shared.items():
        slots = tuple(sorted({task_slots[program.name] for program in group}))
        if len(slots) > 1:
            yield _Bond(slots, f"tasks {' and '.join(program.name for program in group)} share {what}")


def _groups(slots: Iterable[int], bonds: Iterable[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Return the slots in the smallest groups that contain every bond whole."""
    group = {slot: {slot} for slot in slots}
    for bond in bonds:
        joined = set().union(*(group[slot] for slot in bond))
        group.update(dict.fromkeys(joined, joined))
    return list(dict.fromkeys(tuple(sorted(joined)) for joined in group.values()))


def part_name(config: RackConfig, slots: Collection[int]) -> str:
    """Return the name of the process with the modules of some slots; ``slot N`` if the rack has none there."""
    first = min(slots, default=config.common_memory_slot)
    return next((module.name for module in config.modules if module.slot == first), f"slot {first}")
