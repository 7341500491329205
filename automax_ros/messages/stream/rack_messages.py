"""The messages of a running rack: variable table, images, write log, scans, states, values of commons."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import partial
from math import prod
from typing import Any

from automax_ros.core.kinds import Direction, WriteKind
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import CdrError, encoder
from automax_ros.messages.stream.task_messages import TaskMessages
from automax_ros.messages.stream.templates import prepared
from automax_ros.messages.stream.write_messages import WriteMessages
from automax_ros.messages.types.messages import (
    NAMES,
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
    String,
    UInt8MultiArray,
    Values,
    Variable,
    VariableTable,
    Writer,
)
from automax_ros.rack.base.observers import Operation as Done
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.ros_names import topic_names
from automax_ros.rackfile.model.writers import PRESET_WRITER
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import Task

Message = tuple[object, ...]
SCALED_TYPE = NAMES[Float32]
"""The ROS type of a variable with a scale: a number in the engineering unit."""
_SCALARS: dict[DataType, Any] = {
    DataType.INTEGER: Int16,
    DataType.DOUBLE: Int32,
    DataType.REAL: Float32,
    DataType.BOOLEAN: Bool,
    DataType.STRING: String,
}
"""The message classes of simple variables: each is created from the value."""
_ARRAYS: dict[DataType, Any] = {
    DataType.INTEGER: Int16MultiArray,
    DataType.DOUBLE: Int32MultiArray,
    DataType.REAL: Float32MultiArray,
    DataType.BOOLEAN: UInt8MultiArray,
}
"""The message classes of arrays: each is created from the layout and the values. std_msgs has none for strings."""


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
    """Return the function that makes the message of a variable's topic from its value, or an array's values in order.

    An array's layout names its dimensions.
    """
    maker: Callable[[Any], Message] = _SCALARS[variable.type]
    if not variable.is_array:
        return maker
    dimensions = variable.dimensions
    parts = [
        MultiArrayDimension(f"subscript{number + 1}", size, prod(dimensions[number:]))
        for number, size in enumerate(dimensions)
    ]
    return partial(_ARRAYS[variable.type], MultiArrayLayout(parts, 0))


def value_encoder(variable: CommonVariable) -> Callable[[Any], bytes]:
    """Return the function that makes the bytes of a variable's message from its value, or an array's values in order.

    The function raises CdrError if the value does not fit.
    """
    encode, make, scale = encoder(topic_type_name(variable) or ""), message_maker(variable), variable.scale
    if variable.is_array:
        return lambda values: encode(make(values))
    if scale is not None:
        # A message of a simple variable has one field: a plain tuple works as well, and is cheaper.
        return lambda value: encode((scale.value_of(value) if isinstance(value, int) else value,))
    if variable.type is DataType.STRING:
        return lambda value: encode((value,))
    alike = prepared(make(variable.type.zero), ("data",))
    pack, (first, last) = alike.pack, alike.constants

    def encode_number(value: Any) -> bytes:
        try:
            return pack(first, value, last)
        except struct.error as error:
            raise CdrError(f"{variable.name}: {error}") from error

    return encode_number


class RackMessages:
    """Makes the messages of one run of a rack.

    ``run_id`` is the number of the run; ``epoch_ns`` is added to rack time to give stamps: 0 in simulated time, else
    the wall clock at the start.
    """

    def __init__(self, rack: Rack, run_id: int) -> None:
        self._rack = rack
        self.run_id = run_id
        self.epoch_ns = 0
        self._write_log = WriteMessages({writer.id: writer.slot for writer in rack.writers})
        image = rack.memory.image()
        self._image_variables = [view for view, _, _ in image]
        self._image_elements = [element for _, element, _ in image]
        self._text_positions = [position for position, entry in enumerate(image) if isinstance(entry[2], str)]
        self._tasks = {task: TaskMessages(task) for task in rack.tasks}

    def of(self, task: Task) -> TaskMessages:
        """Return the object that makes the messages of a task: a new one once it executes another program."""
        known = self._tasks[task]
        if task.compiled is not known.compiled:
            self._tasks[task] = known = TaskMessages(task)
        return known

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
                slots.get(number, config.common_memory_slot),
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
        """Return the present image of common memory."""
        values: list[Any] = []
        for view in range(len(self._rack.memory.specs)):
            present = self._rack.memory.present(view)
            values += present if isinstance(present, list) else [present]
        texts = [values[position] for position in self._text_positions]
        for position in self._text_positions:
            values[position] = 0.0
        image = Values(self._image_variables, self._image_elements, values, texts)
        return CommonImage(self.stamp(now_ns), self.run_id, self._write_log.sequence, image)

    def forces(self, now_ns: int) -> CommonWrite | None:
        """Return the forced values as an entry of the write log; None if there are none: images do not show them."""
        memory = self._rack.memory
        if not memory.forced:
            return None
        entries = ((view, element, memory.read_now(view, element)) for view, element in sorted(memory.forced))
        return self._write_log.message(self.stamp(now_ns), self.run_id, PRESET_WRITER, WriteKind.FORCE, entries)

    def write_bytes(self, groups: Sequence[WriteGroup]) -> list[tuple[int, bytes]]:
        """Return stamp and bytes of the messages of a part of the write log.

        Entries of one writer, kind and instant are in one message.
        """
        return self._write_log.packed(groups, self.epoch_ns, self.run_id)

    def operation(self, operation: Done) -> Operation:
        """Return the message of an operation on the rack."""
        return Operation(
            self.stamp(operation.at_ns),
            self.run_id,
            operation.what,
            operation.task,
            operation.ok,
            operation.reason,
            operation.detail,
        )
