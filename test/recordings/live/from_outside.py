"""A recording that is made outside the rack, of what the topics that a graph offers have sent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.rack_files import files_of
from automax_ros.rack.rack import Rack
from automax_ros.recordings.live.recording import LiveRecording
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.engine import replay

Offered = Mapping[str, list[str]]


def check_recorded_outside(
    folder: Path, rack: Rack, offered: Callable[[RackStream], Offered], topics: Sequence[str]
) -> tuple[Path, RackStream, LiveTopics]:
    """Run a rack for 0.1 s and record what it sends: the topics are recorded as they were sent, bad bytes are not.

    Return the recording, which replays, the rack's stream, and what the recorder found.
    """
    stream = RackStream(rack, 4711)
    sent: list[tuple[str, bytes]] = []
    stream.add_sink(lambda topic: lambda _, payload: sent.append((topic.name, payload)))
    stream.begin(1_700_000_000_000_000_000)
    rack.start()
    rack.run(0.0951)
    stream.end()
    table = next(payload for topic, payload in sent if topic == "/line1/variables")
    facts: Any = decode("automax_msgs/msg/VariableTable", table)
    assert not LiveTopics("/line1", facts).plants
    found = LiveTopics("/line1", facts, offered(stream))
    recording = LiveRecording(folder / "bag", found, table, files_of(rack))
    for number, (topic, payload) in enumerate(sent):
        recording.take(topic, (number + 1) * 50_000, payload)
    for topic in topics:
        recording.take(topic, len(sent) * 50_000, b"\x00\x01\x00\x00 no message")
    recording.close()
    assert recording.failure is None
    assert recording.malformed == len(topics)
    for topic in topics:
        payloads = [payload for name, payload in sent if name == topic]
        stored = [record.data for record in BagReader(folder / "bag").records() if record.channel.topic == topic]
        assert stored == payloads
        assert len(stored) == 10
    assert replay(folder / "bag").identical
    return folder / "bag", stream, found
