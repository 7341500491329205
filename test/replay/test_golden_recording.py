"""The recording in bags/ is what the example rack does today, message for message."""

from __future__ import annotations

from pathlib import Path

from rack.helpers import rack_at

from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "bags" / "section_drive"
SECONDS = 10.0


def messages(bag: Path) -> list[tuple[str, int, object]]:
    return [(entry.topic, entry.log_time, entry.message) for entry in BagReader(bag).messages()]


def test_the_example_rack_does_what_the_recording_says(tmp_path: Path) -> None:
    rack = rack_at(ROOT / "config" / "section_drive" / "rack.yaml")
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    rack.run(SECONDS)
    stream.end()
    recorder.close()
    present, golden = messages(tmp_path / "bag"), messages(GOLDEN)
    first = next((pair for pair in zip(present, golden, strict=False) if pair[0] != pair[1]), None)
    assert first is None, f"bags/README.md says how to renew the recording; first difference: {first}"
    assert len(present) == len(golden) > 10_000
