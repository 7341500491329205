"""Templates for messages that differ only in a few numbers: all else is packed once, a message then takes one packing.

A rack sends the same kinds of messages for ever: a task's scans with its name, slot and the same variables. Their bytes
are those of ``messages/cdr/cdr.py``. Only numbers, times and sequences of numbers can vary; for other messages the
caller uses the codec itself.

Preparing a template costs as much as thirty messages in the codec, so only messages that recur get one (decision: after
eight times), and only as many as a working rack can need.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Hashable, Sequence
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import Message
from automax_ros.messages.cdr.parts import CODES, HEADER, size_of
from automax_ros.messages.types.definitions import TIME, Field, message_types
from automax_ros.messages.types.messages import NAMES

ENOUGH_TIMES = 8
"""How often the codec packs messages of one pattern before a template is prepared for them."""
MOST_PATTERNS = 2048
"""Most patterns that are known at a time: an array's elements in turn would make more and more."""


class MessageTemplate:
    """Packs messages that differ from one only in some fields.

    The arguments of ``pack`` are the first of ``constants``, the numbers of the first group that varies, the second
    constant, those of the second group, and so on to the last constant. A time is two numbers: seconds and nanoseconds.
    """

    # Not a NamedTuple: compiled code accesses the attributes of a native class directly.
    __slots__ = ("constants", "pack")

    def __init__(self, pack: Callable[..., bytes], constants: tuple[bytes, ...]) -> None:
        self.pack = pack
        self.constants = constants


class _Builder:
    """Divides a message into constants and fields that vary."""

    def __init__(self, groups: Sequence[Sequence[str]]) -> None:
        self._group_of = {name: number for number, names in enumerate(groups) for name in names}
        self._group = -1
        self._position = 0
        self._format = ""
        self._fixed = f"{len(HEADER)}s"
        self._values: list[Any] = [HEADER]
        self._constants: list[bytes] = []

    def add_message(self, type_name: str, message: Message, prefix: str = "") -> None:
        for field, value in zip(message_types()[type_name].definition.fields, message, strict=True):
            self._add_field(field, value, self._group_of.get(prefix + field.name, -1), f"{prefix}{field.name}.")

    def finish(self) -> MessageTemplate:
        self._cut()
        return MessageTemplate(struct.Struct(f"<{self._format}").pack, tuple(self._constants))

    def _add_field(self, field: Field, value: Any, group: int, prefix: str) -> None:
        if field.kind == TIME:
            seconds, rest = divmod(value, NS_PER_S)
            self._add("i", (seconds,), group)
            self._add("I", (rest,), group)
        elif field.kind in CODES:
            if field.array:
                self._add("I", (len(value),))
            self._add(CODES[field.kind], value if field.array else (value,), group)
        elif field.kind == "string":
            if field.array:
                self._add("I", (len(value),))
            for text in value if field.array else (value,):
                data = text.encode() + b"\0"
                self._add("I", (len(data),))
                self._add("s", (data,))
        elif field.array:
            self._add("I", (len(value),))
            for item in value:
                self.add_message(field.kind, item, prefix)
        else:
            self.add_message(field.kind, value, prefix)

    def _add(self, code: str, values: Sequence[Any], group: int = -1) -> None:
        """Add values of one code with the padding before them; of a group that varies only their number counts."""
        if group >= 0 and group != self._group:
            if group != len(self._constants):
                raise ValueError("the groups are not fields in order, each group together")
            self._pad(code, needed=bool(values), fixed=True)
            self._cut()
            self._group = group
        elif group < 0:
            self._group = -1
            self._pad(code, needed=bool(values), fixed=True)
        else:
            self._pad(code, needed=bool(values), fixed=False)
        if code == "s":
            self._fixed += f"{len(values[0])}s"
            self._values += values
            self._position += len(values[0])
            return
        if group < 0:
            self._fixed += code * len(values)
            self._values += values
        else:
            self._format += f"{len(values)}{code}" if values else ""
        self._position += size_of(code) * len(values)

    def _pad(self, code: str, *, needed: bool, fixed: bool) -> None:
        padding = -self._position % size_of(code) if needed else 0
        self._position += padding
        if padding and fixed:
            self._fixed += f"{padding}x"
        elif padding:
            self._format += f"{padding}x"

    def _cut(self) -> None:
        constant = struct.pack(f"<{self._fixed}", *self._values)
        self._constants.append(constant)
        self._format += f"{len(constant)}s"
        self._fixed, self._values = "", []


def prepared(message: Message, *groups: Sequence[str]) -> MessageTemplate:
    """Return the template of messages that differ from one only in the numbers of some fields.

    Args:
        message: one of them; its class determines the type. Sequences keep their length.
        groups: names of the fields that vary, in order, those of nested messages as ``latched.value``; the fields of a
            group follow each other.

    Raises:
        struct.error: a value does not fit its field.
        ValueError: the groups are not fields in order.
    """
    name = NAMES[type(message)]
    builder = _Builder(groups)
    builder.add_message(name, message)
    made = builder.finish()
    if len(made.constants) != len(groups) + 1:
        raise ValueError(f"{name} has not all of {groups}")
    return made


class TemplateCache:
    """The patterns of one kind of message. ``known`` has those that are prepared, by key."""

    def __init__(self) -> None:
        self.known: dict[Hashable, MessageTemplate] = {}
        self._seen: dict[Hashable, int] = {}

    def learn(self, key: Hashable, prepare: Callable[[], MessageTemplate]) -> None:
        """Note that a message with a key was packed by the codec."""
        times = self._seen.get(key, 0) + 1
        if times < ENOUGH_TIMES:
            if len(self._seen) >= MOST_PATTERNS:
                self._seen.clear()
            self._seen[key] = times
            return
        self._seen.pop(key, None)
        if len(self.known) >= MOST_PATTERNS:
            self.known.clear()
        self.known[key] = prepare()
