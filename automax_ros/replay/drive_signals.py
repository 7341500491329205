"""Which recorded commons carry the inputs and outputs of a drive: the stored sources and the rack file tell it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.bags.errors import BagError
from automax_ros.core.names import NameFault, element
from automax_ros.drive.errors import ParameterError
from automax_ros.drive.nameplate import DriveParameters
from automax_ros.language.program import Program
from automax_ros.language.syntax.statement_text import print_expression
from automax_ros.language.syntax.tree import Element, Expression, Reference, Scope, Unary
from automax_ros.rack.config import RackConfig
from automax_ros.rack.drives import RackDrive, given_inputs, rack_drives
from automax_ros.replay.stored_rack import StoredRack

CURRENT_REGISTER = 207
"""Register of a UDC with the current feedback of drive A, 4095 at the Motor Overload Ratio (36)."""
SECOND_DRIVE = 1000
"""What is added to a register of drive A for that of drive B."""
PMI_REGISTERS = range(100, 300)
"""Command and feedback registers of drive A of a UDC (S-3056)."""
MOST_REGISTERS = 12
"""Most of them that a report shows (decision: more cannot be told apart)."""


@dataclass(frozen=True)
class Signal:
    """A common that carries a signal of a drive.

    Attributes:
        keyword: the parameter of DC_DRIVE_CML, or ``register 207`` of a UDC.
        variable: the common, or the element of one, as a recording names it.
        inverted: whether the CALL turns it round.
        text: what the signal is, in words.
    """

    keyword: str
    variable: str
    inverted: bool = False
    text: str = ""


@dataclass(frozen=True)
class ReportDrive:
    """A drive of a recording.

    Attributes:
        name: its plant, or its loop's task.
        where: the module that drives it, in words.
        task: the task with its loop, "" where there is none.
        signals: by keyword, those that are commons.
        unseen: keywords whose variables are not commons, so that a recording does not have their course.
        parameters: motor and line, None where they are not known.
        lim_bar: LIM_BAR in %, None where it is not known.
        line_hz: frequency of the line in Hz, as far as it is known, else 60.
    """

    name: str
    where: str
    task: str = ""
    signals: Mapping[str, Signal] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    parameters: DriveParameters | None = None
    lim_bar: float | None = None
    line_hz: float = 60.0


def report_drives(stored: StoredRack, task: str | None = None) -> list[ReportDrive]:
    """Return the drives of a recorded rack in the order of slots, or the one whose loop is in ``task``.

    Raises:
        BagError: there is no drive, or no such task, or it has no current minor loop.
    """
    programs = stored.programs()
    drives = rack_drives(stored.config, programs)
    loops = [drive.program.name for drive in drives if drive.program is not None]
    if task is not None:
        stored.require_tasks([task])
        drives = [drive for drive in drives if drive.program is not None and drive.program.name == task]
    if not drives:
        what = f"task {task} of it has no DC_DRIVE_CML" if task is not None else "its rack has no drive"
        hint = "a drive is a 57C406 or a UDC with a plant, or a task with DC_DRIVE_CML; `automax plot` draws variables"
        hint = f"give --task {' or '.join(loops)}, or leave it out" if loops else hint
        raise BagError("AMX6860", stored.bag, f"{what}, so there is nothing to report", hint)
    return [_report_drive(drive, stored.config, programs) for drive in drives]


def _report_drive(drive: RackDrive, config: RackConfig, programs: Sequence[Program]) -> ReportDrive:
    try:
        data = drive.data
    except ParameterError:  # the rack file was right when it was recorded; the report does without
        data = None
    inputs = given_inputs(drive, config, programs, {})
    lim_bar, line_hz = inputs.get("LIM_BAR"), inputs.get("AC_LINE_FREQ")
    signals, unseen = _of_call(drive, config)
    if drive.letter:
        signals = _of_registers(drive, config)
    hertz = data.parameters.line_hz if data is not None else line_hz.value if line_hz is not None else None
    return ReportDrive(
        drive.name,
        drive.where,
        drive.program.name if drive.program is not None else "",
        signals,
        unseen,
        data.parameters if data is not None else None,
        lim_bar.value if lim_bar is not None else None,
        hertz or 60.0,
    )


def _of_call(drive: RackDrive, config: RackConfig) -> tuple[dict[str, Signal], tuple[str, ...]]:
    signals: dict[str, Signal] = {}
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
            signals[keyword] = Signal(keyword, label, isinstance(given, Unary), text)
    return signals, tuple(unseen)


def _common(expression: Expression, program: Program, config: RackConfig) -> str | None:
    """Return the common, or element, that an expression names; None where it is a local or not one element."""
    name = print_expression(expression)
    symbol = program.symbols.get(name.partition("(")[0])
    if symbol is None or symbol.scope is not Scope.COMMON:
        return None
    try:
        return element(name, config.by_name, "the rack has no common variable").label
    except NameFault:
        return None


def _of_registers(drive: RackDrive, config: RackConfig) -> dict[str, Signal]:
    """Return the command and feedback registers of a UDC's drive that have commons."""
    found = sorted(_registers(drive, config))[:MOST_REGISTERS]
    return {_keyword(register): Signal(_keyword(register), name) for register, name in found}


def _keyword(register: int) -> str:
    return "I_FDBK" if register == CURRENT_REGISTER else f"register {register}"


def _registers(drive: RackDrive, config: RackConfig) -> Iterator[tuple[int, str]]:
    """Yield register, counted as drive A's, and common."""
    base = SECOND_DRIVE * (drive.letter == "B")
    for variable in config.declared:
        point = variable.point
        if point is None or point.slot != drive.slot or point.bit is not None or variable.is_array:
            continue
        if point.register - base in PMI_REGISTERS:
            yield point.register - base, variable.name
