"""Feeds: what they write and when, as whom, over STOP ALL, power and force; what they refuse; state."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rack.helpers import Observer, good, loaded

from automax_ros.core.kinds import WriterKind
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks

HEAD = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  5: {module: 57C409}
  6: {module: 57C410}
common:
  RPM: {}
  SPD%: {}
  OWN%: {scale: {counts: [0, 1000], value: [0.0, 100.0]}, ros: in}
  LONG!: {}
  TABLE(3): {}
  IN%: {slot: 5, register: 1}
  OUT%: {slot: 6, register: 1}
  FLAG@: {}
  TEXT$: {}
"""
SCALE = "scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}"


def text(feeds: str, plant: str = "motor: dc_150hp_500v, load: {speed_rpm: 875}") -> str:
    return f"{HEAD}plants:\n  WINDER: {{{plant}, feeds: {{{feeds}}}}}\n"


def rack_of(folder: Path, feeds: str, **options: str) -> Rack:
    rack = Rack(good(folder, text(feeds, **options)))
    rack.start()
    return rack


class Log(Observer):
    """All writes that somebody is told of."""

    def __init__(self, rack: Rack) -> None:
        self.writes = []
        kinds = {writer.id: writer.kind for writer in rack.writers}
        names = [variable.name for variable in rack.config.variables]
        self._of = lambda write: (write.time_ns, names[write.view], write.value, kinds[write.writer])

    def written(self, writes) -> None:
        self.writes += [self._of(entry) for group in writes for entry in group.entries()]

    def scanned(self, _task, _record, writes) -> None:
        self.written(writes)


def test_signals_reach_every_kind_of_number(tmp_path):
    feeds = (
        f"RPM: {{signal: speed_rpm}}, SPD%: {{signal: tach_rpm, {SCALE}}}, OWN%: {{signal: line_hz}}, "
        f"LONG!: {{signal: armature_v, scale: {{counts: [0, 100000], value: [0.0, 1000.0]}}}}, "
        f"'TABLE(2)': {{signal: field_a}}, IN%: {{signal: tach_rpm, {SCALE}}}"
    )
    rack = rack_of(tmp_path, feeds)
    rack.run(0.01)
    emf = 875 * pi / 30 * rack.plants["WINDER"].data.parameters.motor.k_v_s
    assert rack.value("RPM") == pytest.approx(875.0)
    assert (rack.value("SPD%"), rack.value("IN%"), rack.value("OWN%")) == (2048, 2048, 600)
    assert rack.value("LONG!") == round(emf * 100)
    assert rack.value("TABLE", 2) == pytest.approx(0.015 * 245.8, rel=2e-3)
    assert rack.value("TABLE", 1) == 0.0


def test_counts_clamp_at_the_ends_of_the_scale(tmp_path):
    rack = rack_of(
        tmp_path, f"SPD%: {{signal: tach_rpm, {SCALE}}}", plant="motor: dc_150hp_500v, load: {speed_rpm: -3000}"
    )
    rack.run(0.01)
    assert rack.value("SPD%") == -4095


def test_writes_are_changes_at_whole_multiples_by_the_plant(tmp_path):
    rack = Rack(
        good(tmp_path, text("RPM: {signal: speed_rpm, every_ms: 2.5}", "motor: dc_150hp_500v, load: {torque_nm: -100}"))
    )
    log = Log(rack)
    rack.observe(log)
    rack.start()
    rack.run(0.0126)
    told = [item for item in log.writes if item[1] == "RPM"]
    assert [(time, kind) for time, _, _, kind in told] == [
        (number * 2_500_000, WriterKind.PLANT) for number in range(1, 6)
    ]
    motor = rack.plants["WINDER"].data.parameters.motor
    for time_ns, _, value, _ in told:  # from rest: w = T t / J, friction aside
        assert value == pytest.approx(100 / motor.inertia_kg_m2 * time_ns * 1e-9 * 30 / pi, rel=2e-3)


def test_a_scan_sees_what_was_fed_at_its_instant(tmp_path):
    feeds = "RPM: {signal: speed_rpm, every_ms: 5.5}"
    config = good(tmp_path, text(feeds).replace("FLAG@: {}", "FLAG@: {}\n  SEEN: {}"))
    (tmp_path / "LINE.BLK").write_text("10 COMMON RPM, SEEN\n20 CALL SCAN_LOOP( TICKS=1 )\n30 SEEN = RPM\n40 END\n")
    rack = Rack(config)
    rack.start()
    rack.run(0.001)
    assert rack.value("SEEN") == pytest.approx(875.0)


