"""UDC modules 57552 in a rack file: a task for drive A, one for drive B, or one alone (2.3); dual-port registers.

The registers and their writers are those of S-3056 p. 3-50 and SB3000 p. 3-8. Where no source gives them (decision):
2002 counts the scans since the last interrupt, bit 6 of 2000 drives the common clock and its other bits mean nothing,
the test I/O of the module (1000 to 1017) may be inputs or outputs. Registers that are not listed belong to the module's
operating system (S-3006 p. 4-2).

The size of a task on a UDC is an estimate: no source gives the size of compiled statements (decision).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from automax_ros.compile.base.cost import Model
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import may_be_empty, section
from automax_ros.core.ticks import UDC_TICK_NS
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node
from automax_ros.drive.pmi.registers import DRIVE_B, WRITTEN
from automax_ros.language.program import Program, Symbol
from automax_ros.language.tree.tree import Scope
from automax_ros.language.tree.walk import arguments_of, expressions_of, parts, statements_in_order
from automax_ros.rackfile.model.module import Interrupt, ModuleConfig, Registers
from automax_ros.rackfile.model.plants import PlantConfig, plant_name
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection, RackLayout
from automax_ros.rackfile.reading.values import Key, ProblemList, Section, choice_key
from automax_ros.rackfile.sections.tasks import TaskPlace, TaskPlaces, tasks_schema

COUNT = 2048
RAIL = range(24)
"""Rail and Flex I/O ports of the PMI: 0 to 11 of drive A, 12 to 23 of drive B."""
RAIL_COUNTERS = {"A": (5, 11), "B": (17, 23)}
"""The check-bit fault counters of each drive's rail ports (SB3000 p. 3-8)."""
STATUS = (*range(80, 90), *range(1080, 1090))
"""UDC-PMI communication status of the drives A and B."""
COMMAND = (*range(100, 200), *range(1100, 1200))
"""Commands to the PMI: outputs."""
FEEDBACK = (*range(200, 300), *range(1200, 1300))
"""Feedback from the PMI: inputs."""
TEST = range(1000, 1018)
"""Test switches and meter ports of the module."""
EVERY_SCAN = range(300, 600)
"""Application registers that the UDC copies every scan."""
NTH_SCAN = range(1300, 1600)
"""Application registers that the UDC copies every Nth scan."""
APPLICATION = frozenset((*EVERY_SCAN, *NTH_SCAN))
ISCR = 2000
SCANS_PER_INTERRUPT = 2001
SCAN_COUNTER = 2002

_INPUTS = (*RAIL, *STATUS, *FEEDBACK, SCAN_COUNTER)
_OUTPUTS = (*COMMAND, ISCR, SCANS_PER_INTERRUPT)
_USED = frozenset((*_INPUTS, *_OUTPUTS, *TEST, *APPLICATION))
RETAINED = frozenset((*RAIL, *STATUS, *FEEDBACK, *TEST))
"""Kept by STOP ALL and a power cycle: inputs, feedback, communication status, test switches, D/A set-up (2.4.5)."""

UDC_REGISTERS = Registers(
    COUNT,
    outputs=frozenset(_OUTPUTS),
    either=frozenset((*TEST, *APPLICATION)),
    reserved=frozenset(range(COUNT)) - _USED,
    reals=APPLICATION,
    interrupts=(Interrupt(ISCR),),
    commands=frozenset(COMMAND),
)


MAX_BYTES = 20 * 1024
"""Largest UDC task (2.3)."""
STATEMENT_BYTES = 8
"""Estimate for a statement, a CALL included, without the terms in it (decision)."""
TERM_BYTES = 6
"""Estimate for each variable, constant, operator, function and parameter: a call and an address (decision)."""
_VALUE_BYTES = {DataType.BOOLEAN: 1, DataType.INTEGER: 2, DataType.DOUBLE: 4, DataType.REAL: 4}
_STATE_BYTES = 4


MAX_UDCS = 10
"""Most UDC modules of one rack (J2-3106-1 p. 2-5)."""
DRIVES = ("A", "B")
"""The drives of a UDC, in the order in which their tasks run."""
_DRIVE = choice_key(
    "drive",
    "The drive that the task is for; A runs before B.",
    dict(zip(DRIVES, DRIVES, strict=True)),
    ("AMX6470", "{what} is {given}; it must be A or B"),
)
_PLANTS = {drive: plant_name(f"The plant of drive {drive}.") for drive in DRIVES}
_PLANTS_SCHEMA = may_be_empty(section("The plants that its drives turn.", _PLANTS))


