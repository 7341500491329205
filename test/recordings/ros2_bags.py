"""A recording as `ros2 bag record` makes it of a rack that runs already: in the order of arrival and of discovery."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mcap.writer import Writer as McapWriter

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.definitions import schema_text
from automax_ros.messages.types.messages import String
from automax_ros.messages.types.rack_files import files_of, files_text
from automax_ros.messages.types.topics import LATCHED, SCAN, Take, Topic
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.metadata import BagMetadata, FileSummary, yaml_text
from automax_ros.recordings.write.recorder import Recorder

EPOCH = 1_700_000_000 * NS_PER_S
"""The wall clock when the run begins."""
JOINED_NS = 400 * NS_PER_MS
"""When the recorder has found the first topic; the others follow, each a few ms later."""
_ROUND_NS = 20 * NS_PER_MS
"""So long the recorder is busy with one topic's messages before it looks at the next."""


class Sent(NamedTuple):
    """A message as it left the rack; times in ns of the wall clock."""

    topic: str
    type_name: str
    sent: int
    payload: bytes


@dataclass
class Listener:
    """Takes all that a rack sends, with the time of sending: a little later than the stamp, one after the other."""

    sent: list[Sent] = field(default_factory=list)

    def take(self, topic: Topic) -> Take:
        """Return what takes the messages of a topic."""

        def take(stamp: int, payload: bytes) -> None:
            before = self.sent[-1].sent if self.sent else 0
            self.sent.append(Sent(topic.name, topic.type_name, max(before + 1000, stamp + 200_000), payload))

        return take


def recorded_twice(
    rack: Rack, folder: Path, steps: Callable[[Rack, int], None], slices: int = 20, seconds: float = 2.0
) -> tuple[Path, Path]:
    """Record a run by our own recorder and as `ros2 bag record` does; return both folders."""
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "ours")
    listener = Listener()
    stream.add_sink(listener.take)
    stream.begin(EPOCH)
    rack.start()
    for number in range(slices):
        steps(rack, number)
        rack.run(seconds / slices)
        if rack.now_ns == JOINED_NS + 100 * NS_PER_MS:  # what a rack does when a late joiner has subscribed
            stream.send_image()
            for processor in rack.task_modules:
                stream.send_states(processor.config.slot)
    stream.end()
    recorder.close()
    space = f"/{rack.config.namespace}"
    config = encode(String(files_text(rack.config.name, files_of(rack))))
    files = Sent(f"{space}/config", "std_msgs/msg/String", EPOCH - 2_100 * NS_PER_MS, config)
    return folder / "ours", ros2_bag(folder / "theirs", [files, *listener.sent])


def ros2_bag(folder: Path, sent: list[Sent], joined_ns: int = EPOCH + JOINED_NS) -> Path:
    """Write the bag of a recorder that finds the first topic at a time of the wall clock."""
    topics = sorted({item.topic for item in sent}, key=lambda name: (_DISCOVERED.get(name.split("/", 2)[2], 3), name))
    joined = {name: joined_ns + number * NS_PER_MS for number, name in enumerate(topics)}
    latched: dict[str, Sent] = {}
    arrived: list[tuple[int, Sent]] = []
    for item in sent:
        if item.sent >= joined[item.topic]:
            arrived.append((item.sent + 100_000, item))
        elif item.topic.rsplit("/", 1)[1] not in _STREAMS:
            latched[item.topic] = item
    arrived += [(joined[item.topic], item) for item in latched.values()]
    arrived.sort(key=lambda entry: (entry[0] // _ROUND_NS, topics.index(entry[1].topic), entry[0]))
    folder.mkdir()
    with (folder / "theirs_0.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2", library="libmcap")
        channels: dict[str, int] = {}
        for time, item in arrived:
            if item.topic not in channels:
                schema = writer.register_schema(item.type_name, "ros2msg", schema_text(item.type_name).encode())
                qos = SCAN if item.topic.rsplit("/", 1)[1] in _STREAMS else LATCHED
                metadata = {"offered_qos_profiles": yaml_text([qos.as_yaml_data()])}
                channels[item.topic] = writer.register_channel(item.topic, "cdr", schema, metadata)
            writer.add_message(channels[item.topic], time, item.payload, item.sent)
        writer.finish()
    times = [time for time, _ in arrived]
    summary = FileSummary("theirs_0.mcap", min(times), max(times) - min(times), len(times))
    text = yaml_text({"rosbag2_bagfile_information": BagMetadata([summary]).information()})
    (folder / "metadata.yaml").write_text(text)
    return folder


_STREAMS = ("backplane", "scans", "states")
_DISCOVERED = {"backplane": 0, "scans": 1, "states": 2, "backplane/snapshot": 4, "config": 5, "variables": 6}
"""The order in which topics are discovered: nobody chooses it; the table of variables last is the hardest."""
