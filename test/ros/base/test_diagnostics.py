"""When `/diagnostics` is sent and what it says, on a wall clock of the test's own and without a graph."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import pytest
from recordings.live_racks import build
from runtime.time.walls import Wall

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.operator.halting import Halting
from automax_ros.rack.rack import Rack
from automax_ros.runtime.health import Health
from automax_ros.runtime.time.pacer import Pacer
from ros.support import until

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.0, tasks: {SPEED: {priority: 4}}}
common:
  NIL%: {}
  STUCK@: {}
"""
SPEED = """\
10 COMMON NIL%, STUCK@
20 LOCAL N%
100 CALL SCAN_LOOP(TICKS=1)
110 IF NIL% <> 0 THEN N% = N% / (NIL% - 1)
120 IF STUCK@ THEN GOTO 120
130 END
"""
EPOCH_NS = 1_700_000_000 * NS_PER_S


class World:
    """A rack on that clock, with its health and that of its Processor; ``sent`` are (ms of rack time, message)."""

    def __init__(self, config, monkeypatch) -> None:
        from automax_ros.ros.base.diagnostics import Diagnostics
        from automax_ros.ros.base.rack_health import RackHealth

        self.wall, self.rack = Wall(), Rack(config)
        monkeypatch.setattr("automax_ros.ros.intake.guard.time.monotonic", lambda: self.wall.now_ns / NS_PER_S)
        self.stream = RackStream(self.rack, 77)
        self.pacer = Pacer(self.rack.scheduler, clock=self.wall, wait=self.wall.wait)
        self.diagnostics = Diagnostics()
        self.health = Health()
        rack_context = SimpleNamespace(
            rack=self.rack,
            stream=self.stream,
            pacer=self.pacer,
            health=self.health,
            diagnostics=self.diagnostics,
        )
        self.sent = []
        publisher = SimpleNamespace(publish=self._note)
        node = SimpleNamespace(create_publisher=lambda *_: publisher)
        self.diagnostics.begin(self.rack, self.stream, self.pacer, node)
        self.diagnostics.add(RackHealth(rack_context, "rack: LINE1").statuses)
        self.diagnostics.add(self._task)
        self.pacer.begin()
        self.stream.begin(EPOCH_NS)
        self.rack.start()

    def _note(self, message) -> None:
        stamp = message.header.stamp.sec * NS_PER_S + message.header.stamp.nanosec
        assert stamp == EPOCH_NS + self.rack.now_ns
        self.sent.append((self.rack.now_ns / NS_PER_MS, message.status))

    def _task(self, _):
        from automax_ros.ros.base.diagnostics import status_of

        (task,) = self.rack.tasks
        level = b"\x01" if task.errors.count else b"\x00"
        newly = self.diagnostics.newly("errors", task.errors.count)
        return [status_of("line1/processor_1: SPEED", "LINE1 slot 1", level, str(newly), {})]

    def run(self, ms: float) -> None:
        self.pacer.run(round(ms * NS_PER_MS))

    @property
    def instants(self) -> list[float]:
        return [at for at, _ in self.sent]


@pytest.fixture
def world(tmp_path, monkeypatch):
    return World(build(tmp_path, YAML, SPEED=SPEED).config, monkeypatch)


def test_all_statuses_go_out_each_second(world) -> None:
    world.run(3_500)
    assert world.instants == [0, 1000, 2000, 3000]
    for _, statuses in world.sent:
        assert [(item.name, item.hardware_id, item.level) for item in statuses] == [
            ("line1/rack: LINE1", "LINE1", b"\x00"),
            ("line1/processor_1: SPEED", "LINE1 slot 1", b"\x00"),
        ]
    values = {item.key: item.value for item in world.sent[-1][1][0].values}
    assert (values["time_s"], values["run_id"], values["tasks"], values["running"]) == ("3.000", "77", "1", "1")


def test_a_change_of_level_goes_out_at_once_and_others_wait(world) -> None:
    world.run(333)
    world.rack.write("NIL%", 1)
    world.run(336)
    assert world.instants == [0, 335], "right after the scan with the error"
    assert [item.level for item in world.sent[-1][1]] == [b"\x00", b"\x01"]
    world.run(999)
    assert world.instants == [0, 335], "errors go on, levels stay"
    assert [item.message for item in world.sent[-1][1]][1] == "1"
    world.run(2500)
    assert world.instants == [0, 335, 1000, 2000]
    assert [statuses[1].message for _, statuses in world.sent[2:]] == ["134", "200"], "since the report before"


