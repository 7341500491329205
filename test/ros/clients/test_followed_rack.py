"""What is known of a rack from its messages alone, also after some were lost or were not a rack's."""

from pathlib import Path

import pytest
from messages.stream.webs import YAML as WEBS
from messages.stream.webs import web_rack
from rack.helpers import rack_from

from automax_ros.core.types import Value
from automax_ros.messages.cdr.message_headers import table_of
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.rack_names import RackNames
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.ros.clients.followed_rack import FollowedRack

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}}}
  2: {module: 57C402}
common:
  REF%: {preset: 5}
  NOTE$: {preset: "first"}
  LAMP@: {slot: 2, register: 0, bit: 3}
  GO@: {}
"""
SPEED = """\
10 COMMON REF%, NOTE$, LAMP@, GO@
20 LOCAL KP% [CURRENT=3, HIGH=9, LOW=1, STEP=1], COUNT%, BIG%, RUNS@
30 CALL SCAN_LOOP( TICKS=1 )
40 COUNT% = COUNT% + 1
50 RUNS@ = TRUE
60 LAMP@ = REF% > 100
70 IF GO@ THEN BIG% = 30000 * KP%
80 END
"""
SPACE = "/line1"


class Following:
    """A rack, and what a follower makes of those of its messages that are not ``lost``."""

    def __init__(self, folder: Path) -> None:
        self.rack: Rack = rack_from(folder, YAML, SPEED=SPEED)
        self.stream = RackStream(self.rack, 77)
        self.lost: set[str] = set()
        self.log = RackLog()
        self.messages: list[tuple[str, int, bytes]] = []
        self.run: FollowedRack | None = None
        self.stream.add_sink(lambda topic: lambda stamp, payload: self._take(topic.name, stamp, payload))
        self.names = RackNames(self.rack.config, [task.compiled.program for task in self.rack.tasks])
        self.stream.begin()
        self.rack.start()

    def _take(self, topic: str, stamp: int, payload: bytes) -> None:
        self.messages.append((topic, stamp, payload))
        if topic == f"{SPACE}/variables" and self.run is None:
            table = table_of(payload)
            self.run = FollowedRack(self.rack.config, table, LiveTopics(SPACE, table, {}), self.log)
        if topic not in self.lost and topic.startswith(SPACE) and "/common/" not in topic:
            assert self.run is not None
            self.run.take(topic, stamp, payload)

    def value(self, name: str) -> Value | None:
        assert self.run is not None
        return self.run.value(self.names.find(name))


@pytest.fixture
def line(tmp_path) -> Following:
    return Following(tmp_path)


def test_commons_registers_and_forces_follow_the_write_log(line):
    line.rack.run(0.02)
    assert (line.value("REF%"), line.value("NOTE$"), line.value("LAMP@")) == (5, "first", False)
    assert line.run.wants_image is False
    line.rack.adjust.set("REF%", 200)
    line.rack.run(0.02)
    assert (line.value("REF%"), line.value("LAMP@")) == (200, True)
    (view,) = [number for number, item in enumerate(line.rack.config.variables) if item.name == "SLOT:2%"]
    assert line.run.word(view, 0) == 1 << 3
    line.rack.adjust.force("REF%", 7)
    assert list(line.run.forced()) == [("REF%", "7")]
    line.stream.send_image()
    assert list(line.run.forced()) == [("REF%", "7")], "after an image its forces are told again"
    line.rack.adjust.unforce()
    assert list(line.run.forced()) == []
    assert [entry["what"] for entry in line.log.after(0)] == ["set", "force", "unforce"]
    assert line.run.now_ns == line.rack.now_ns


def test_after_lost_writes_nothing_old_is_shown_until_the_next_image(line):
    line.rack.run(0.02)
    line.lost.add(f"{SPACE}/backplane")
    line.rack.write("REF%", 200)
    line.lost.clear()
    line.rack.write("GO@", False)
    line.rack.write("NOTE$", "second")
    assert (line.value("REF%"), line.value("NOTE$")) == (None, "second")
    assert line.run.wants_image is True
    line.stream.send_image()
    assert (line.value("REF%"), line.value("NOTE$")) == (200, "second")
    assert line.run.wants_image is False


def test_a_local_is_known_until_its_task_scans_again_and_a_tunable_stays_known(line):
    line.rack.run(0.02)
    line.stream.send_states(1)
    count = line.rack.task("SPEED").value("COUNT%")
    assert (line.value("SPEED.COUNT%"), line.value("SPEED.KP%"), line.value("SPEED.RUNS@")) == (count, 3, True)
    line.rack.run(0.011)
    assert (line.value("SPEED.COUNT%"), line.value("SPEED.KP%")) == (None, 3)
    line.rack.adjust.tune("SPEED.KP%", 4)
    assert (line.value("SPEED.KP%"), line.value("SPEED.COUNT%")) == (4, line.rack.task("SPEED").value("COUNT%"))


def test_errors_stops_and_power(line):
    line.rack.write("GO@", True)
    line.rack.run(0.02)
    (error,) = [entry for entry in line.log.after(0) if entry["kind"] == "error"]
    assert (error["task"], error["line"], error["code"]) == ("SPEED", 70, "AMX7020")
    assert line.run.status()["stopped"] is False
    line.rack.operations.stop_all("a module was lost", "31", "SPEED")
    stopped = line.run.status()
    assert (stopped["stopped_code"], stopped["stopped_task"], stopped["stopped_reason"]) == (
        "31",
        "SPEED",
        "a module was lost",
    )
    assert stopped["stopped_at_s"] == pytest.approx(0.02)
    line.rack.operations.power_off()
    assert (line.run.status()["powered"], line.run.status()["stopped"]) == (False, False)


def test_what_is_not_a_racks_is_noted_and_nothing_breaks(line):
    line.rack.run(0.02)
    topic, stamp, payload = next(item for item in line.messages if item[0].endswith("/scans"))
    for number in range(0, len(payload), 3):
        line.run.take(topic, stamp, payload[:number])
    line.run.take(f"{SPACE}/backplane", stamp, b"\x00\x01\x00\x00" + b"\xff" * 200)
    notes = [entry for entry in line.log.after(0) if entry["kind"] == "note"]
    assert 0 < len(notes) <= 20
    assert notes[0]["text"].startswith("left out a message on /line1/scans")
    line.rack.adjust.set("REF%", 9)
    assert line.value("REF%") == 9


def test_a_table_of_another_run_ends_this_one(line, tmp_path):
    line.rack.run(0.02)
    assert not line.run.restarted
    other = rack_from(tmp_path, YAML, SPEED=SPEED)
    stream = RackStream(other, 78)
    sent: list[tuple[str, int, bytes]] = []
    stream.add_sink(lambda topic: lambda stamp, payload: sent.append((topic.name, stamp, payload)))
    stream.begin()
    other.start([("REF%", 99)])
    for topic, stamp, payload in sent:
        if topic in (f"{SPACE}/backplane", f"{SPACE}/variables"):
            line.run.take(topic, stamp, payload)
    assert line.run.restarted
    assert line.value("REF%") == 5


def test_what_becomes_of_a_web_is_noted(tmp_path):
    rack = web_rack(tmp_path, WEBS.replace("stiffness_n: 2.0e5", "stiffness_n: 2.0e5, breaks_above_n: 50"))
    stream, log, runs = RackStream(rack, 77), RackLog(), list[FollowedRack]()
    kinds = {topic.name: [topic.type_name] for topic in stream.topics}

    def take(topic: str, stamp: int, payload: bytes) -> None:
        if topic == f"{SPACE}/variables" and not runs:
            table = table_of(payload)
            runs.append(FollowedRack(rack.config, table, LiveTopics(SPACE, table, kinds), log))
        if runs and topic.startswith((f"{SPACE}/webs/", f"{SPACE}/rolls/")) and not topic.endswith("/tension"):
            runs[0].take(topic, stamp, payload)

    stream.add_sink(lambda topic: lambda stamp, payload: take(topic.name, stamp, payload))
    stream.begin()
    rack.start()
    rack.run(0.5)
    assert [item["text"] for item in log.after(0)] == ["web W1 broke"]
    assert [web.broken for web in runs[0].webs()] == [True, False]
