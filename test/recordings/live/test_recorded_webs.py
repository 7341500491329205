"""Webs in recordings: from inside and from outside, exported, drawn, replayed, and at any time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from messages.stream.webs import web_rack

from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import survey
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.traces import traces
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import Replay, ReplayOptions, replay
from automax_ros.replay.recorded.run import RecordedRun
from recordings.live.from_outside import check_recorded_outside

W1, ROLL = "/line1/webs/W1", "/line1/rolls/UNWIND"
MS = 1_000_000


def recorded(folder: Path) -> Path:
    """A run of 0.1 s in which the first web breaks after 0.05 s."""
    (folder / "rack").mkdir(parents=True)
    rack = web_rack(folder / "rack")
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "bag")
    stream.begin()
    rack.start()
    rack.run(0.0501)
    SwitchOperations(rack).web("W1", "break")
    rack.run(0.05)
    stream.end()
    recorder.close()
    return folder / "bag"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("webs"))


def decoded(bag: Path, topic: str) -> list[Any]:
    return [item.message for item in BagReader(bag).messages(topics={topic})]


def test_recording_holds_webs_and_is_the_same_each_time(bag: Path, tmp_path: Path) -> None:
    again = recorded(tmp_path)
    for name in ("metadata.yaml", "scans_0.mcap"):
        assert (bag / name).read_bytes() == (again / name).read_bytes()
    webs, rolls, plants = (decoded(bag, name) for name in (W1, ROLL, "/line1/plants/UNWIND"))
    assert [state.stamp for state in webs] == [state.stamp for state in plants] == [at * 10 * MS for at in range(11)]
    assert [state.stamp for state in rolls] == [state.stamp for state in plants]
    assert [state.broken for state in webs] == [False] * 6 + [True] * 5
    assert webs[5].tension_n > webs[1].tension_n > 0.0
    assert webs[6].tension_n == 0.0
    info = bag_info(bag, check=True)
    assert info.topics[W1].messages == info.topics[ROLL].messages == 11
    played = survey(bag)
    assert not played.topics[W1].fault
    assert not played.topics[ROLL].fault


def test_replay_gives_no_difference(bag: Path) -> None:
    assert replay(bag).identical


def test_replay_knows_webs_and_rolls_at_any_time(bag: Path) -> None:
    drives = RecordedRun(Replay(bag, {}, ReplayOptions())).drives
    webs, rolls = decoded(bag, W1), decoded(bag, ROLL)
    assert set(drives.webs) == {"W1", "W2"}
    assert set(drives.rolls) == {"UNWIND", "PRESS", "PULL"}
    assert set(drives.plants) == {"UNWIND", "PRESS"}
    web, roll = drives.of("W1", "tension_n"), drives.of("UNWIND", "diameter_m")
    assert web is drives.webs["W1"]
    assert roll is drives.rolls["UNWIND"]
    assert web.at(-1) is None
    for at_ns, place in ((0, 0), (49 * MS, 4), (50 * MS, 5), (1000 * MS, 10)):
        assert web.at(at_ns).tension_n == webs[place].tension_n
        assert web.at(at_ns).broken is webs[place].broken
        assert roll.at(at_ns).diameter_m == rolls[place].diameter_m
    times, values = web.course("broken")
    assert list(times) == [at * 10 * MS for at in range(11)]
    assert list(values) == [0.0] * 6 + [1.0] * 5
    assert drives.of("W3", "tension_n") is None


def test_signals_are_columns_of_exports_and_lines_of_pictures(bag: Path, tmp_path: Path) -> None:
    watch = ["w1/Tension_N", "UNWIND/diameter_m", "W1/broken", "UNWIND/speed_rpm", "PULL/web_fpm", "TENSION"]
    write_csv(CommonTable(bag, watch), tmp_path / "out.csv")
    header, *rows = (tmp_path / "out.csv").read_text().splitlines()
    names = "W1/tension_n,UNWIND/diameter_m,W1/broken,UNWIND/speed_rpm,PULL/web_fpm,TENSION"
    assert header == f"time_s,{names}"
    found = {float(row.split(",")[0]): row.split(",")[1:] for row in rows}
    for state in decoded(bag, W1)[:7]:  # once it is broken, nothing changes any more
        tension, _, broken, *_ = found[state.stamp / 1e9]
        assert float(tension) == pytest.approx(state.tension_n, rel=1e-6)
        assert bool(int(broken)) is state.broken
    # The feed shows what the topic tells, as a REAL of 32 bits.
    assert float(found[0.05][-1]) == pytest.approx(float(found[0.05][0]), rel=1e-6)
    drawn = traces(bag, ["W1/tension_n", "W1/broken", "UNWIND/web_mps"])
    assert [(line.variable.label, line.variable.unit) for line in drawn.lines] == [
        ("W1/tension_n", "N"),
        ("W1/broken", ""),
        ("UNWIND/web_mps", "m/s"),
    ]


@pytest.mark.parametrize(
    ("name", "code", "hint"),
    [
        ("W9/tension_n", "AMX6850", "W1, W2"),
        ("SPARE/diameter_m", "AMX6850", "PRESS, PULL, UNWIND"),
        ("PULL/speed_rpm", "AMX6850", "PRESS, UNWIND"),
        ("W1/tension", "AMX6821", "W1/tension_n"),
    ],
)
def test_what_is_not_recorded_is_told(bag: Path, tmp_path: Path, name: str, code: str, hint: str) -> None:
    with pytest.raises(BagError) as error:
        write_csv(CommonTable(bag, [name]), tmp_path / "out.csv")
    assert error.value.code == code
    assert hint in str(error.value.hint)


def test_recorder_outside_takes_webs_that_the_graph_offers(tmp_path: Path) -> None:
    def offered(stream: RackStream) -> dict[str, list[str]]:
        others = {f"{W1}/tension": ["std_msgs/msg/Float32"], "/line1/webs/OTHER": ["std_msgs/msg/String"]}
        return {topic.name: [topic.type_name] for topic in stream.topics} | others

    rack = web_rack(tmp_path)
    _, stream, topics = check_recorded_outside(tmp_path, rack, offered, (W1, ROLL))
    assert set(topics.plants) == {topic.name for topic in stream.drive_topics}
    assert topics.plants == LiveTopics.expected("/line1", rack.config).plants
