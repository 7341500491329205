"""What happens in a rack as messages: variable table, images, write log, scans, states, values of commons."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import compress, groupby
from operator import itemgetter, ne
from typing import Any

from automax_ros.core.kinds import Direction, WriteKind
from automax_ros.core.types import DataType, Latched, Value
from automax_ros.rack.config import CommonVariable
from automax_ros.rack.observers import Operation as Done
from automax_ros.rack.rack import Rack
from automax_ros.rack.ros_names import topic_names
from automax_ros.rack.writers import PRESET_WRITER
from automax_ros.running.task import ScanRecord, Task
from automax_ros.running.views import Write
from automax_ros.wire.messages import (
    HELD_MARK,
    NAMES,
    NO_LAYOUT,
    Bool,
    CommonImage,
    CommonWrite,
    Float32,
    Float32MultiArray,
    Int16,
    Int16MultiArray,
    Int32,
    Int32MultiArray,
    MultiArrayDimension,
    MultiArrayLayout,
    Operation,
    Scan,
    ScanError,
    String,
    TaskState,
    UInt8MultiArray,
    Variable,
    VariableTable,
    Writer,
)
from automax_ros.wire.values import NO_VALUES, Values

Message = tuple[object, ...]
SCALED_TYPE = NAMES[Float32]
"""The ROS type of a variable with a scale: a number in the engineer's unit."""
_SCALARS: dict[DataType, Any] = {
    DataType.INTEGER: Int16,
    DataType.DOUBLE: Int32,
    DataType.REAL: Float32,
    DataType.BOOLEAN: Bool,
    DataType.STRING: String,
}
"""The classes of simple variables' topics: each takes the value."""
_ARRAYS: dict[DataType, Any] = {
    DataType.INTEGER: Int16MultiArray,
    DataType.DOUBLE: Int32MultiArray,
    DataType.REAL: Float32MultiArray,
    DataType.BOOLEAN: UInt8MultiArray,
}
"""The classes of arrays' topics: each takes the layout and the values. std_msgs has none for strings."""
_ENTRY = itemgetter(4, 5, 6)
"""View, element and value of an entry of the write log."""
_new = tuple.__new__
"""Makes a message of a tuple of all its fields: the class itself takes three times as long, and a rack makes many."""
_MOST = 0xFFFFFFFF
"""The greatest uint32."""
_GROUP = itemgetter(1, 2, 3)
"""Time, writer and kind of an entry: those that have them in common travel together."""


def values_of(entries: Sequence[tuple[int, int, Value]]) -> Values:
    """Return (view, element, value) entries as a Values message."""
    if not entries:
        return NO_VALUES
    variables, elements, values = zip(*entries, strict=True)
    return _values(variables, elements, values)


def _values(variables: Sequence[int], elements: Sequence[int], values: Sequence[Value]) -> Values:
    if str not in map(type, values):
        return _new(Values, (variables, elements, values, ()))
    numbers = [0.0 if isinstance(value, str) else value for value in values]
    return Values(variables, elements, numbers, [value for value in values if isinstance(value, str)])


def value_type_name(kind: DataType, *, is_array: bool) -> str | None:
    """Return the ROS type of a variable's topic, None for arrays of strings, which std_msgs cannot carry."""
    message = (_ARRAYS if is_array else _SCALARS).get(kind)
    return NAMES[message] if message else None


def topic_type_name(variable: CommonVariable) -> str | None:
    """Return the ROS type of a variable's topic: Float32 where it has a scale. None for arrays of strings."""
    if variable.scale is not None:
        return SCALED_TYPE
    return value_type_name(variable.type, is_array=variable.is_array)


def message_maker(variable: CommonVariable) -> Callable[[Any], Message]:
    """Return what makes the message of a variable's topic: of its value, or of an array's values in order.

    An array's layout names its dimensions.
    """
    maker: Callable[[Any], Message] = _SCALARS[variable.type]
    return partial(_ARRAYS[variable.type], _layout(variable.dimensions)) if variable.is_array else maker


def _layout(dimensions: tuple[int, ...]) -> MultiArrayLayout:
    if not dimensions:
        return NO_LAYOUT
    parts = []
    for number, size in enumerate(dimensions):
        stride = 1
        for inner in dimensions[number:]:
            stride *= inner
        parts.append(MultiArrayDimension(f"subscript{number + 1}", size, stride))
    return MultiArrayLayout(parts, 0)


class _TaskFacts:
    """What every message of a task repeats, and what it latched last."""

    def __init__(self, task: Task) -> None:
        layout = task.layout
        self.compiled = task.compiled
        self.name, self.slot = task.name, task.slot
        self.views = tuple(task.memory.view(name) for name in task.compiled.latched)
        self.layout_hash, self.source_hash = layout.hash, task.compiled.program.source_hash
        self.fields = [field.name for field in layout.fields]
        self.sizes = [field.size for field in layout.fields]
        self.latched: Latched | None = None


