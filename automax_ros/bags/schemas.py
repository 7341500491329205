"""Whether the messages of a recording have the definitions that our decoders expect."""

from __future__ import annotations

from pathlib import Path

from mcap.records import Schema

from automax_ros.bags.errors import BagError
from automax_ros.wire.definitions import MAX_SCHEMA_BYTES, DefinitionError, message_types, parse_schema, same_layout

_MAX_NAME = 247


def require_known(file: Path, topic: str, schema: Schema | None) -> Schema:
    """Return the schema of a topic whose messages can be decoded here.

    Raises:
        BagError: the type is not known, or was recorded with another definition.
    """
    name = schema.name[:_MAX_NAME] if schema else ""
    if schema is None or name not in message_types():
        text = f"topic {topic[:_MAX_NAME]} has messages of type {name!r}, which is not known here"
        raise BagError("AMX6815", file, text)
    if schema.encoding != "ros2msg" or len(schema.data) > MAX_SCHEMA_BYTES:
        text = f"the definition of {name} is in {schema.encoding[:40]!r} or too long"
        hint = "record where the package automax_msgs is installed, so that its .msg files are stored"
        raise BagError("AMX6815", file, text, hint)
    try:
        same = same_layout(name, parse_schema(name, schema.data.decode()))
    except (DefinitionError, UnicodeDecodeError) as error:
        raise BagError("AMX6813", file, f"the definition of {name} cannot be read: {error}") from error
    if not same:
        hint = "use the version of automax_ros that made the recording"
        raise BagError("AMX6815", file, f"{name} was recorded with another definition", hint)
    return schema


def is_known(schema: Schema | None) -> bool:
    """Whether messages of a schema can be decoded here."""
    try:
        require_known(Path(), "", schema)
    except BagError:
        return False
    return True
