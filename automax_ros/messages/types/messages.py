"""The messages of a rack as Python tuples with names: one class per type, fields as in its .msg file.

They are the messages of a recording and, which no recording contains, the table of a rack's tasks and the messages
between the processes of one rack.

A time (``builtin_interfaces/Time``) is an integer of nanoseconds. Sequences may be given as list, tuple or array; in a
message read from a bag they are tuples.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import NamedTuple

from automax_ros.core.kinds import Direction
from automax_ros.core.types import Value

_new = tuple.__new__
"""Makes a message from a tuple of all its fields: the class itself takes three times as long, and a rack makes many."""
HELD_MARK = "forced "
"""Prefix of the fields without values that come first in a TaskState: the names of the locals that a force holds."""


class Values(NamedTuple):
    """Values of common variables: entry i is ``element[i]`` of ``variable[i]``."""

    variable: Sequence[int] = ()
    element: Sequence[int] = ()
    value: Sequence[float] = ()
    text: Sequence[str] = ()


NO_VALUES = Values()
"""The one empty Values: most messages of a recording contain it, and the codec recognises it by its identity."""


def values_of(entries: Sequence[tuple[int, int, Value]]) -> Values:
    """Return (view, element, value) entries as a Values message."""
    if not entries:
        return NO_VALUES
    variables, elements, values = zip(*entries, strict=True)
    return as_values(variables, elements, values)


def as_values(variables: Sequence[int], elements: Sequence[int], values: Sequence[Value]) -> Values:
    """Return views, elements and values of equal length as a Values message."""
    if str not in map(type, values):
        return _new(Values, (variables, elements, values, ()))
    numbers = [0.0 if isinstance(value, str) else value for value in values]
    return Values(variables, elements, numbers, [value for value in values if isinstance(value, str)])


class TaskInfo(NamedTuple):
    """The present state of one task."""

    task: str
    module: str
    slot: int
    status: str
    priority: int
    critical: bool
    period_ms: float
    scans: int
    skipped: int
    errors: int
    last_error: str
    source_hash: str


class TaskTable(NamedTuple):
    """The tasks of a rack, or of the modules of one of its processes."""

    stamp: int
    rack: str
    run_id: int
    tasks: Sequence[TaskInfo] = ()


class Stage(enum.IntEnum):
    """The stage of a process: ``Presence.state``."""

    JOINING = 0
    READY = 1
    RUNNING = 2
    LEAVING = 3


class BusWrite(NamedTuple):
    """Writes of one process to common memory, for the others."""

    stamp: int
    run_id: int
    process: int
    seat: int
    sequence: int
    writer: int
    kind: int
    values: Values


class BusImage(NamedTuple):
    """The image of common memory in one process, for one that joins or that has missed a message."""

    stamp: int
    run_id: int
    process: int
    sequence: int
    asked_by: int
    values: Values = NO_VALUES
    mask: Sequence[int] = ()
    since_ns: Sequence[int] = ()
    seat: Sequence[int] = ()
    order: Sequence[int] = ()
    force_variable: Sequence[int] = ()
    force_element: Sequence[int] = ()
    force_value: Sequence[float] = ()
    force_held: Sequence[bool] = ()
    force_since_ns: Sequence[int] = ()
    force_seat: Sequence[int] = ()
    force_order: Sequence[int] = ()


class Presence(NamedTuple):
    """The presence of a process: its stage, and the rack's operating state as it knows it."""

    stamp: int
    rack: str
    run_id: int
    process: int
    seat: int
    slots: Sequence[int]
    fingerprint: int
    state: int
    epoch_ns: int = 0
    sequence: int = 0
    asks: int = 0
    stopped: bool = False
    standing_ns: int = 0
    standing_seat: int = 0
    stopped_code: str = ""
    stopped_task: str = ""
    stopped_reason: str = ""
    host: str = ""
    pid: int = 0


class CommonWrite(NamedTuple):
    """Writes of one writer to common memory at one instant."""

    stamp: int
    run_id: int
    writer: int
    slot: int
    kind: int
    sequence: int
    values: Values


class CommonImage(NamedTuple):
    """All of common memory at one instant; ``sequence`` is that of the last write it contains."""

    stamp: int
    run_id: int
    sequence: int
    values: Values


class ScanError(NamedTuple):
    """One run-time error that a task logged: BASIC line and problem number."""

    line: int
    code: int


class Scan(NamedTuple):
    """One scan of one task: all data needed to execute it again and to compare."""

    stamp: int
    slot: int
    task: str
    scan: int
    duration_ns: int = 0
    skipped: int = 0
    full: bool = False
    latched: Values = NO_VALUES
    read: Values = NO_VALUES
    written: Values = NO_VALUES
    committed: Values = NO_VALUES
    errors: Sequence[ScanError] = ()


class Operation(NamedTuple):
    """An operation on a rack, or one that was requested and refused (not ``ok``)."""

    stamp: int
    run_id: int
    what: str
    task: str
    ok: bool
    reason: str
    detail: str


class TaskState(NamedTuple):
    """The state of a task between two scans."""

    stamp: int
    slot: int
    task: str
    scan: int
    layout_hash: str
    source_hash: str
    field: Sequence[str] = ()
    size: Sequence[int] = ()
    value: Sequence[float] = ()
    text: Sequence[str] = ()


