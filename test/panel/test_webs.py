"""Webs on the panel, of a rack in this process and of its recording: names, values, status, what may be done."""

import json
from pathlib import Path

import pytest
from messages.stream.webs import YAML, web_rack

from automax_ros.messages.stream.stream import RackStream
from automax_ros.panel.commands import OPERATIONS
from automax_ros.panel.live_rack import RackSource
from automax_ros.panel.recording import RecordingSource
from automax_ros.panel.source import Asked, RequestRefused, Source
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.runtime.time.turns import Turns

NAMES = ("W1/tension_n", "W1/broken", "UNWIND/diameter_m", "PULL/web_mps", "UNWIND/speed_rpm", "w2/STRAIN_PERCENT")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[RackSource, RecordingSource]:
    """A rack after 0.1 s, and the recording of it."""
    folder = tmp_path_factory.mktemp("webs")
    rack = web_rack(folder)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "bag")
    source = RackSource(rack, Turns().turn, title="a line", stream=stream)
    stream.begin()
    rack.start()
    rack.run(0.1 + 1e-9)
    stream.end()
    recorder.close()
    return source, RecordingSource(folder / "bag")


def values(source: Source, *names: str):
    return source.frames([Asked(names, None)])[0].values


def test_hello_names_the_webs_their_signals_and_what_can_be_done(ran):
    for source in ran:
        hello = source.hello()
        assert [(web["name"], web["from"], web["to"]) for web in hello["webs"]] == [
            ("W1", "UNWIND", "PRESS"),
            ("W2", "PRESS", "PULL"),
        ]
        first = hello["webs"][0]
        assert {"name": "W1/tension_n", "unit": "N"} in first["signals"]
        assert {item["control"]: item["values"] for item in first["controls"]} == {
            "break": [""],
            "thread": [""],
            "stiffness_n": [],
        }
        plants = {plant["name"]: plant for plant in hello["plants"]}
        assert [(name, plant["module_slot"]) for name, plant in plants.items()] == [
            ("UNWIND", 7),
            ("PRESS", 10),
            ("PULL", None),
        ]
        assert [plant["drive"] for plant in plants.values()] == ["", "B", ""]
        assert {"name": "UNWIND/diameter_m", "unit": "m"} in plants["UNWIND"]["signals"]
        assert {"name": "UNWIND/speed_rpm", "unit": "rpm"} in plants["UNWIND"]["signals"]
        assert {item["name"] for item in plants["PULL"]["signals"]} == {
            f"PULL/{signal}" for signal in ("web_mps", "web_fpm", "diameter_m", "web_m", "roll_turns")
        }
        offered = {name: {item["control"] for item in plant["controls"]} for name, plant in plants.items()}
        assert offered["UNWIND"] - offered["PRESS"] == {"splice"}
        assert offered["PRESS"] - offered["UNWIND"] == {"slip"}
        every = [item["name"] for owner in (*hello["plants"], *hello["webs"]) for item in owner["signals"]]
        assert source.unknown(every) == []
        assert source.unknown(["W1/speed_rpm", "PULL/speed_rpm", "W9/tension_n"]) == [
            "W1/speed_rpm",
            "PULL/speed_rpm",
            "W9/tension_n",
        ]
        json.dumps(hello, allow_nan=False)


def test_values_are_those_of_the_webs_live_and_recorded(ran):
    live, recording = ran
    found = values(live, *NAMES)
    webs = live._rack.plants.webs
    assert found[0] == webs["W1"].tension_n > 0.0
    assert found[1] is False
    assert found[2] == live._rack.plants.ends["UNWIND"].diameter_m < 1.25
    assert found[5] == 100 * webs["W2"].strain
    assert values(recording, *NAMES) == pytest.approx(found)
    (times,), (course,) = (
        recording.answer("history", {"names": ["W1/tension_n"], "from_ns": 0, "to_ns": 10**9, "points": 1000})[key]
        for key in "tv"
    )
    assert times == [number * 10_000_000 for number in range(11)]
    assert course[-1] == found[0]