def test_the_rest_of_a_plants_life(tmp_path):
    """STOP ALL clears commons: they are fed again. A force holds. Without power nothing is fed, the plant goes on."""
    rack = rack_of(tmp_path, "RPM: {signal: speed_rpm}, 'TABLE(0)': {signal: tach_rpm}")
    rack.run(0.01)
    rack.operations.stop_all("a test")
    assert rack.value("RPM") == 0.0
    rack.run(0.0021)
    assert rack.value("RPM") == pytest.approx(875.0)
    rack.force("RPM", 3.0)
    rack.run(0.01)
    assert rack.value("RPM") == 3.0
    rack.unforce("RPM")
    rack.operations.power_off()
    rack.run(0.05)
    assert rack.value("RPM") == 0.0
    assert rack.plants["WINDER"].now_ns >= rack.now_ns - 10_000_000
    SwitchOperations(rack).plant("WINDER", "lose_tach", "true")
    rack.operations.power_on()
    rack.run(0.01)
    assert rack.value("RPM") == pytest.approx(875.0)
    assert rack.value("TABLE", 0) == 0.0


@pytest.mark.parametrize(
    ("feeds", "codes"),
    [
        ("GONE: {signal: speed_rpm}", ["AMX6479"]),
        ("RPM: {signal: speed}", ["AMX6479"]),
        ("RPM: {}", ["AMX6009"]),
        ("RPM: {signal: [speed_rpm]}", ["AMX6008"]),
        ("RPM: {signal: speed_rpm, every_ms: 0.09}", ["AMX6479"]),
        ("RPM: {signal: speed_rpm, every_ms: 10001}", ["AMX6479"]),
        ("RPM: {signal: speed_rpm, every: 1}", ["AMX6007"]),
        (f"RPM: {{signal: speed_rpm, {SCALE}}}", ["AMX6450"]),
        ("SPD%: {signal: speed_rpm}", ["AMX6479"]),
        ("FLAG@: {signal: speed_rpm}", ["AMX6479"]),
        ("TEXT$: {signal: speed_rpm}", ["AMX6479"]),
        ("TABLE: {signal: speed_rpm}", ["AMX6479"]),
        ("'TABLE(4)': {signal: speed_rpm}", ["AMX6479"]),
        (f"OUT%: {{signal: speed_rpm, {SCALE}}}", ["AMX6479"]),
        ("RPM: {signal: speed_rpm}, rpm: {signal: tach_rpm}", ["AMX6006"]),
        ("RPM: speed_rpm", ["AMX6008"]),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path, feeds, codes):
    result = loaded(tmp_path, text(feeds))
    line = text(feeds).splitlines().index("plants:") + 2
    assert [(item.code, item.span.line) for item in result.diagnostics] == [(code, line) for code in codes]


def test_a_hostile_name_cannot_drive_a_terminal(tmp_path):
    found = loaded(tmp_path, text(r'"\u001b[31m": {signal: speed_rpm}')).diagnostics
    assert [item.code for item in found] == ["AMX6479"]
    assert "\x1b" not in found[0].message


def test_feeds_need_a_motor(tmp_path):
    found = loaded(tmp_path, text("RPM: {signal: speed_rpm}", "motor_overload_ratio: 150")).diagnostics
    assert [item.code for item in found] == ["AMX6009"]


def test_no_task_writes_what_is_fed(tmp_path):
    config = good(tmp_path, text("RPM: {signal: speed_rpm}"))
    (tmp_path / "LINE.BLK").write_text("10 COMMON RPM\n20 CALL SCAN_LOOP( TICKS=1 )\n30 RPM = 1.0\n40 END\n")
    (checked,) = check_tasks(config)
    assert [(item.code, item.span.line) for item in checked.result.diagnostics] == [("AMX6500", 3)]


@settings(deadline=None, derandomize=True, database=None, max_examples=25)
@given(cut_us=st.integers(0, 30_000), kind=st.sampled_from(["load: {torque_nm: -100}", "load: {speed_rpm: 10}"]))
def test_a_rack_with_feeds_goes_on_from_its_state_bit_for_bit(tmp_path_factory, cut_us, kind):
    folder = tmp_path_factory.mktemp("rack")
    feeds = f"RPM: {{signal: speed_rpm, every_ms: 0.7}}, SPD%: {{signal: tach_rpm, {SCALE}}}"
    config = good(folder, text(feeds, f"motor: dc_150hp_500v, {kind}"))
    whole, later = Rack(config), Rack(config)
    whole.start()
    whole.run(cut_us * 1e-6)
    later.load(whole.state())
    for rack in (whole, later):
        log = Log(rack)
        rack.observe(log)
        SwitchOperations(rack).plant("WINDER", "load_torque_nm", "5") if "torque" in kind else None
        rack.run(0.02)
        rack.log = log
    assert whole.state() == later.state()
    assert whole.log.writes == later.log.writes
    assert replace(whole.state(), now_ns=0) == replace(later.state(), now_ns=0)
