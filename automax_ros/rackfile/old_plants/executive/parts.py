"""Which module a record of $CARD is: its part code points into a table of the Executive that is not known.

The user says it (``--part 17=57C435``, ``--module 5=57C419`` for one slot), or it is found out, and then told: by a
catalogue number in the description, by what the record itself says, by the tasks and variables of its slot, or by
another slot with the same code, since one code is one module (decision). Where several modules fit none is taken.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.rackfile.model.config import MAX_SLOT
from automax_ros.rackfile.model.module import MAX_PRIORITY, MIN_PRIORITY
from automax_ros.rackfile.modules.common_memory import COMMON_MEMORY
from automax_ros.rackfile.modules.io import DIGITAL_IO
from automax_ros.rackfile.modules.processor import PC3000
from automax_ros.rackfile.modules.processor import PROCESSOR as PROCESSOR_KIND
from automax_ros.rackfile.modules.registry import KINDS, NOT_YET, REFUSED, SUPPORTED, module_number
from automax_ros.rackfile.modules.udc import APPLICATION, DRIVES, ISCR, SCANS_PER_INTERRUPT
from automax_ros.rackfile.old_plants.executive.fields import Record
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.variables import OldVariable

PROCESSOR, MEMORY, NETWORK, UDC = "57C435", "57C413", "57C404", "57552"
"""What a module of these kinds is taken for where its number is not known."""
PROCESSORS = (*PROCESSOR_KIND.models, *PC3000.models)
"""All modules that are Processors."""
COMPILED = ("BLK", "BAS")
"""Kinds of tasks that are compiled."""
RUNNING = (*COMPILED, "PC")
"""Kinds of tasks that run; their names differ."""
PROCESSOR_SLOTS = range(5)
"""Slots where a Processor can be (J2-3106-1 p. F-4)."""
_NUMBER = re.compile(r"(?:B/M\s*)?\b(57C?-?[0-9]{3}[A-Z]?)\b", re.IGNORECASE)
_DATA = range(2)
"""Registers of analog, resolver and pulsetach modules in which numbers stand: no variable is a bit of one."""


@dataclass(frozen=True)
class OldModule:
    """A module of the rack: ``model`` is None where it is not known, ``why`` says how it was found out, or why not."""

    slot: int
    card: Record | None
    model: str | None
    why: str = ""

    @property
    def code(self) -> int | None:
        """Its part code."""
        return None if self.card is None else self.card.whole("part")

    @property
    def options(self) -> str:
        """The options that say which module it is, "" if none can."""
        ways = [] if self.code is None else [f"--part {self.code}=NUMBER"]
        ways += [f"--module {self.slot}=NUMBER"] if 0 <= self.slot <= MAX_SLOT else []
        return ", or ".join(ways)


@dataclass(frozen=True)
class OldTask:
    """A record of $TASKS; ``kind`` is BLK, BAS, PC or INC in upper case."""

    record: Record
    name: str
    kind: str
    slot: int | None
    priority: int | None

    @property
    def file(self) -> str:
        """The name of its file."""
        return f"{self.name}.{self.kind}"

    @property
    def on_processor(self) -> bool:
        """Whether its slot and its priority are those of a task of a Processor."""
        return self.slot in PROCESSOR_SLOTS and self.priority in range(MIN_PRIORITY, MAX_PRIORITY + 1)

    @property
    def is_udc(self) -> bool:
        """Whether it can only be a task of a UDC, since no Processor has its slot or its priority.

        A task without a priority, in a slot where Processors can be, may be either.
        """
        if self.kind != "BLK" or self.slot is None or self.on_processor:
            return False
        has_drive = self.record.text("priority").upper() in DRIVES
        return self.slot not in PROCESSOR_SLOTS or self.priority is not None or has_drive


def is_memory(module: OldModule) -> bool:
    """Return whether a module is common memory with the rack's variables, in slot 0."""
    return module.slot == 0 and module.model in COMMON_MEMORY.models


def number_known(model: str) -> bool:
    """Return whether a module's number is one that exists, be it emulated or not."""
    return model in SUPPORTED or model in NOT_YET or model in REFUSED


def modules_of(
    cards: Sequence[Record],
    tasks: Sequence[OldTask],
    variables: Sequence[OldVariable],
    written: frozenset[str],
    given: tuple[Mapping[int, str], Mapping[int, str]],
    findings: Findings,
) -> dict[int, OldModule]:
    """Return the modules of the rack itself by their slots, in the order of $CARD.

    ``given`` are the modules that the user names, by part codes and by slots; ``written`` the variables that tasks
    write. What had to be found out is told (AMX6794).
    """
    finding = _Finding(cards, tasks, variables, written, *given)
    modules = finding.modules()
    for module in modules.values():
        if module.card is None or (module.model is not None and not module.why):
            continue
        code = f"part code {module.code}" if module.code is not None else "a module without a part code"
        if module.model is not None:
            message = f"slot {module.slot}: {code} is taken for a {module.model}: {module.why}"
            hint = f"if it is another: {module.options}"
        else:
            what = code if module.code is not None else "it"
            message = f"slot {module.slot}: which module {what} is, is not known; {module.why}"
            hint = f"read its number on the module: {module.options}"
        findings.add("AMX6794", message, module.card.file, module.card.number, hint if module.options else None)
    return modules


