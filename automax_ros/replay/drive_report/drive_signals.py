"""Finds the recorded commons with the inputs and outputs of a drive, from the stored sources and the rack file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.names import NameFault, element
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.drive.pmi.pmi import USUAL_RATIO
from automax_ros.drive.pmi.registers import COMMAND_REGISTERS, CURRENT, FEEDBACK_REGISTERS, REFERENCE, SPEED
from automax_ros.language.printer import print_expression
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Element, Expression, Reference, Scope, Unary
from automax_ros.rackfile.checks.drives import RackDrive, given_inputs, rack_drives
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.scans.stored_rack import StoredRack

SPEED_REF = "SPEED_REF"
"""The keyword of the speed reference: the block has no such input, so the rack file or the user names it."""
SECOND_DRIVE = 1000
"""Offset from a register of drive A to that of drive B."""
PMI_REGISTERS = range(100, 300)
"""Command and feedback registers of drive A of a UDC (S-3056)."""
MOST_REGISTERS = 12
"""Most of these registers in a report (decision: more cannot be told apart)."""


@dataclass(frozen=True)
class RecordedSignal:
    """A common that carries a signal of a drive.

    Attributes:
        keyword: the parameter of DC_DRIVE_CML, or ``register 207`` of a UDC.
        variable: the common, or the element of one, as a recording names it.
        inverted: whether the CALL inverts it.
        text: its meaning in words.
        scale: the scale of its counts in rpm, None for one that is not counts of rpm.
        is_rpm: whether it is a speed in rpm, by its scale or unscaled.
    """

    keyword: str
    variable: str
    inverted: bool = False
    text: str = ""
    scale: Scale | None = None
    is_rpm: bool = False


@dataclass(frozen=True)
class ReportDrive:
    """A drive of a recording.

    Attributes:
        name: its plant, or its loop's task.
        where: the module that drives it, in words.
        task: the task with its loop, "" if there is none.
        signals: the signals that are commons, by keyword.
        unseen: keywords whose variables are not commons, so that their values are not recorded.
        parameters: motor and line, None if they are unknown.
        lim_bar: LIM_BAR in %, None if it is unknown.
        line_hz: frequency of the line in Hz, 60 if it is unknown.
    """

    name: str
    where: str
    task: str = ""
    signals: Mapping[str, RecordedSignal] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    parameters: DriveParameters | None = None
    lim_bar: float | None = None
    line_hz: float = 60.0


def report_drives(
    stored: StoredRack, task: str | None = None, references: Mapping[str, str] | None = None
) -> list[ReportDrive]:
    """Return the drives of a recorded rack in the order of slots, or the one whose loop is in ``task``.

    ``references`` are the commons with the drives' speed references, by the drive's name, "" for the only drive.

    Raises:
        BagError: there is no such task, or it has no current minor loop; a reference is for no drive, or not a common.
    """
    programs = stored.programs()
    drives = rack_drives(stored.config, programs)
    loops = [drive.program.name for drive in drives if drive.program is not None]
    if task is not None:
        stored.require_tasks([task])
        drives = [drive for drive in drives if drive.program is not None and drive.program.name == task]
        if not drives:
            named = f"give --task {' or '.join(loops)}, or leave it out: " if loops else ""
            hint = f"{named}without --task the report is of the whole rack"
            raise BagError("AMX6860", stored.bag, f"task {task} of it has no DC_DRIVE_CML", hint)
    given = _given_references(stored, [drive.name for drive in drives], references or {})
    return [_report_drive(drive, stored.config, programs, given.get(drive.name)) for drive in drives]


def _given_references(
    stored: StoredRack, drives: Sequence[str], references: Mapping[str, str]
) -> dict[str, RecordedSignal]:
    """Return the speed references that the user names, by drive."""
    found: dict[str, RecordedSignal] = {}
    for drive, name in references.items():
        owner = drives[0] if not drive and len(drives) == 1 else drive
        if owner not in drives:
            what = (
                f"{quoted(drive)} is not a drive of the report" if drive else f"the report is of {len(drives)} drives"
            )
            hint = f"write {' or '.join(f'{item}={name}' for item in drives)}" if drives else None
            raise BagError("AMX6841", stored.bag, f"speed reference {quoted(name)}: {what}", hint)
        try:
            meant = element(name, stored.config.by_name, "speed reference: the rack has no common variable")
        except NameFault as fault:
            raise BagError("AMX6841", stored.bag, fault.message, fault.hint) from fault
        if meant.variable.type in (DataType.STRING, DataType.BOOLEAN):
            raise BagError("AMX6841", stored.bag, f"speed reference: {meant.label} is {meant.variable.type.word}")
        found[owner] = RecordedSignal(SPEED_REF, meant.label, is_rpm=meant.variable.unit.strip().lower() == "rpm")
    return found


def _named_reference(drive: RackDrive, config: RackConfig) -> RecordedSignal | None:
    """Return the speed reference that the rack file names: the common of the velocity of its plant's joint."""
    for command in config.joint_commands:
        if drive.plant is not None and (command.plant, command.interface) == (drive.plant.name, "velocity"):
            return RecordedSignal(SPEED_REF, command.common, scale=command.scale, is_rpm=True)
    return None


