"""Recordings as programs of others read them: the official mcap reader and rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader as RosbagsReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def assert_mcap_reads(file: Path) -> int:
    """Let the official reader check checksums, summary and schemas; return the number of messages."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        by_index = [message.log_time for _, _, message in reader.iter_messages()]
        assert by_index == sorted(by_index)
        assert len(by_index) == summary.statistics.message_count
        assert summary.statistics.chunk_count == len(summary.chunk_indexes)
        assert summary.statistics.attachment_count == len(summary.attachment_indexes)
        assert len(list(reader.iter_attachments())) == summary.statistics.attachment_count
        assert [item.name for item in reader.iter_metadata()] == ["rosbag2"]
        stream.seek(0)
        assert sum(1 for _ in reader.iter_decoded_messages()) == len(by_index)
    return len(by_index)


def rosbags_messages(folder: Path) -> list[tuple[str, int, Any]]:
    """Let rosbags read and decode every message: topic, time and message."""
    store = get_typestore(Stores.EMPTY)
    known: set[str] = set()
    with RosbagsReader(folder) as reader:
        for connection in reader.connections:
            if connection.msgtype not in known:
                known.add(connection.msgtype)
                store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        read = [
            (connection.topic, time, store.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
        assert len(read) == reader.message_count
    return read
