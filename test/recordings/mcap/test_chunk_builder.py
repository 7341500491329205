import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.records import Message, Schema

from automax_ros.recordings.mcap.mcap_output import ChunkBuilder, record_bytes

TIMES = st.sampled_from([0, 1, (1 << 62) - 1, 1 << 62, (1 << 63) - 1, 1 << 63, (1 << 64) - 1]) | st.integers(
    0, (1 << 64) - 1
)
MESSAGES = st.lists(
    st.tuples(
        st.sampled_from([1, 2, 32767, 32768, 65535]),
        st.sampled_from([0, 7, (1 << 31) - 1, 1 << 31, (1 << 32) - 1]),
        TIMES,
        TIMES,
        st.binary(max_size=40),
    ),
    max_size=12,
)


@given(MESSAGES)
def test_a_chunk_holds_the_records_of_the_package_mcap_and_where_they_stand(messages):
    chunk, expected, index = ChunkBuilder(), RecordBuilder(), {}
    schema = Schema(id=1, name="a", encoding="b", data=b"c")
    chunk.add_record(schema)
    schema.write(expected)
    for channel, sequence, log_time, publish_time, payload in messages:
        index.setdefault(channel, []).extend((log_time, chunk.size))
        chunk.add_message(channel, sequence, log_time, publish_time, payload)
        Message(channel, log_time, payload, publish_time, sequence).write(expected)
    assert chunk.data == expected.end()
    assert chunk.size == len(chunk.data)
    assert chunk.has_messages is bool(messages)
    assert list(chunk.index) == list(index)
    assert chunk.index == {channel: struct.pack(f"<{len(item)}Q", *item) for channel, item in index.items()}
    times = [message[2] for message in messages] or [-1]
    assert (chunk.first_time, chunk.last_time) == (min(times), max(times))

    elsewhere = ChunkBuilder(index)
    assert (elsewhere.index, elsewhere.data) == (chunk.index, b"")
    assert (elsewhere.first_time, elsewhere.last_time) == (chunk.first_time, chunk.last_time)


def test_a_record_alone_is_not_a_message():
    chunk = ChunkBuilder()
    schema = Schema(id=1, name="a", encoding="b", data=b"c")
    chunk.add_record(schema)
    assert (chunk.data, chunk.has_messages, chunk.index) == (record_bytes(schema), False, {})


@pytest.mark.parametrize(
    "numbers", [(-1, 0, 0, 0), (1 << 16, 0, 0, 0), (1, -1, 0, 0), (1, 0, -1, 0), (1, 0, 0, 1 << 64)]
)
def test_what_does_not_fit_adds_nothing(numbers):
    chunk = ChunkBuilder()
    with pytest.raises(OverflowError):
        chunk.add_message(*numbers, b"payload")
    assert (chunk.data, chunk.size, chunk.index, chunk.last_time) == (b"", 0, {}, -1)
