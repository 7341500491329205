"""Recorded states of tasks: restored whole, or field by field into an edited task; compared bit for bit."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.language.program import Program
from automax_ros.messages.types.messages import HELD_MARK, TaskState
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.runtime.scan.error_log import LOG_FIELD, LOG_NUMBERS
from automax_ros.runtime.tasks.task import Task

_STRING = "$"
"""Type character of strings; only locals can be strings in a state."""


@dataclass(frozen=True)
class Takeover:
    """A state for a task's layout; ``initial`` are the fields without a fitting recorded one."""

    values: list[Value]
    initial: tuple[str, ...]


def recorded_fields(bag: Path, state: TaskState) -> dict[str, tuple[Value, ...]]:
    """Return the values of a state by field.

    Raises:
        BagError: its lists are inconsistent.
    """
    _check_lengths(bag, state)
    texts = iter(state.text)
    fields: dict[str, tuple[Value, ...]] = {}
    position = 0
    for name, size in zip(state.field, state.size, strict=True):
        if name.endswith(_STRING):
            found: tuple[Value, ...] = tuple(islice(texts, size))
            if len(found) < size:
                raise wrong_state(bag, state, f"{name[:40]!r} lacks its text")
        else:
            found = tuple(state.value[position : position + size])
        fields[name] = found
        position += size
    return fields


def whole_state(bag: Path, layout: Layout, state: TaskState) -> Takeover:
    """Return a state for the layout that it was recorded with, each value in its field's type.

    Raises:
        BagError: it does not fit the layout.
    """
    fields = recorded_fields(bag, state)
    recorded = [item for item in zip(state.field, state.size, strict=True) if not item[0].startswith(HELD_MARK)]
    if [(item.name, item.size) for item in layout.fields] != recorded:
        raise BagError("AMX6831", bag, f"the states of task {state.task[:40]} have other fields than the task")
    return Takeover([value for field in layout.fields for value in _convert(bag, state, field, fields[field.name])], ())


def fitting_state(
    bag: Path, layout: Layout, state: TaskState, before: Layout | None, fresh: Mapping[str, Value]
) -> Takeover:
    """Return a state for an edited task: recorded fields that fit by name, type and size, the others initial values.

    ``before`` is the layout of the recorded task, if it is known. ``fresh`` are fields that get these values instead.

    Raises:
        BagError: the state's lists are inconsistent.
    """
    fields = recorded_fields(bag, state)
    known = {field.name: field for field in before.fields} if before else {}
    values: list[Value] = []
    initial: list[str] = []
    for field in layout.fields:
        taken = None if field.name in fresh else _fitting(field, fields.get(field.name), known.get(field.name))
        if taken is not None:
            values += taken
            continue
        values += [fresh.get(field.name, field.initial)] * field.size
        if field.name not in fresh:
            initial.append(field.name)
    return Takeover(values, tuple(initial))


def _fitting(field: StateField, values: tuple[Value, ...] | None, old: StateField | None) -> list[Value] | None:
    """Return the recorded values of a field in its own type, None if they do not fit it."""
    if values is None or len(values) != field.size:
        return None
    if old is not None and (old.type, old.dimensions) != (field.type, field.dimensions):
        return None
    try:
        return [field.typed(value) for value in values]
    except ValueError:
        return None


def _convert(bag: Path, state: TaskState, field: StateField, values: Sequence[Value]) -> Iterator[Value]:
    try:
        yield from [field.typed(value) for value in values]
    except (ValueError, OverflowError) as error:
        raise wrong_state(bag, state, str(error)) from error


def state_differences(bag: Path, task: Task, state: TaskState) -> list[tuple[str, Value, Value]]:
    """Return the fields in which a task's state differs from the recorded one: name, recorded and own value.

    An array's name has the index of the value.

    Raises:
        BagError: the state does not fit the task's layout.
    """
    own = task.snapshot()
    if len(own) != len(state.value):
        raise wrong_state(bag, state, f"{len(state.value)} values instead of {len(own)}")
    numbers = [0.0 if isinstance(value, str) else float(value) for value in own]
    texts = [value for value in own if isinstance(value, str)]
    packing = struct.Struct(f"<{len(numbers)}d")
    if texts == list(state.text) and packing.pack(*numbers) == packing.pack(*state.value):
        return []
    recorded_texts = iter(state.text)
    found: list[tuple[str, Value, Value]] = []
    position = 0
    for field in task.layout.fields:
        for index in range(field.size):
            value: Value = state.value[position]
            if isinstance(own[position], str):
                value = next(recorded_texts, "")
                same = value == own[position]
            else:
                same = struct.pack("<d", numbers[position]) == struct.pack("<d", value)
            if not same:
                found.append((f"{field.name}({index})" if field.is_array else field.name, value, own[position]))
            position += 1
    return found


def held_in(bag: Path, task: Task, state: TaskState) -> dict[str, Value]:
    """Return the locals that are forced after a state, with their values, as far as the task has them.

    Raises:
        BagError: the state's lists are inconsistent, or a value is one that the local cannot have.
    """
    names = [name.removeprefix(HELD_MARK) for name in state.field if name.startswith(HELD_MARK)]
    if not names:
        return {}
    fields = recorded_fields(bag, state)
    known = {field.name: field for field in task.layout.fields if field.role is Role.LOCAL and not field.is_array}
    found: dict[str, Value] = {}
    for name in names:
        if name in known and len(fields.get(name, ())) == 1 and known[name].type is not DataType.STRING:
            found[name] = next(_convert(bag, state, known[name], fields[name]))
    return found


def log_is_empty(state: TaskState) -> bool:
    """Return whether the error log is empty in a state."""
    return list(state.field[-1:]) == [LOG_FIELD] and not any(state.value[-LOG_NUMBERS:])


def tunable_names(layout: Layout) -> list[str]:
    """Return the tunables of a layout."""
    return [field.name for field in layout.fields if field.role is Role.TUNABLE]


def places_of(bag: Path, state: TaskState, names: Sequence[str]) -> dict[str, int]:
    """Return the places of the single numbers of these names in a state's values.

    Raises:
        BagError: the state's lists are inconsistent.
    """
    _check_lengths(bag, state)
    places: dict[str, int] = {}
    position = 0
    for name, size in zip(state.field, state.size, strict=True):
        if size == 1 and name in names:
            places[name] = position
        position += size
    return places


def current_values(program: Program | None) -> dict[str, Value]:
    """Return the value that each tunable has at installation (CURRENT=)."""
    symbols = program.symbols.values() if program else ()
    return {symbol.name: symbol.tuning.current for symbol in symbols if symbol.tuning is not None}


def _check_lengths(bag: Path, state: TaskState) -> None:
    if len(state.field) != len(state.size) or sum(state.size) != len(state.value):
        raise wrong_state(bag, state, "lists of different length")


def wrong_state(bag: Path, state: TaskState, reason: str) -> BagError:
    """Return the error for a state that no task can have."""
    when = seconds_text(max(state.stamp, 0))
    return BagError("AMX6813", bag, f"wrong state of task {state.task[:40]} at {when} s: {reason}")