def test_status_has_each_web_and_the_rolls_of_drives(ran):
    for source in ran:
        status = source.status(None)
        tension, broken, diameter, *_ = values(source, *NAMES)
        first, second = status["webs"]
        assert first == {"name": "W1", "tension_n": tension, "slack_m": 0.0, "dancer_m": 0.0, "broken": broken}
        assert second["name"] == "W2"
        unwind, press = status["drives"]
        assert (unwind["plant"], unwind["roll"]["diameter_m"]) == ("UNWIND", diameter)
        assert press["roll"] == {"diameter_m": 0.5, "web_mps": values(source, "PRESS/web_mps")[0]}
        json.dumps(status, allow_nan=False)


def test_a_web_is_broken_and_threaded_from_the_page(tmp_path: Path):
    rack = web_rack(tmp_path)
    source = RackSource(rack, Turns().turn, title="a line")
    rack.start()
    rack.run(0.1)
    assert set(OPERATIONS["web"]) == {"name", "control", "value?"}
    fields = {"name": "W1", "control": "break", "value": ""}
    assert source.describe("web", fields) == "break web W1"
    threaded, stiffer = ({"name": "w1", "control": control} for control in ("thread", "stiffness_n"))
    assert source.describe("web", threaded) == "thread web W1 again, without tension"
    stiffness = "give web W1 a stiffness of 1.5e5 N, at the strain that it has"
    assert source.describe("web", {**stiffer, "value": "1.5e5"}) == stiffness
    undriven = {"name": "PULL", "control": "slip", "value": "0.5"}
    assert "PULL" in source.describe("plant", undriven)
    assert source.operate("web", threaded)["reason"] == "web W1 is not broken: there is nothing to thread"
    assert source.operate("web", fields)["ok"]
    assert values(source, "W1/broken", "W1/tension_n") == (True, 0.0)
    assert source.status(None)["webs"][0]["broken"] is True
    refused = source.operate("web", {"name": "W1", "control": "thread"})
    assert not refused["ok"]
    assert "slow both down to 0.5 m/s" in refused["reason"]
    assert source.operate("plant", {"name": "UNWIND", "control": "splice", "value": "0.9"})["ok"]
    assert values(source, "UNWIND/diameter_m")[0] == pytest.approx(0.9)
    assert source.operate("plant", {"name": "PRESS", "control": "slip", "value": "0.4"})["ok"]
    assert list(source.status(None)["drives"][1]["broken"]) == ["slip 0.4"]
    assert source.operate("plant", {"name": "PRESS", "control": "repair", "value": "all"})["ok"]
    assert list(source.status(None)["drives"][1]["broken"]) == []
    for verb, name, control, part in (
        ("web", "W9", "break", "the rack has no web 'W9'"),
        ("web", "W1", "cut", "a web has no 'cut'"),
        ("plant", "PRESS", "slip", "it takes"),
    ):
        with pytest.raises(RequestRefused, match=part):
            source.describe(verb, {"name": name, "control": control, "value": "x" if control == "slip" else ""})


def test_a_web_that_breaks_by_itself_is_told_in_the_log_live_and_recorded(tmp_path: Path):
    rack = web_rack(tmp_path, YAML.replace("stiffness_n: 2.0e5", "stiffness_n: 2.0e5, breaks_above_n: 50"))
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    source = RackSource(rack, Turns().turn, title="a line", stream=stream)
    stream.begin()
    rack.start()
    rack.run(0.5)
    stream.end()
    recorder.close()
    logs = [[entry for entry in each.log(0) if entry["kind"] == "note"] for each in (source, bag_of(tmp_path))]
    for log in logs:
        assert [entry["text"] for entry in log] == ["web W1 broke"]
    assert logs[0][0]["t"] == logs[1][0]["t"] > 0


def bag_of(folder: Path) -> RecordingSource:
    return RecordingSource(folder / "bag")


def test_a_rack_without_webs_has_none(tmp_path: Path):
    from messages.stream.test_plant_stream import rack_of

    source = RackSource(rack_of(tmp_path), Turns().turn, title="a rack")
    hello, status = source.hello(), source.status(None)
    assert hello["webs"] == []
    assert status["webs"] == []
    assert {drive["roll"] for drive in status["drives"]} == {None}
    controls = {item["control"] for plant in hello["plants"] for item in plant["controls"]}
    assert not controls & {"slip", "splice"}
