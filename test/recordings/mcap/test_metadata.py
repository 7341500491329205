"""The description of a recording as text: made once, and set further in where a file holds all of it."""

from __future__ import annotations

import pytest
import yaml

from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.recordings.mcap.metadata import BagMetadata, FileSummary, TopicSummary, yaml_text

FILES = [FileSummary("scans_0.mcap", 5, 2_000_000_000, 12)]
TOPICS = [
    TopicSummary("/line1/scans", "automax_msgs/msg/Scan", "RIHS01_ab", [SCAN.as_yaml_data()], 10),
    TopicSummary("/line1/variables", "automax_msgs/msg/VariableTable", "RIHS01_cd", [LATCHED.as_yaml_data()], 2),
]


@pytest.mark.parametrize(
    "custom",
    [{}, {"rack": "PM1", "version": "1.0"}, {"note": "two\nlines\n\n  and a third"}, {"note": "- a: 'b' # c", "": " "}],
)
@pytest.mark.parametrize("topics", [[], TOPICS])
def test_a_text_that_is_there_already_gives_the_same_document(custom, topics):
    metadata = BagMetadata(FILES, topics, custom)
    document = metadata.document(yaml_text(metadata.information()))
    assert document == metadata.document()
    assert yaml.safe_load(document) == {"rosbag2_bagfile_information": metadata.information()}