class RackMessages:
    """Makes the messages of one run of a rack.

    ``run_id`` is the number of the run; ``epoch_ns`` is added to rack time to give stamps: 0 in simulated time, the
    wall clock at the start else.
    """

    def __init__(self, rack: Rack, run_id: int) -> None:
        """Begin with the numbering of the write log."""
        self._rack = rack
        self.run_id = run_id
        self.epoch_ns = 0
        self._sequence = 0
        self._slots = {writer.id: writer.slot for writer in rack.writers}
        image = rack.memory.image()
        self._image_variables = [view for view, _, _ in image]
        self._image_elements = [element for _, element, _ in image]
        self._text_positions = [position for position, entry in enumerate(image) if isinstance(entry[2], str)]
        self._tasks = {task: _TaskFacts(task) for task in rack.tasks}

    def reinstalled(self, task: Task) -> None:
        """Describe a task again if it executes another program than before."""
        if task.compiled is not self._tasks[task].compiled:
            self._tasks[task] = _TaskFacts(task)

    def stamp(self, now_ns: int) -> int:
        """Return the stamp of an instant of rack time."""
        return self.epoch_ns + now_ns

    def table(self) -> VariableTable:
        """Return the table of variables and writers."""
        config = self._rack.config
        topics = topic_names(variable.name for variable in config.variables)
        slots = {number: item.point.slot for number, item in enumerate(config.variables) if item.point is not None}
        slots |= {number: item.bank for number, item in enumerate(config.variables) if item.bank is not None}
        variables = [
            Variable(
                number,
                variable.name,
                variable.type.number,
                variable.dimensions,
                variable.length,
                slots.get(number, config.home_slot),
                variable.non_volatile,
                variable.direction,
                f"/{config.namespace}/{topics[variable.name]}" if variable.direction is not Direction.CLOSED else "",
                variable.unit,
                variable.description,
            )
            for number, variable in enumerate(config.variables)
        ]
        writers = [Writer(writer.id, writer.name, writer.kind, writer.slot) for writer in self._rack.writers]
        return VariableTable(self.stamp(0), config.name, self.run_id, variables, writers)

    def image(self, now_ns: int) -> CommonImage:
        """Return all of common memory as it is."""
        values: list[Any] = []
        for view in range(len(self._rack.memory.specs)):
            present = self._rack.memory.present(view)
            if isinstance(present, list):
                values += present
            else:
                values.append(present)
        texts = [values[position] for position in self._text_positions]
        for position in self._text_positions:
            values[position] = 0.0
        image = Values(self._image_variables, self._image_elements, values, texts)
        return CommonImage(self.stamp(now_ns), self.run_id, self._sequence, image)

    def forces(self, now_ns: int) -> CommonWrite | None:
        """Return what is forced as a further entry of the write log, None if nothing is: an image does not tell it."""
        memory = self._rack.memory
        if not memory.forced:
            return None
        entries = ((view, element, memory.read_now(view, element)) for view, element in sorted(memory.forced))
        return self._write((now_ns, PRESET_WRITER, WriteKind.FORCE), entries)

    def writes(self, writes: Sequence[Write]) -> list[CommonWrite]:
        """Return entries of the write log, those of one writer, kind and instant together."""
        if len(set(map(_GROUP, writes))) == 1:
            return [self._write(_GROUP(writes[0]), map(_ENTRY, writes))]
        return [self._write(key, map(_ENTRY, entries)) for key, entries in groupby(writes, key=_GROUP)]

    def _write(self, key: tuple[int, int, int], entries: Iterable[tuple[int, int, Value]]) -> CommonWrite:
        time_ns, writer, kind = key
        self._sequence += 1
        variables, elements, values = zip(*entries, strict=True)
        fields = (
            self.epoch_ns + time_ns,
            self.run_id,
            writer,
            self._slots[writer],
            int(kind),
            self._sequence,
            _values(variables, elements, values),
        )
        return _new(CommonWrite, fields)

    def scan(self, task: Task, record: ScanRecord, *, full: bool) -> Scan:
        """Return the message of a scan; unless ``full``, only what was newly latched since the task's last message."""
        known = self._tasks[task]
        latched, before, views = record.latched, known.latched, known.views
        known.latched = latched if record.scan else None
        full = full or before is None or not record.scan
        changed = NO_VALUES
        if full or before is None:
            if latched:
                changed = _values(views, (0,) * len(views), latched)
        elif latched != before:
            differs = list(map(ne, latched, before))
            changed = _values(tuple(compress(views, differs)), (0,) * sum(differs), tuple(compress(latched, differs)))
        committed = NO_VALUES
        if record.commits:
            variables, values = zip(*record.commits, strict=True)
            committed = _values(variables, (0,) * len(variables), values)
        reads, writes, errors = record.reads, record.writes, record.errors
        duration, skipped = record.duration_ns, record.skipped
        fields = (
            self.epoch_ns + record.time_ns,
            known.slot,
            known.name,
            record.scan,
            duration if duration <= _MOST else _MOST,
            skipped if skipped <= _MOST else _MOST,
            full,
            changed,
            values_of(reads) if reads else NO_VALUES,
            values_of(writes) if writes else NO_VALUES,
            committed,
            [ScanError(line, code) for line, code in errors] if errors else (),
        )
        return _new(Scan, fields)

    def operation(self, operation: Done) -> Operation:
        """Return what was done to the rack."""
        return Operation(
            self.stamp(operation.at_ns),
            self.run_id,
            operation.what,
            operation.task,
            operation.ok,
            operation.reason,
            operation.detail,
        )

    def state(self, task: Task, now_ns: int) -> TaskState:
        """Return a snapshot of a task's state."""
        known = self._tasks[task]
        values = task.snapshot()
        marks = [HELD_MARK + name for name in sorted(task.compiled.held)]
        return TaskState(
            self.stamp(now_ns),
            known.slot,
            known.name,
            task.scan_number,
            known.layout_hash,
            known.source_hash,
            [*marks, *known.fields] if marks else known.fields,
            [*([0] * len(marks)), *known.sizes] if marks else known.sizes,
            [0.0 if isinstance(value, str) else float(value) for value in values],
            [value for value in values if isinstance(value, str)],
        )