def _report_drive(
    drive: RackDrive, config: RackConfig, programs: Sequence[Program], reference: RecordedSignal | None
) -> ReportDrive:
    try:
        data = drive.data
    except ParameterError:  # the rack file was valid when it was recorded; the report omits the data
        data = None
    inputs = given_inputs(drive, config, programs, {})
    lim_bar, line_hz = inputs.get("LIM_BAR"), inputs.get("AC_LINE_FREQ")
    signals, unseen = _of_call(drive, config)
    if drive.letter:
        signals = _of_registers(drive, config)
    reference = reference or _named_reference(drive, config)
    if reference is not None:
        signals[SPEED_REF] = reference
    ratio = lim_bar.value if lim_bar is not None else USUAL_RATIO if drive.letter else None
    hertz = data.parameters.line_hz if data is not None else line_hz.value if line_hz is not None else None
    return ReportDrive(
        drive.name,
        drive.where,
        drive.program.name if drive.program is not None else "",
        signals,
        unseen,
        data.parameters if data is not None else None,
        ratio,
        hertz or 60.0,
    )


def _of_call(drive: RackDrive, config: RackConfig) -> tuple[dict[str, RecordedSignal], tuple[str, ...]]:
    signals: dict[str, RecordedSignal] = {}
    unseen: list[str] = []
    call = drive.call
    if call is None or drive.program is None:
        return signals, ()
    texts = {item.name: item.text for item in call.block.inputs} | {item.name: item.text for item in call.block.outputs}
    for keyword, text in texts.items():
        given = call.arguments.get(keyword)
        operand = given.operand if isinstance(given, Unary) else given
        if not isinstance(operand, (Reference, Element)):
            continue
        label = _common(operand, drive.program, config)
        if label is None:
            unseen.append(keyword)
        else:
            signals[keyword] = RecordedSignal(keyword, label, isinstance(given, Unary), text)
    return signals, tuple(unseen)


def _common(expression: Expression, program: Program, config: RackConfig) -> str | None:
    """Return the common, or element, that an expression names; None for a local or for more than one element."""
    name = print_expression(expression)
    symbol = program.symbols.get(name.partition("(")[0])
    if symbol is None or symbol.scope is not Scope.COMMON:
        return None
    try:
        return element(name, config.by_name, "the rack has no common variable").label
    except NameFault:
        return None


def _of_registers(drive: RackDrive, config: RackConfig) -> dict[str, RecordedSignal]:
    """Return the command and feedback registers of a UDC's drive that have commons."""
    found = sorted(_registers(drive, config))[:MOST_REGISTERS]
    return {
        (keyword := _KEYWORDS.get(register, f"register {register}")): RecordedSignal(
            keyword, name, text=_WORDS.get(register, "")
        )
        for register, name in found
    }


_KEYWORDS = {REFERENCE: "REFERENCE", CURRENT: "I_FDBK", SPEED: "SPEED_FDBK"}
"""Keywords of a current minor loop for registers of a PMI; 4095 counts are full scale of both (36)."""
_WORDS = {item.number: item.meaning for item in (*COMMAND_REGISTERS, *FEEDBACK_REGISTERS) if item.bits}
"""Meanings of the PMI registers that are words of bits, which are not drawn with numbers."""


def _registers(drive: RackDrive, config: RackConfig) -> Iterator[tuple[int, str]]:
    """Yield the register, numbered as drive A's, and the common of each."""
    base = SECOND_DRIVE * (drive.letter == "B")
    for variable in config.declared:
        point = variable.point
        if point is None or point.slot != drive.slot or point.bit is not None or variable.is_array:
            continue
        if point.register - base in PMI_REGISTERS:
            yield point.register - base, variable.name
