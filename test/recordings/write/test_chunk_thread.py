"""The thread that compresses and writes chunks: order, one at a time, errors, its end."""

from __future__ import annotations

import gc
import itertools
import threading
import time
from pathlib import Path

import pytest
from waiting import wait_until

from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import Int16, String
from automax_ros.messages.types.topics import VALUE
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.mcap.mcap_output import McapOutput
from automax_ros.recordings.write.data_file import ChunkThread, DataFile
from automax_ros.recordings.write.writer import AT_ONCE_BYTES, BagWriter

INT16 = "std_msgs/msg/Int16"
HALF = 500_000_000


def recording_threads() -> int:
    return sum(thread.name == "recording" for thread in threading.enumerate())


def test_jobs_are_done_in_order_and_one_at_a_time() -> None:
    thread, done, under_way = ChunkThread(), [], []

    def job(number: int) -> None:
        under_way.append(number)
        time.sleep(0.002 * (number % 3))
        assert under_way == [number]
        under_way.remove(number)
        done.append(number)

    for number in range(20):
        thread.hand(lambda number=number: job(number))
    thread.settle()
    assert done == list(range(20))
    thread.end()


def test_whoever_hands_over_goes_on_meanwhile() -> None:
    thread, gate = ChunkThread(), threading.Event()
    thread.hand(gate.wait)
    gate.set()  # is only reached while the job waits for it
    thread.settle()
    thread.end()


def test_others_may_wait_too() -> None:
    thread, gate, waited = ChunkThread(), threading.Event(), []
    thread.hand(gate.wait)
    others = [threading.Thread(target=lambda: (thread.settle(), waited.append(1))) for _ in range(3)]
    for other in others:
        other.start()
    gate.set()
    for other in others:
        other.join(240)
    assert len(waited) == 3
    thread.end()


def test_an_error_is_told_once_to_the_next() -> None:
    def refuse() -> None:
        raise OSError(28, "full")

    thread = ChunkThread()
    thread.hand(refuse)
    with pytest.raises(OSError, match="full"):
        thread.settle()
    thread.settle()
    thread.hand(refuse)
    with pytest.raises(OSError, match="full"):
        thread.hand(lambda: pytest.fail("is carried out"))
    thread.end()


def test_a_job_whose_call_was_lost_is_done() -> None:
    """A signal may strike between the two steps of handing over."""
    thread, done = ChunkThread(), []
    thread.hand(lambda: None)
    thread.settle()
    thread._jobs.append(lambda: done.append(1))
    thread.settle()
    assert done == [1]
    thread.end()


def test_the_thread_ends_with_its_object_and_with_the_writer(tmp_path: Path) -> None:
    before = recording_threads()
    thread = ChunkThread()
    thread.hand(lambda: None)
    thread.settle()
    assert recording_threads() == before + 1
    del thread
    gc.collect()
    with BagWriter(tmp_path / "bag") as writer:
        channel = writer.channel("/a", INT16, VALUE)
        for number in range(4):
            writer.write(channel, number * HALF, encode(Int16(number)))
    wait_until(lambda: recording_threads() <= before)


def test_a_chunk_that_fails_on_the_thread_is_an_error_of_the_writer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    writer = BagWriter(tmp_path / "bag")
    channel = writer.channel("/a", INT16, VALUE)
    monkeypatch.setattr(McapOutput, "add_chunk", refuse)
    writer.write(channel, 0, encode(Int16(1)))

    def fill() -> None:
        for number in range(1, 4):
            writer.write(channel, number * HALF, encode(Int16(1)))

    with pytest.raises(RecordingError, match=r"AMX6801.*No space left"):
        fill()
    writer.close()


def test_an_attachment_stands_after_the_chunk_under_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow the thread is: what is in the file does not depend on the host."""
    slow, add_chunk = tmp_path / "slow", McapOutput.add_chunk
    for folder in (tmp_path / "quick", slow):
        if folder == slow:
            monkeypatch.setattr(McapOutput, "add_chunk", lambda *given: (time.sleep(0.05), add_chunk(*given)))
        with BagWriter(folder) as writer:
            channel = writer.channel("/a", INT16, VALUE)
            for number in range(6):
                writer.write(channel, number * HALF, encode(Int16(number)))
                writer.attach(f"{number}.txt", "text/plain", b"x" * number)
    assert (slow / "scans_0.mcap").read_bytes() == (tmp_path / "quick" / "scans_0.mcap").read_bytes()


@pytest.mark.parametrize("size", [10, AT_ONCE_BYTES + 1])
@pytest.mark.parametrize("pace", [True, False])
def test_where_no_clock_is_kept_pace_with_small_chunks_are_written_at_once(
    tmp_path: Path, size: int, *, pace: bool
) -> None:
    """And the file is the same: see below."""
    before = recording_threads()
    with BagWriter(tmp_path / "bag", keeps_pace=lambda: pace) as writer:
        channel = writer.channel("/a", "std_msgs/msg/String", VALUE)
        for number in range(4):
            writer.write(channel, number * HALF, encode(String("x" * size)))
        at_once = not pace and size < AT_ONCE_BYTES
        assert recording_threads() == before + (not at_once)


def test_who_writes_a_chunk_makes_no_difference_to_the_file(tmp_path: Path) -> None:
    """Pace may be kept from one chunk to the next, as where a halted rack is stepped."""
    paces = {"thread": [True], "at once": [False], "in turn": [True, False]}
    for name, turns in paces.items():
        pace = itertools.cycle(turns)
        with BagWriter(tmp_path / name, keeps_pace=lambda pace=pace: next(pace)) as writer:
            channel = writer.channel("/a", "std_msgs/msg/String", VALUE)
            for number in range(12):
                size = AT_ONCE_BYTES * 2 if number % 5 == 3 else number
                writer.write(channel, number * HALF, encode(String("x" * size)))
    files = {(tmp_path / name / "scans_0.mcap").read_bytes() for name in paces}
    assert len(files) == 1
    assert len({(tmp_path / name / "metadata.yaml").read_bytes() for name in paces}) == 1


def test_a_chunk_that_fails_at_once_is_an_error_of_the_writer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    writer = BagWriter(tmp_path / "bag", keeps_pace=lambda: False)
    channel = writer.channel("/a", INT16, VALUE)
    writer.write(channel, 0, encode(Int16(1)))
    monkeypatch.setattr(DataFile, "write", refuse)
    with pytest.raises(RecordingError, match=r"AMX6801.*No space left"):
        writer.write(channel, HALF, encode(Int16(1)))
    with pytest.raises(RecordingError, match="after the recording was closed"):
        writer.write(channel, HALF, encode(Int16(1)))
    writer.close()
