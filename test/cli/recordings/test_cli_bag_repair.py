"""`automax bag repair`: text, JSON, exit codes."""

import json

import pytest

from cli.run.test_run import RACK, TASK


@pytest.fixture
def bag(automax):
    """A recording of 3.5 s in the folder of the test."""
    automax.write("rack.yaml", RACK)
    automax.write("TASK.BLK", TASK)
    automax("run", "rack.yaml", "--simulated", "--duration", "3.5", "--record", "bag")
    return automax.folder / "bag"


def break_off(bag):
    """Leave of a recording what a killed writer leaves: six whole chunks and a part of the seventh."""
    data = (bag / "scans_0.mcap").read_bytes()
    place = -1
    for _ in range(7):
        place = data.index(b"\4\0\0\0zstd", place + 1)
    (bag / "scans_0.mcap").write_bytes(data[: place + 100])
    (bag / "metadata.yaml").unlink()


def test_a_sound_recording(automax, bag):
    before = sorted(automax.folder.iterdir())
    result = automax("bag", "repair", "bag")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith("bag: nothing to repair: ")
    assert "320 scans" in result.out
    assert "to 3.500000 s of rack time" in result.out
    assert sorted(automax.folder.iterdir()) == before


def test_a_sound_recording_is_copied_if_wanted(automax, bag):
    result = automax("bag", "repair", "bag", "-o", "copy")
    assert result.out.splitlines()[-1] == "copied: copy"
    assert (automax.folder / "copy" / "scans_0.mcap").read_bytes() == (bag / "scans_0.mcap").read_bytes()


def test_what_was_lost_is_told(automax, bag):
    break_off(bag)
    result = automax("bag", "repair", "bag")
    assert (result.code, result.err) == (0, "")
    assert "scans_0.mcap: not finished: index and summary are missing" in result.out
    assert "belong to no complete record, 1 chunk cut or damaged" in result.out
    assert "bag: has no metadata.yaml" in result.out
    assert "274 scans, to 2.992000 s of rack time" in result.out
    assert result.out.splitlines()[-1] == "repaired: bag_repaired"
    again = automax("bag", "repair", "bag_repaired")
    assert again.out.startswith("bag_repaired: nothing to repair: ")
    assert automax("bag", "info", "bag_repaired").code == 0


def test_json(automax, bag):
    break_off(bag)
    data = json.loads(automax("bag", "repair", "bag", "--json").out)
    assert data["sound"] is False
    assert data["output"] == "bag_repaired"
    assert data["scans"] == 274
    assert data["rack_time_s"] == 2.992
    assert data["wall_time"] is None
    assert data["problems"] == ["has no metadata.yaml"]
    (file,) = data["files"]
    assert file["name"] == "scans_0.mcap"
    assert file["lost_chunks"] == 1
    assert file["lost_bytes"] > 0
    assert json.loads(automax("bag", "repair", "bag_repaired", "--json").out)["sound"] is True


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nothing"], "AMX6810"),
        (["TASK.BLK"], "AMX6810"),
        (["bag", "--output", "bag"], "AMX6800"),
        (["empty.mcap"], "AMX6817"),
    ],
)
def test_what_cannot_be_done(automax, bag, arguments, told):
    (automax.folder / "empty.mcap").write_bytes(b"")
    result = automax("bag", "repair", *arguments)
    assert result.code == 2
    assert result.out == ""
    assert told in result.err


def test_an_action_is_needed(automax, capsys):
    assert automax("bag").code == 2
    assert automax("bag", "mend", "x").code == 2


def test_a_running_time_of_day_is_told(automax, bag):
    from automax_ros.messages.cdr.cdr import encode
    from automax_ros.messages.types.messages import Int16
    from automax_ros.messages.types.topics import VALUE
    from automax_ros.recordings.write.writer import BagWriter

    with BagWriter(automax.folder / "live") as writer:
        writer.write(writer.channel("/a", "std_msgs/msg/Int16", VALUE), 1_700_000_000_500_000_000, encode(Int16(1)))
    assert "(2023-11-14 22:13:20.500000 UTC)" in automax("bag", "repair", "live").out
