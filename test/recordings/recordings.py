"""Recordings and random messages that the tests of this folder share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from automax_ros.core.kinds import Direction, WriteKind, WriterKind
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.definitions import TIME, Field, message_types
from automax_ros.messages.types.messages import (
    CLASSES,
    NAMES,
    CommonImage,
    CommonWrite,
    Int16,
    Scan,
    ScanError,
    Values,
    Variable,
    VariableTable,
    Writer,
)
from automax_ros.messages.types.topics import LATCHED, SCAN, VALUE
from automax_ros.recordings.write.writer import BagWriter

MS = 1_000_000
RUN = 77

TABLE = VariableTable(
    stamp=0,
    rack="LINE1",
    run_id=RUN,
    variables=(
        Variable(0, "REF%", DataType.INTEGER.number, direction=Direction.OUT, topic="/line1/common/REF"),
        Variable(1, "COUNT!", DataType.DOUBLE.number),
        Variable(2, "GAIN", DataType.REAL.number, unit="1/s"),
        Variable(3, "RUN@", DataType.BOOLEAN.number, non_volatile=True),
        Variable(4, "NOTE$", DataType.STRING.number, length=31),
        Variable(5, "TABLE%", DataType.INTEGER.number, dimensions=(2, 3)),
        Variable(6, "REEL$", DataType.STRING.number, length=8),
    ),
    writers=(Writer(1, "SPEED", WriterKind.TASK, 1), Writer(2, "ROS", WriterKind.ROS, 0)),
)


def write_of(
    sequence: int, stamp: int, entries: dict[tuple[int, int], float], texts: tuple[str, ...] = ()
) -> CommonWrite:
    """One entry of the write log."""
    variables = tuple(variable for variable, _ in entries)
    elements = tuple(element for _, element in entries)
    values = Values(variables, elements, tuple(entries.values()), texts)
    return CommonWrite(stamp, RUN, 1, 1, WriteKind.COMMIT, sequence, values)


def image_of(
    sequence: int, stamp: int, entries: dict[tuple[int, int], float], texts: tuple[str, ...] = ()
) -> CommonImage:
    """The whole memory."""
    return CommonImage(stamp, RUN, sequence, write_of(sequence, stamp, entries, texts).values)


def record(folder: Path, messages: list[tuple[str, Any]], **options: Any) -> Path:
    """Write messages to the topics given; each at its own stamp, or at 0."""
    with BagWriter(folder, **options) as writer:
        for topic, message in messages:
            channel = writer.channel(topic, NAMES[type(message)], SCAN if topic.endswith("backplane") else LATCHED)
            writer.write(channel, getattr(message, "stamp", 0), encode(message))
    return folder


def sample_recording(folder: Path, seconds: float = 2.5) -> Path:
    """A small run of a rack: table, image, and at 180 Hz a scan, its write and a value, all at one instant."""
    with BagWriter(folder, custom_data={"program_hash": "a1b2", "step": "5500000"}) as writer:
        table = writer.channel("/line1/variables", NAMES[VariableTable], LATCHED)
        image = writer.channel("/line1/backplane/snapshot", NAMES[CommonImage], LATCHED)
        backplane = writer.channel("/line1/backplane", NAMES[CommonWrite], SCAN)
        scans = writer.channel("/line1/scans", NAMES[Scan], SCAN)
        value = writer.channel("/line1/common/REF", NAMES[Int16], VALUE)
        writer.attach("rack.yaml", "application/yaml", b"rack: LINE1\n")
        writer.write(table, 0, encode(TABLE))
        writer.write(image, 0, encode(image_of(0, 0, {(0, 0): 0, (3, 0): 0})))
        for index in range(int(seconds / 0.0055)):
            stamp = (index + 1) * 5_500_000
            write = write_of(index + 1, stamp, {(0, 0): index % 30000, (3, 0): index % 2})
            error = (ScanError(1030, 7001),) if index % 7 == 0 else ()
            writer.write(scans, stamp, encode(Scan(stamp, 1, "SPEED", index + 1, committed=write.values, errors=error)))
            writer.write(backplane, stamp, encode(write))
            writer.write(value, stamp, encode(Int16(index % 30000)))
    return folder


def without_checksums(file: Path, plain: Path) -> bytes:
    """Write a recording's file again without checksums and compression, and return it."""
    with file.open("rb") as source, plain.open("wb") as target:
        reader = make_reader(source)
        writer = McapWriter(target, enable_crcs=False, enable_data_crcs=False, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="test")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        for item in reader.iter_attachments():
            writer.add_attachment(0, 0, item.name, item.media_type, item.data)
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if schema.name not in schemas:
                schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.topic not in channels:
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", schemas[schema.name])
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
        writer.finish()
    return plain.read_bytes()


_RANGES = {
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "uint64": (0, 2**64 - 1),
    "int64": (-(2**63), 2**63 - 1),
}


def messages(type_name: str) -> st.SearchStrategy[Any]:
    """Random messages of a type, with the edges of every field's range."""
    fields = message_types()[type_name].definition.fields
    return st.builds(CLASSES[type_name], *[_values(field) for field in fields])


def _values(field: Field) -> st.SearchStrategy[Any]:
    one = _single(field.kind)
    return st.lists(one, max_size=6).map(tuple) if field.array else one


def _single(kind: str) -> st.SearchStrategy[Any]:
    if kind == TIME:
        return st.integers(-(2**31) * 1_000_000_000, 2**31 * 1_000_000_000 - 1)
    if kind == "bool":
        return st.booleans()
    if kind == "string":
        return st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\0"), max_size=12)
    if kind.startswith("float"):
        return st.floats(width=32 if kind == "float32" else 64, allow_nan=False)
    if kind in _RANGES:
        return st.integers(*_RANGES[kind])
    return messages(kind)


def table_like() -> st.SearchStrategy[Values]:
    """Random values of numbers as racks send them: as many variables as elements and values, often none."""
    entry = st.tuples(st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1), st.floats(allow_nan=False))
    return st.lists(entry, max_size=12).map(
        lambda entries: Values(*zip(*entries, strict=True)) if entries else Values()
    )
