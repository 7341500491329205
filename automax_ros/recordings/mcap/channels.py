"""Checks of a channel's message definition against our decoders, and its recorded quality of service.

The quality of service is in the words of rosbag2 or in its older numbers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mcap.records import Schema

from automax_ros.core.yaml_text import YamlFault, read_data
from automax_ros.messages.types.definitions import (
    MAX_SCHEMA_BYTES,
    DefinitionError,
    message_types,
    parse_schema,
    same_layout,
)
from automax_ros.messages.types.topics import QosProfile
from automax_ros.recordings.mcap.errors import BagError

_MAX_NAME = 247


def require_known(file: Path, topic: str, schema: Schema | None) -> Schema:
    """Return the schema of a topic whose messages can be decoded here.

    Raises:
        BagError: the type is unknown, or was recorded with another definition.
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


MAX_QOS_BYTES = 1 << 16
"""Longest text of a recorded quality of service that is read, in bytes (decision: a bound on untrusted recordings)."""
MAX_DEPTH = 10_000
"""Greatest history depth that playback requests, whatever was recorded (decision: ROS would hold as many messages)."""
STREAM = QosProfile("reliable", "volatile", "keep_last", 1000)
"""Quality of service of a topic for which none was recorded."""
_KEEP_ALL_DEPTH = 1000
_NESTING = 6
_RELIABILITY = {"1": "reliable", "2": "best_effort"}
_DURABILITY = {"1": "transient_local", "2": "volatile"}
_HISTORY = {"1": "keep_last", "2": "keep_all"}


def recorded_qos(text: str) -> QosProfile:
    """Return the first profile of ``offered_qos_profiles``; values that cannot be read are those of ``STREAM``."""
    profiles = _load(text)
    profile = profiles[0] if isinstance(profiles, list) and profiles else None
    if not isinstance(profile, dict):
        return STREAM
    reliability = _word(profile, "reliability", _RELIABILITY, STREAM.reliability)
    durability = _word(profile, "durability", _DURABILITY, STREAM.durability)
    keeps_all = _word(profile, "history", _HISTORY, STREAM.history) == "keep_all"
    return QosProfile(reliability, durability, "keep_last", _KEEP_ALL_DEPTH if keeps_all else _depth(profile))


def _word(profile: dict[Any, Any], key: str, numbers: dict[str, str], otherwise: str) -> str:
    word = str(profile.get(key, "")).lower()
    word = numbers.get(word, word)
    return word if word in numbers.values() else otherwise


def _depth(profile: dict[Any, Any]) -> int:
    text = str(profile.get("depth", ""))
    depth = int(text) if text.isascii() and text.isdigit() and len(text) < 20 else 0
    return min(depth, MAX_DEPTH) if depth else STREAM.depth


def _load(text: str) -> Any:
    """Return the data of YAML of bounded depth without aliases, None for any other text."""
    if len(text) > MAX_QOS_BYTES:
        return None
    try:
        return read_data(text, depth=_NESTING)
    except YamlFault:
        return None
