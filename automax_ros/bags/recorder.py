"""The recorder: a rack's stream into a bag, with the rack's file and all sources stored inside."""

from __future__ import annotations

from pathlib import Path

import automax_ros
from automax_ros.bags.errors import RecordingError
from automax_ros.bags.rack_stream import RackStream, Topic
from automax_ros.bags.writer import BagWriter, Channel
from automax_ros.rack.rack import Rack


class Recorder:
    """Records one run. Make it before the rack is started; ``close`` finishes the bag.

    When the disk refuses, recording ends and ``failure`` tells why; the rack goes on.
    """

    def __init__(self, rack: Rack, stream: RackStream, folder: Path) -> None:
        """Create the bag and take part in the stream.

        Raises:
            RecordingError: the folder exists already or cannot be written.
        """
        self.failure: RecordingError | None = None
        config = rack.config
        self._writer = BagWriter(
            folder,
            custom_data={
                "rack": config.name,
                "version": automax_ros.__version__,
                "fingerprint": f"{rack.fingerprint:016x}",
            },
        )
        self._writer.attach("rack.yaml", "application/yaml", config.text.encode())
        for name, source in rack.sources.items():
            self._writer.attach(f"{name}.BLK", "text/plain", source.text.encode("utf-8", "replace"))
        self._channels: dict[str, Channel] = {
            topic.name: self._writer.channel(topic.name, topic.type_name, topic.qos) for topic in stream.topics
        }
        stream.add_sink(self._take)

    def close(self) -> None:
        """Finish the bag.

        Raises:
            RecordingError: the disk refuses.
        """
        if self.failure is None:
            self._writer.close()

    def _take(self, topic: Topic, stamp: int, payload: bytes) -> None:
        if self.failure is not None:
            return
        try:
            self._writer.write(self._channels[topic.name], stamp, payload)
        except RecordingError as error:
            self.failure = error
