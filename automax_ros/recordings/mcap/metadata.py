"""The description of a rosbag2 recording: metadata.yaml, and its copy inside the mcap file (version 9, ROS 2 Jazzy)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from textwrap import indent
from typing import Any

import yaml

from automax_ros.messages.types.topics import QosProfile

VERSION = 9
ROS_DISTRO = "jazzy"
METADATA_FILE = "metadata.yaml"
_ROOT = "rosbag2_bagfile_information"


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes equal parts in full: not all readers of bags know YAML's anchors."""

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
class FileSummary:
    """One data file of a recording; times in nanoseconds."""

    name: str
    starting_time: int
    duration: int
    message_count: int


@dataclass(frozen=True)
class BagMetadata:
    """The metadata of a recording: its data files in the order of time, at least one, and its topics."""

    files: Sequence[FileSummary]
    topics: Sequence[TopicSummary] = ()
    custom_data: Mapping[str, str] = field(default_factory=dict)

    def document(self, alone: str | None = None) -> str:
        """Return the text of metadata.yaml; ``alone`` is the text of ``information`` if that exists already."""
        if alone is None or any("\n" in text for text in self.custom_data.values()):
            return yaml_text({_ROOT: self.information()})
        # The same text, indented: generating it again takes longer than a second of a rack.
        return f"{_ROOT}:\n{indent(alone, '  ')}"

    def information(self) -> dict[str, Any]:
        """Return the fields of ``rosbag2_bagfile_information``, in the order in which rosbag2 writes them."""
        filled = [file for file in self.files if file.message_count] or self.files[:1]
        start = min(file.starting_time for file in filled)
        end = max(file.starting_time + file.duration for file in filled)
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": end - start},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": sum(file.message_count for file in self.files),
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
            "relative_file_paths": [file.name for file in self.files],
            "files": [
                {
                    "path": file.name,
                    "starting_time": {"nanoseconds_since_epoch": file.starting_time},
                    "duration": {"nanoseconds": file.duration},
                    "message_count": file.message_count,
                }
                for file in self.files
            ],
            "custom_data": dict(sorted(self.custom_data.items())),
            "ros_distro": ROS_DISTRO,
        }


def data_file_name(number: int) -> str:
    """Return the name of a data file by its number from 0."""
    return f"scans_{number}.mcap"


@cache
def qos_text(qos: QosProfile) -> str:
    """Return the ``offered_qos_profiles`` of a channel with one profile."""
    return yaml_text([qos.as_yaml_data()])


def yaml_text(data: object) -> str:
    """Return data as YAML in the order given; the same data give the same text."""
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=4096)
    return text
