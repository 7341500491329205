"""Recordings as the official mcap reader and mcap-ros2-support see them: nothing of our own reads here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "bags" / "section_drive"


def decoded(file: Path, topic: str | None = None) -> Iterator[Any]:
    """The messages of an mcap file, of one topic if it is given, decoded by their stored schemas."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for message in reader.iter_decoded_messages(topics=[topic] if topic else None):
            yield message.decoded_message


def summary(file: Path) -> Any:
    """The summary of an mcap file."""
    with file.open("rb") as stream:
        return make_reader(stream).get_summary()


def nanoseconds(stamp: Any) -> int:
    """A builtin_interfaces/Time."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def steps_of(bag: Path, name: str) -> list[tuple[float, float]]:
    """Where a variable of a rack's recording changed: (s of the run, value), by a plain reading of the write log."""
    file = bag / "scans_0.mcap"
    number = origin = None
    steps: list[tuple[float, float]] = []
    for message in decoded(file):
        if hasattr(message, "variables"):
            number = next(item.id for item in message.variables if item.name == name)
            origin = nanoseconds(message.stamp)
        elif hasattr(message, "sequence"):
            assert origin is not None
            time = (nanoseconds(message.stamp) - origin) / 1e9
            for variable, value in zip(message.values.variable, message.values.value, strict=True):
                if variable == number and (not steps or steps[-1][1] != value):
                    if steps and steps[-1][0] == time:
                        steps.pop()
                    steps.append((time, value))
    return steps