def test_levels_that_change_and_change_are_sent_five_times_per_second_at_most(world) -> None:
    world.run(1)
    for at in range(5, 2000, 10):
        world.rack.operations.clear_errors()
        world.rack.write("NIL%", at // 10 % 2)
        world.run(at)
    periods = [at for at in world.instants if at % 1000 == 0]
    others = [at for at in world.instants if at % 1000]
    assert periods == [0, 1000]
    assert 5 <= len(others) <= 10
    assert min(b - a for a, b in pairwise(others)) >= 200


def test_a_halted_rack_goes_on_telling_by_the_wall_clock(world) -> None:
    halting = Halting(world.rack, world.pacer)
    world.run(502)
    halting.halt()
    end_ns = world.wall.now_ns + 3_300 * NS_PER_MS
    world.pacer.run(should_stop=lambda: world.wall.now_ns >= end_ns)
    assert world.instants == [0, 502, 502, 502, 502]
    for _, statuses in world.sent[1:]:
        assert (statuses[0].level, statuses[0].message) == (b"\x01", "halted: rack time is frozen")
    world.rack.adjust.set("NIL%", 1)
    halting.step("scan")
    end_ns = world.wall.now_ns + 300 * NS_PER_MS
    world.pacer.run(should_stop=lambda: world.wall.now_ns >= end_ns)
    assert world.instants[5:] == [505]
    assert world.sent[-1][1][1].level == b"\x01"
    halting.resume()
    world.run(506)
    assert world.instants[6:] == [505]
    assert (world.sent[-1][1][0].level, world.sent[-1][1][0].message) == (b"\x00", "running")


@pytest.mark.parametrize(
    ("happens", "level", "text"),
    [
        (lambda world: world.rack.operations.stop_all("by hand"), b"\x01", "STOP ALL: by hand"),
        (lambda world: world.rack.operations.stop_all("a fault", "31"), b"\x02", "STOP ALL (code 31): a fault"),
        (lambda world: world.rack.write("STUCK@", True), b"\x02", "STOP ALL (code 14): task SPEED: scan"),
        (lambda world: world.rack.operations.power_off(), b"\x01", "the power is off"),
    ],
)
def test_the_rack_says_at_once_what_stands_in_its_way(world, happens, level, text) -> None:
    world.run(502)
    happens(world)
    world.run(506)
    assert len(world.sent) == 2
    status = world.sent[-1][1][0]
    assert status.level == level
    assert status.message.startswith(text)


def test_skipped_scans_and_troubles_are_warnings_until_the_next_report(world) -> None:
    world.run(1001)
    world.wall.now_ns += 100 * NS_PER_MS
    world.run(1110)
    assert (world.sent[-1][1][0].level, world.sent[-1][1][0].message) == (
        b"\x01",
        "19 scans skipped since the last report",
    )
    world.run(2001)
    assert world.sent[-1][1][0].message == "19 scans skipped since the last report"
    world.run(3001)
    assert world.sent[-1][1][0].message == "running"
    world.health.note("refused write", "REF%", lambda: "write refused", times=3)
    world.run(4001)
    assert (world.sent[-1][1][0].level, world.sent[-1][1][0].message) == (b"\x01", "since the start: 3 refused write")
    values = {item.key: item.value for item in world.sent[-1][1][0].values}
    assert (values["overruns"], values["refused write"]) == ("19", "3")
    world.run(5001)
    assert world.sent[-1][1][0].message == "running"


def test_the_worst_level_counts() -> None:
    from diagnostic_msgs.msg import DiagnosticStatus

    from automax_ros.ros.base.diagnostics import status_of, worst

    levels = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR)
    made = [status_of("n", "h", level, "", {}) for level in levels]
    assert [worst(made[:number]) for number in range(4)] == [levels[0], *levels]


def test_a_basic_task_that_has_done_its_work_is_well(ros_domain_id, client, tmp_path):
    """One that has come to a STOP is not."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    from automax_ros.ros.live_rack import LiveRack

    for name, last in (("ONCE", "END"), ("HALT", "STOP\n30 END")):
        (tmp_path / f"{name}.BAS").write_text(f"10 COMMON NIL%\n20 {last}\n")
    tasks = "{ONCE: {priority: 8, file: ONCE.BAS}, HALT: {priority: 9, file: HALT.BAS}}"
    live = LiveRack(build(tmp_path, YAML.replace("{SPEED: {priority: 4}}", tasks)))
    told = {}

    def note(message):
        told.update({status.name: (status.level, status.message) for status in message.status})

    client.node.create_subscription(DiagnosticArray, "/diagnostics", note, 10)
    live.start([])
    try:
        until(live, client, lambda: told.get("line1/processor_1: HALT", ("",))[0] == DiagnosticStatus.WARN)
    finally:
        live.close()
    assert told["line1/processor_1: ONCE"] == (DiagnosticStatus.OK, "done")
    assert told["line1/processor_1: HALT"] == (DiagnosticStatus.WARN, "ended by STOP")
    assert told["line1/processor_1: 57C435"] == (DiagnosticStatus.WARN, "HALT: ended by STOP")
