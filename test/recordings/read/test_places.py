"""Reading goes on from a place that an earlier reading has passed: in one file, in several, not in bags of others."""

from __future__ import annotations

from pathlib import Path

import pytest
from replay.replays import SPEED, WORK, YAML, busy, recorded

from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagMessage, BagReader, Place
from automax_ros.recordings.write.recorder import RecordingOptions
from recordings.live_racks import build
from recordings.ros2_bags import recorded_twice


def read_with_places(bag: Path) -> list[tuple[Place, BagMessage]]:
    reader, found = BagReader(bag), []
    for entry in reader.messages():
        assert reader.place is not None
        found.append((reader.place, entry))
    return found


def assert_goes_on_everywhere(bag: Path) -> int:
    found = read_with_places(bag)
    places = {place[:2]: place for place, _ in found}
    for key, place in places.items():
        rest = [entry for other, entry in found if other[:2] > key]
        assert list(BagReader(bag).messages(after=place)) == rest
    return len(places)


def test_reading_goes_on_after_each_chunk(tmp_path: Path) -> None:
    assert assert_goes_on_everywhere(recorded(tmp_path, seconds=5.0)) > 3


def test_reading_goes_on_in_the_next_files(tmp_path: Path) -> None:
    bag = recorded(tmp_path, seconds=5.0, options=RecordingOptions(split_ns=2_000_000_000))
    assert len([*bag.glob("*.mcap")]) > 1
    assert assert_goes_on_everywhere(bag) > 3


def test_only_wanted_types_are_returned_and_the_place_is_that_of_the_new_reading(tmp_path: Path) -> None:
    bag = recorded(tmp_path, seconds=5.0)
    found = read_with_places(bag)
    place = found[len(found) // 2][0]
    reader = BagReader(bag)
    scans = list(reader.messages(types={"automax_msgs/msg/Scan"}, after=place))
    assert 0 < len(scans) < len(found)
    assert reader.place is not None
    assert reader.place.position >= found[-1][0].position
    assert reader.again().place is None


def test_messages_of_other_programs_have_no_place(tmp_path: Path) -> None:
    _, theirs = recorded_twice(build(tmp_path, YAML, SPEED=SPEED, WORK=WORK), tmp_path, busy)
    reader = BagReader(theirs)
    assert next(reader.messages())
    assert reader.place is None


def test_a_damaged_chunk_after_the_place_is_an_error(tmp_path: Path) -> None:
    bag = recorded(tmp_path, seconds=5.0)
    found = read_with_places(bag)
    places = sorted({place[:2]: place for place, _ in found}.values(), key=lambda place: place[:2])
    (file,) = bag.glob("*.mcap")
    data = bytearray(file.read_bytes())
    data[places[1].position - 20] ^= 0xFF
    file.write_bytes(data)
    with pytest.raises(BagError):
        list(BagReader(bag).messages(after=places[0]))
    assert list(BagReader(bag).messages(after=places[1])) == [
        entry for place, entry in found if place[:2] > places[1][:2]
    ]