class _Finding:
    def __init__(
        self,
        cards: Sequence[Record],
        tasks: Sequence[OldTask],
        variables: Sequence[OldVariable],
        written: frozenset[str],
        parts: Mapping[int, str],
        slots: Mapping[int, str],
    ) -> None:
        self._cards, self._written, self._parts, self._slots = cards, written, parts, slots
        self._tasks = by_slot(tasks)
        self._points: defaultdict[int | None, list[OldVariable]] = defaultdict(list)
        for variable in variables:
            if _is_point(variable) and not variable.place.drop:
                self._points[variable.place.slot].append(variable)

    def modules(self) -> dict[int, OldModule]:
        found = {slot: self._alone(slot, card) for slot, card in self._placed()}
        by_code: dict[int | None, dict[str, int]] = defaultdict(dict)
        for module in found.values():
            if module.model is not None and module.code is not None and module.slot not in self._slots:
                by_code[module.code].setdefault(module.model, module.slot)
        for slot, module in found.items():
            models = by_code.get(module.code, {})
            if module.model is None and len(models) == 1:
                model, other = next(iter(models.items()))
                found[slot] = OldModule(slot, module.card, model, f"as in slot {other}, which has the same code")
            elif module.model is not None and module.why and len(models) > 1:
                both = " and ".join(sorted(models))
                found[slot] = OldModule(slot, module.card, module.model, f"{module.why} (its code is also {both})")
        return self._with_memory(found)

    def _placed(self) -> Iterator[tuple[int, Record | None]]:
        taken: set[int] = set()
        for card in self._cards:
            slot = card.whole("slot")
            if slot is not None and slot not in taken:
                taken.add(slot)
                yield slot, card
        for slot in (*self._slots, *self._tasks):
            if slot is not None and slot not in taken:
                taken.add(slot)
                yield slot, None

    def _alone(self, slot: int, card: Record | None) -> OldModule:
        """Return a module by what is known of its own slot and code."""
        code = card.whole("part") if card is not None else None
        if slot in self._slots:
            return OldModule(slot, card, self._slots[slot])
        if code is not None and code in self._parts:
            return OldModule(slot, card, self._parts[code])
        if card is not None:
            numbers = {module_number(text.replace("-", "")) for text in _NUMBER.findall(card.text("desc"))}
            known = sorted(filter(number_known, numbers))
            if len(known) == 1:
                return OldModule(slot, card, known[0], "its description names it")
        return self._by_use(slot, card)

    def _by_use(self, slot: int, card: Record | None) -> OldModule:
        own = [task for task in self._tasks.get(slot, ()) if task.kind != "INC"]
        runs = next((task.name for task in own if task.on_processor), None)
        if runs is not None:
            return OldModule(slot, card, PROCESSOR, f"task {runs} runs there; which Processor it is, is not known")
        drives = next((task.name for task in own if task.is_udc), None)
        if drives is not None:
            return OldModule(slot, card, UDC, f"no Processor has the slot and the priority of task {drives}")
        if card is not None and card.text("network"):
            return OldModule(slot, card, NETWORK, f"it is on network {card.text('network')}")
        points = self._points.get(slot, [])
        registers = {item.place.register for item in points if item.place.register is not None}
        if registers & {ISCR, SCANS_PER_INTERRUPT}:
            return OldModule(slot, card, UDC, f"register {min(registers & {ISCR, SCANS_PER_INTERRUPT})} is used")
        fitting = tuple(_fitting(points, self._written)) if registers else ()
        if len(fitting) == 1:
            return OldModule(slot, card, fitting[0], f"no other has register {max(registers)} as it is used")
        if not fitting and registers and registers <= APPLICATION:
            return OldModule(slot, card, UDC, f"register {max(registers)} is one of a UDC's application registers")
        why = f"by its registers it can be {', '.join(fitting) or 'none that the emulator has'}"
        if not registers:
            why = "no task, network or variable of its slot says it"
        return OldModule(slot, card, None, why)

    def _with_memory(self, found: dict[int, OldModule]) -> dict[int, OldModule]:
        """Return the modules with common memory in slot 0, where Processors elsewhere need it."""
        processors = [slot for slot, module in found.items() if slot and module.model in PROCESSOR_KIND.models]
        first = found.get(0)
        if not processors or (first is not None and first.model is not None):
            return found
        why = f"slot 0 with a Processor in slot {processors[0]} holds common memory"
        memory = OldModule(0, None if first is None else first.card, MEMORY, why)
        return found | {0: memory} if first is not None else {0: memory, **found}


def _is_point(variable: OldVariable) -> bool:
    return variable.declared is not None and variable.in_memory is not True


def _fitting(points: Sequence[OldVariable], written: frozenset[str]) -> Iterator[str]:
    """Yield the modules that have all registers of some points, and let tasks write those that they write."""
    for kind in KINDS:
        for number, registers in kind.table.items():
            suits = all(
                item.place.register in range(registers.count)
                and item.place.register not in registers.reserved
                and (item.text not in written or item.place.register in registers.writable)
                and (kind is DIGITAL_IO or item.place.bit is None or item.place.register not in _DATA)
                for item in points
            )
            if suits:
                yield number


def by_slot(tasks: Iterable[OldTask]) -> Mapping[int | None, Sequence[OldTask]]:
    """Return the tasks of each slot, in their order."""
    found: defaultdict[int | None, list[OldTask]] = defaultdict(list)
    for task in tasks:
        found[task.slot].append(task)
    return found


def tasks_of(records: Iterable[Record], findings: Findings) -> list[OldTask]:
    """Return the tasks of $TASKS in their order; one whose name occurs before is told and left out (AMX6789).

    What does not run, such as an include file, may have the name of a task.
    """
    found: dict[tuple[str, str], OldTask] = {}
    for record in records:
        task = OldTask(
            record,
            record.text("name").upper(),
            record.text("type").upper(),
            record.whole("slot"),
            record.whole("priority"),
        )
        first = found.setdefault((task.name, "" if task.kind in RUNNING else task.kind), task)
        if first is not task:
            message = f"task {task.name} is defined before, by record {first.record.number}: this one is left out"
            findings.add("AMX6789", message, record.file, record.number)
    return list(found.values())
