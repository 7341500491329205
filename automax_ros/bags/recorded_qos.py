"""The quality of service that a recording gives for a topic, in the words of rosbag2 or its older numbers."""

from __future__ import annotations

from typing import Any

from automax_ros.core.yaml_text import YamlFault, read_data
from automax_ros.wire.qos import QosProfile

MAX_QOS_BYTES = 1 << 16
"""Longest text of a recorded quality of service that is read, in bytes (decision: a bound on untrusted recordings)."""
MAX_DEPTH = 10_000
"""Deepest history that playback asks for, whatever was recorded (decision: ROS would hold as many messages)."""
STREAM = QosProfile("reliable", "volatile", "keep_last", 1000)
"""What a topic gets for which nothing was recorded."""
_KEEP_ALL_DEPTH = 1000
_NESTING = 6
_RELIABILITY = {"1": "reliable", "2": "best_effort"}
_DURABILITY = {"1": "transient_local", "2": "volatile"}
_HISTORY = {"1": "keep_last", "2": "keep_all"}


def recorded_qos(text: str) -> QosProfile:
    """Return the first profile of ``offered_qos_profiles``; what cannot be read is that of a stream."""
    profiles = _loaded(text)
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


def _loaded(text: str) -> Any:
    """Load YAML of bounded depth without aliases, None where the text is something else."""
    if len(text) > MAX_QOS_BYTES:
        return None
    try:
        return read_data(text, depth=_NESTING)
    except YamlFault:
        return None
