"""Plants in recordings: from inside and from outside, the same bytes each time; nobody else stumbles over them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import survey
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.traces import traces
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import replay
from recordings.live.from_outside import check_recorded_outside
from recordings.live_racks import YAML, build

PLANTS = """\
plants:
  UNWIND: {motor: dc_150hp_500v, load: {torque_nm: 25}}
"""
WITH_PLANT = YAML.replace("common:", "  7: {module: 57C406, plant: UNWIND}\n" + PLANTS + "common:", 1)
STATES, JOINTS = "/line1/plants/UNWIND", "/line1/joint_states"
OFFERED = {
    STATES: ["automax_msgs/msg/PlantState"],
    f"{STATES}/load_torque/set": ["std_msgs/msg/Float64"],
    "/line1/plants/SPARE": ["std_msgs/msg/String"],
    "/line2/plants/WIND": ["automax_msgs/msg/PlantState"],
    JOINTS: ["sensor_msgs/msg/JointState"],
}


def rack_of(folder: Path) -> Rack:
    folder.mkdir()
    return build(folder, WITH_PLANT)


def recorded(folder: Path) -> Path:
    rack = rack_of(folder / "rack")
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "bag")
    stream.begin()
    rack.start()
    rack.run(0.0951)
    stream.end()
    recorder.close()
    return folder / "bag"


def decoded(bag: Path, topic: str) -> list[Any]:
    return [item.message for item in BagReader(bag).messages(topics={topic})]


def test_recording_holds_plants_and_is_the_same_each_time(tmp_path: Path) -> None:
    bags = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        bags.append(recorded(tmp_path / name))
    files = [sorted(path.name for path in bag.iterdir()) for bag in bags]
    assert files[0] == files[1] == ["metadata.yaml", "scans_0.mcap"]
    assert all((bags[0] / name).read_bytes() == (bags[1] / name).read_bytes() for name in files[0])
    states, joints = decoded(bags[0], STATES), decoded(bags[0], JOINTS)
    assert [state.stamp for state in states] == [number * 10_000_000 for number in range(10)]
    assert [joint.header.stamp for joint in joints] == [state.stamp for state in states]
    # A hoist whose contactor is open: the load alone turns the shaft, the other way.
    assert joints[-1].velocity[0] < joints[1].velocity[0] < 0.0
    info = bag_info(bags[0], check=True)
    assert info.topics[STATES].messages == info.topics[JOINTS].messages == 10
    played = survey(bags[0])
    assert not played.topics[STATES].fault
    assert not played.topics[JOINTS].fault
    assert replay(bags[0]).identical


def test_recorder_outside_takes_plants_that_the_graph_offers(tmp_path: Path) -> None:
    bag, _, topics = check_recorded_outside(tmp_path, rack_of(tmp_path / "rack"), lambda _: OFFERED, (STATES, JOINTS))
    assert list(topics.plants) == [STATES, JOINTS]
    stamps = [item.stamp for item in decoded(bag, STATES)]
    assert stamps == [1_700_000_000_000_000_000 + number * 10_000_000 for number in range(10)]


def test_signals_are_columns_of_exports_and_lines_of_pictures(tmp_path: Path) -> None:
    bag = recorded(tmp_path)
    watch = ["unwind/SPEED_RPM", "REF%", "UNWIND/contactor", "UNWIND/bridge", "UNWIND/line_v"]
    write_csv(CommonTable(bag, watch), tmp_path / "out.csv")
    header, *rows = (tmp_path / "out.csv").read_text().splitlines()
    assert header == "time_s,UNWIND/speed_rpm,REF%,UNWIND/contactor,UNWIND/bridge,UNWIND/line_v"
    assert [row.split(",")[0] for row in rows] == ["0", *(f"0.0{number}" for number in range(1, 10))]
    states = decoded(bag, STATES)
    for row, state in zip(rows, states, strict=True):
        assert float(row.split(",")[1]) == pytest.approx(state.speed_rpm, rel=1e-7)
    assert [row.split(",")[2:] for row in rows] == [["100", "0", "0", "460.0"]] * 10
    drawn = traces(bag, ["UNWIND/speed_rpm"]).lines[0]
    assert (drawn.variable.unit, drawn.variable.label) == ("rpm", "UNWIND/speed_rpm")


@pytest.mark.parametrize(
    ("name", "code", "hint"),
    [
        ("UNWIND/speed", "AMX6821", "UNWIND/speed_rpm"),
        ("UNWIND/faults", "AMX6821", ""),
        ("UNWIND/", "AMX6821", "write PLANT/SIGNAL"),
        ("WINDER/speed_rpm", "AMX6850", "it holds those of UNWIND"),
    ],
)
def test_signal_that_is_not_there_is_told(tmp_path: Path, name: str, code: str, hint: str) -> None:
    bag = recorded(tmp_path)
    with pytest.raises(BagError) as caught:
        write_csv(CommonTable(bag, [name]), tmp_path / "out.csv")
    assert caught.value.code == code
    assert hint in caught.value.hint