def estimated_bytes(program: Program) -> int:
    """Return the approximate size of a task, in bytes: its code, its locals, and the state of its blocks."""
    statements = list(statements_in_order((*program.startup, *program.scan)))
    terms = states = 0
    for statement, _ in statements:
        given = (*expressions_of(statement), *(argument.value for argument in arguments_of(statement)))
        terms += sum(1 for expression in given for _ in parts(expression))
    for bound in program.calls.values():
        states += sum(1 if state.size is None else state.size(bound.facts) for state in bound.block.states)
    code = STATEMENT_BYTES * len(statements) + TERM_BYTES * terms
    variables = sum(_variable_bytes(symbol) for symbol in program.symbols.values() if symbol.scope is Scope.LOCAL)
    return code + variables + _STATE_BYTES * states


def _variable_bytes(symbol: Symbol) -> int:
    size = symbol.length + 1 if symbol.type is DataType.STRING else _VALUE_BYTES[symbol.type]
    return size * symbol.elements


class UdcConfig(ModuleConfig):
    """A UDC module, its tasks in the order of their drives."""


def _drives() -> TaskPlaces:
    """Return the places of the tasks of one UDC: each drive has at most one."""
    taken: dict[str, Span] = {}

    def read(node: Node, what: str, findings: ProblemList) -> TaskPlace | None:
        text = _DRIVE.read(node, what, findings)
        if text is not None and text in taken:
            note = Note("that task is here", taken[text])
            findings.add("AMX6470", f"drive {text} has a task already", node.span, notes=(note,))
            return None
        if text is None:
            return None
        taken[text] = node.span
        return TaskPlace(DRIVES.index(text), text)

    return TaskPlaces(Key("drive", _DRIVE.schema, read), "A", len(DRIVES))


class UdcKind(ModuleKind):
    """The options of a UDC in a rack file."""

    word = "UDC"
    models = MappingProxyType({"57552": "UDC module"})
    options = MappingProxyType({"tasks": tasks_schema(_drives()), "plants": _PLANTS_SCHEMA})

    def read(self, found: ModuleSection) -> UdcConfig:
        """Read tasks and plants; a UDC does not have all languages of tasks (J2-3106-1 p. 2-5).

        For a drive with a PMI the module itself writes feedback and communication status.
        """
        tasks = found.read_tasks(_drives())
        for task in tasks:
            suffix = task.file.suffix.upper()
            if suffix != ".BLK":
                message = f"task {task.name} of {found.where} is a {suffix} file"
                message += "; a UDC runs control-block tasks (.BLK) only"
                found.findings.add("AMX6304", message, Span(task.line, 1, 2))
        in_order = tuple(sorted(tasks, key=lambda task: task.priority))
        plants = _plants(found)
        bases = [DRIVE_B if drive == "B" else 0 for drive, plant in plants.items() if plant.motor is not None]
        shown = frozenset(base + number for base in bases for number in WRITTEN)
        return UdcConfig(
            **found.placed("udc"),
            tick_ns=UDC_TICK_NS,
            tasks=in_order,
            registers=replace(UDC_REGISTERS, shown=shown) if shown else UDC_REGISTERS,
            keeps_locals=False,
            times=Model.UDC,
            plants=plants,
        )

    def check_places(self, rack: RackLayout) -> None:
        """Report too many UDCs; no source names a slot where one may not be."""
        own = rack.of(self)
        if len(own) > MAX_UDCS:
            message = f"the rack has {len(own)} UDC modules; it may have at most {MAX_UDCS}"
            rack.findings.add("AMX6471", message, own[MAX_UDCS].span)


UDC = UdcKind()


def _plants(found: ModuleSection) -> Mapping[str, PlantConfig]:
    node, what = found.section.get("plants"), f"plants of {found.where}"
    if node is None:
        return {}
    section = Section(node, what, DRIVES, found.findings)
    named = ((drive, section.get(drive)) for drive in DRIVES)
    claimed = ((drive, found.plants.claim(node, f"drive {drive} of {found.where}")) for drive, node in named if node)
    return {drive: plant for drive, plant in claimed if plant is not None}
