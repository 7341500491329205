"""The description of a rosbag2 recording: metadata.yaml, and its copy inside the mcap file (version 9, ROS 2 Jazzy)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml

VERSION = 9
ROS_DISTRO = "jazzy"
DATA_FILE = "scans_0.mcap"
METADATA_FILE = "metadata.yaml"


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes equal parts in full: readers of bags do not all know YAML's anchors."""

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002
        return True


@dataclass(frozen=True)
class TopicSummary:
    """One topic of a recording."""

    name: str
    type_name: str
    type_hash: str
    qos: Sequence[Mapping[str, object]]
    message_count: int


@dataclass(frozen=True)
class BagMetadata:
    """What a recording holds; times in nanoseconds."""

    starting_time: int
    duration: int
    message_count: int
    topics: Sequence[TopicSummary] = ()
    custom_data: Mapping[str, str] = field(default_factory=dict)
    data_files: Sequence[str] = (DATA_FILE,)

    def information(self) -> dict[str, Any]:
        """The fields of ``rosbag2_bagfile_information``, in the order in which rosbag2 writes them."""
        starting_time = {"nanoseconds_since_epoch": self.starting_time}
        duration = {"nanoseconds": self.duration}
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": starting_time,
            "message_count": self.message_count,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type_name,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": list(topic.qos),
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": topic.message_count,
                }
                for topic in self.topics
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": list(self.data_files),
            "files": [
                {
                    "path": name,
                    "starting_time": starting_time,
                    "duration": duration,
                    "message_count": self.message_count,
                }
                for name in self.data_files
            ],
            "custom_data": dict(sorted(self.custom_data.items())),
            "ros_distro": ROS_DISTRO,
        }


def yaml_text(data: object) -> str:
    """Data as YAML in the order given; the same data give the same text."""
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=4096)
    return text