class Variable(NamedTuple):
    """One common variable of a rack."""

    id: int
    name: str
    type: int
    dimensions: Sequence[int] = ()
    length: int = 0
    slot: int = 0
    non_volatile: bool = False
    direction: int = Direction.CLOSED
    topic: str = ""
    unit: str = ""
    description: str = ""


class Writer(NamedTuple):
    """A writer of common memory."""

    id: int
    name: str
    kind: int
    slot: int


class VariableTable(NamedTuple):
    """The common variables and the writers of a rack."""

    stamp: int
    rack: str
    run_id: int
    variables: Sequence[Variable] = ()
    writers: Sequence[Writer] = ()


class PlantState(NamedTuple):
    """The means of a drive's plant since the message before, and its present state."""

    stamp: int
    plant: str
    slot: int
    drive: str
    duration_s: float
    current_a: float
    voltage_v: float
    current_rms_a: float
    torque_nm: float
    load_nm: float
    speed_rpm: float
    position_rad: float
    field: float
    bridge: int
    contactor: bool
    line_hz: float
    line_v: float
    faults: Sequence[str]
    line_j: float
    loss_j: float
    stored_j: float
    shaft_j: float


class RollState(NamedTuple):
    """The roll or roller of a plant at an instant."""

    stamp: int
    plant: str
    web_mps: float
    web_fpm: float
    diameter_m: float
    web_m: float
    roll_turns: float


class WebState(NamedTuple):
    """A web between two plants at an instant."""

    stamp: int
    web: str
    from_plant: str
    to_plant: str
    tension_n: float
    strain_percent: float
    draw_percent: float
    slack_m: float
    dancer_m: float
    broken: bool


class NetworkDrop(NamedTuple):
    """The message of a module for one drop of a network of racks: 32 registers."""

    stamp: int
    run_id: int
    rack: str
    slot: int
    station: int
    depth: int
    defined: bool
    sequence: int
    drop: int
    registers: Sequence[int]


class Header(NamedTuple):
    """std_msgs/Header."""

    stamp: int
    frame_id: str = ""


class JointState(NamedTuple):
    """sensor_msgs/JointState."""

    header: Header
    name: Sequence[str]
    position: Sequence[float]
    velocity: Sequence[float]
    effort: Sequence[float]


class Clock(NamedTuple):
    """rosgraph_msgs/Clock."""

    clock: int


class Bool(NamedTuple):
    """std_msgs/Bool."""

    data: bool


class Int16(NamedTuple):
    """std_msgs/Int16."""

    data: int


class Int32(NamedTuple):
    """std_msgs/Int32."""

    data: int


class Float32(NamedTuple):
    """std_msgs/Float32."""

    data: float


class Float64(NamedTuple):
    """std_msgs/Float64."""

    data: float


class String(NamedTuple):
    """std_msgs/String."""

    data: str


class MultiArrayDimension(NamedTuple):
    """std_msgs/MultiArrayDimension."""

    label: str
    size: int
    stride: int


class MultiArrayLayout(NamedTuple):
    """std_msgs/MultiArrayLayout."""

    dim: Sequence[MultiArrayDimension] = ()
    data_offset: int = 0


NO_LAYOUT = MultiArrayLayout()


class Int16MultiArray(NamedTuple):
    """std_msgs/Int16MultiArray."""

    layout: MultiArrayLayout = NO_LAYOUT
    data: Sequence[int] = ()


class Int32MultiArray(NamedTuple):
    """std_msgs/Int32MultiArray."""

    layout: MultiArrayLayout = NO_LAYOUT
    data: Sequence[int] = ()


class Float32MultiArray(NamedTuple):
    """std_msgs/Float32MultiArray."""

    layout: MultiArrayLayout = NO_LAYOUT
    data: Sequence[float] = ()


class Float64MultiArray(NamedTuple):
    """std_msgs/Float64MultiArray."""

    layout: MultiArrayLayout = NO_LAYOUT
    data: Sequence[float] = ()


class UInt8MultiArray(NamedTuple):
    """std_msgs/UInt8MultiArray."""

    layout: MultiArrayLayout = NO_LAYOUT
    data: Sequence[int] = ()


_OWN = (
    BusImage,
    BusWrite,
    CommonImage,
    CommonWrite,
    NetworkDrop,
    Operation,
    PlantState,
    Presence,
    RollState,
    Scan,
    ScanError,
    TaskInfo,
    TaskState,
    TaskTable,
    Values,
    Variable,
    VariableTable,
    WebState,
    Writer,
)
_STANDARD = (
    Bool,
    Float32,
    Float32MultiArray,
    Float64,
    Float64MultiArray,
    Header,
    Int16,
    Int16MultiArray,
    Int32,
    Int32MultiArray,
    MultiArrayDimension,
    MultiArrayLayout,
    String,
    UInt8MultiArray,
)
CLASSES: dict[str, type[tuple[object, ...]]] = {
    **{f"automax_msgs/msg/{cls.__name__}": cls for cls in _OWN},
    **{f"std_msgs/msg/{cls.__name__}": cls for cls in _STANDARD},
    "rosgraph_msgs/msg/Clock": Clock,
    "sensor_msgs/msg/JointState": JointState,
}
"""The class of each message type by its full name; a time has none."""
NAMES: dict[type[tuple[object, ...]], str] = {cls: name for name, cls in CLASSES.items()}
"""The full name of the message type by its class."""
