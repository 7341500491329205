"""The messages of plants: when they are sent, what they say, and that nobody's looking changes a run."""

from __future__ import annotations

from math import copysign, isnan, pi, radians
from pathlib import Path
from typing import Any

import pytest
from rack.drives.drive_tasks import permit
from rack.drives.drive_tasks import rack_of as drive_rack
from recordings.live_racks import build

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.plant_stream import state_message
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.topics import PLANT
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import driven_plants
from automax_ros.runtime.time.scheduler import EventClass, EventKey

YAML = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {SPEED: {priority: 4}}}
  7: {module: 57C406, plant: UNWIND}
  10:
    module: 57552
    tasks: {WIND: {drive: B}}
    plants: {B: WINDER, A: BARE}
plants:
  SPARE: {motor: dc_10hp_240v}
  UNWIND: {motor: dc_150hp_500v, load: {torque_nm: 25}}
  WINDER: {motor: dc_10hp_240v, load: {speed_rpm: -600}}
  BARE: {motor_overload_ratio: 150}
"""
SPEED = "100 CALL SCAN_LOOP(TICKS=1)\n120 END\n"
WIND = "100 CALL SCAN_LOOP(TICKS=2)\n120 END\n"


def rack_of(folder: Path) -> Rack:
    return build(folder, YAML, SPEED=SPEED, WIND=WIND)


def turned(rack: Rack) -> None:
    """Let something fire the bridge of UNWIND from 0.1 s on: alpha 70 degrees."""
    plant = rack.plants["UNWIND"]
    plant.relay(on=True)
    key = EventKey(EventClass.IO, 7, "test")

    def begin(_: int) -> None:
        plant.advance(rack.now_ns)
        firing = ConstantAlpha(plant.circuit, radians(70))
        rack.scheduler.every(NS_PER_MS, rack.now_ns, key, lambda now, _: firing.advance(now))

    rack.scheduler.at(NS_PER_S // 10, key, begin)


class Heard:
    """A rack with its stream, and all messages of plants so far by topic."""

    def __init__(self, rack: Rack, epoch_ns: int = 0, only: str = "") -> None:
        self.rack, self.messages = rack, dict[str, list[Any]]()
        self.stream = RackStream(rack, 77)

        def sink(topic: Any) -> Any:
            if not topic.plant or only not in topic.name:
                return None
            heard = self.messages.setdefault(f"{topic.name} {topic.plant}", [])
            return lambda stamp, data: heard.append((stamp, decode(topic.type_name, data)))

        self.takes = self.stream.add_sink(sink)
        self.stream.begin(epoch_ns)


def test_each_driven_plant_has_two_topics(tmp_path: Path) -> None:
    heard = Heard(rack_of(tmp_path))
    assert [(topic.name, topic.type_name, topic.slot, topic.plant) for topic in heard.takes] == [
        ("/line1/plants/UNWIND", "automax_msgs/msg/PlantState", 7, "UNWIND"),
        ("/line1/joint_states", "sensor_msgs/msg/JointState", 7, "UNWIND"),
        ("/line1/plants/WINDER", "automax_msgs/msg/PlantState", 10, "WINDER"),
        ("/line1/joint_states", "sensor_msgs/msg/JointState", 10, "WINDER"),
    ]
    assert {topic.qos for topic in heard.takes} == {PLANT}
    assert not any(topic.plant for topic in heard.stream.topics if topic not in heard.takes)


def test_messages_come_a_hundred_times_a_second_with_the_stamps_of_their_instants(tmp_path: Path) -> None:
    heard = Heard(rack_of(tmp_path), epoch_ns=5 * NS_PER_S)
    heard.rack.start()
    heard.rack.run(0.035)
    for messages in heard.messages.values():
        assert [stamp - 5 * NS_PER_S for stamp, _ in messages] == [0, 10_000_000, 20_000_000, 30_000_000]
    for stamp, state in heard.messages["/line1/plants/WINDER WINDER"]:
        assert (state.stamp, state.plant, state.slot, state.drive) == (stamp, "WINDER", 10, "B")
        assert state.speed_rpm == pytest.approx(-600.0)
        assert (state.line_hz, state.line_v, state.contactor, state.bridge) == (60.0, 230.0, False, 0)
    for stamp, joint in heard.messages["/line1/joint_states WINDER"]:
        assert (joint.header.stamp, joint.name) == (stamp, ("WINDER",))
        assert joint.velocity == pytest.approx((-20 * pi,))
        assert joint.position == pytest.approx((-20 * pi * (stamp / NS_PER_S - 5),), abs=1e-9)
        assert joint.effort == (0.0,)


def test_means_and_energies_are_those_of_the_plant(tmp_path: Path) -> None:
    heard = Heard(rack_of(tmp_path))
    rack, plant = heard.rack, heard.rack.plants["UNWIND"]
    turned(rack)
    rack.start()
    rack.run(0.5 + 1e-9)
    states = [state for _, state in heard.messages["/line1/plants/UNWIND UNWIND"]]
    assert (states[0].drive, states[0].duration_s) == ("", 0.0)
    assert [state.duration_s for state in states[1:]] == pytest.approx([0.01] * 50)
    # Torque is k times current, and what speeds the motor up is what the load (25 N m) and friction leave of it.
    charge = sum(state.current_a * state.duration_s for state in states)
    motor = plant.motor
    gained = motor.inertia_kg_m2 * motor.speed_rad_s
    impulse = motor.k_v_s * charge - gained
    speeds = [state.speed_rpm * pi / 30 for state in states[1:]]
    data = motor.data
    drags = [25.0 + data.viscous_n_m_s * speed + copysign(data.coulomb_n_m, speed) for speed in speeds]
    dragged = sum(drags) * 0.01
    assert motor.speed_rad_s > 10.0
    assert impulse == pytest.approx(dragged, rel=0.02)
    assert all(state.current_rms_a >= state.current_a for state in states[1:])
    last = states[-1]
    assert last.load_nm == 25.0
    assert last.speed_rpm == pytest.approx(motor.speed_rad_s * 30 / pi)
    assert last.line_j == pytest.approx(last.loss_j + last.stored_j + last.shaft_j, rel=1e-3)
    assert last.shaft_j == pytest.approx(motor.shaft_j)
    assert any(state.bridge == 1 for state in states)
    closed = [state.stamp for state in states if state.contactor]
    assert closed[0] == 30 * NS_PER_MS, "the sample after 25 ms, which the contactor takes"


@pytest.mark.parametrize("only", ["", "joint_states"])
def test_run_is_the_same_bit_for_bit_whoever_looks(tmp_path: Path, only: str) -> None:
    (tmp_path / "watched").mkdir()
    (tmp_path / "alone").mkdir()
    watched, alone = Heard(rack_of(tmp_path / "watched"), only=only).rack, rack_of(tmp_path / "alone")
    for rack in (watched, alone):
        turned(rack)
        rack.start()
        rack.run(0.2345)
    states = [rack.state().plants["UNWIND"] for rack in (watched, alone)]
    metered = [state["circuit"].pop("energy") is not None for state in states]  # type: ignore[attr-defined]
    assert states[0] == states[1]
    assert metered == [not only, False]


def test_energies_are_not_a_number_where_nobody_meters(tmp_path: Path) -> None:
    heard = Heard(rack_of(tmp_path), only="joint_states")
    heard.rack.start()
    heard.rack.run(0.015)
    assert heard.rack.plants["UNWIND"].meter is None
    assert len(heard.messages["/line1/joint_states UNWIND"]) == 2
    (driven, _) = driven_plants(heard.rack.config)
    message = state_message(driven, heard.rack.plants["UNWIND"], 0)
    assert isnan(message.line_j)
    assert message.duration_s == 0.0


def test_looks_go_on_at_the_same_instants_from_a_state(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    first = rack_of(tmp_path / "one")
    first.start()
    first.run(0.0123)
    heard = Heard(rack_of(tmp_path / "two"))
    heard.rack.load(first.state())
    heard.rack.run(0.02)
    stamps = [stamp for stamp, _ in heard.messages["/line1/plants/UNWIND UNWIND"]]
    assert stamps == [20_000_000, 30_000_000]


def test_late_looks_follow_in_order(tmp_path: Path) -> None:
    heard = Heard(rack_of(tmp_path))
    heard.rack.start()
    for wall_ns in (3_000_000, 47_000_000, 50_000_000):
        heard.rack.scheduler.run_due(wall_ns)
    stamps = [stamp for stamp, _ in heard.messages["/line1/joint_states WINDER"]]
    assert stamps == [number * 10_000_000 for number in range(6)]


def test_drive_that_runs_is_seen_as_its_loop_measures_it(tmp_path: Path) -> None:
    rack = drive_rack(tmp_path)
    stream = RackStream(rack, 77)
    states: list[Any] = []
    currents: list[int] = []
    stream.add_sink(
        lambda topic: (
            (lambda _, data: states.append(decode(topic.type_name, data))) if topic.name.endswith("/UNWIND") else None
        )
    )
    stream.begin()
    permit(rack)
    rack.run(0.6)
    rack.write("START@", True)
    rack.run(0.7)
    for _ in range(360 * 2 // 5):  # 0.4 s: the mean of each scan, as it is told
        rack.run(1 / 360)
        currents.append(int(rack.value("CURRENT%")))
    seen = [state for state in states if state.stamp >= 1_300_000_000]
    mean_a = sum(state.current_a for state in seen) / len(seen)
    told_a = sum(currents) / len(currents) / 4095 * 1.5 * rack.plants["UNWIND"].rated_amps
    assert told_a > 50.0
    assert mean_a == pytest.approx(told_a, rel=0.01)
    assert {state.contactor for state in seen} == {True}
    assert {state.bridge for state in seen} <= {0, 1}
    last = seen[-1]
    assert last.line_j == pytest.approx(last.loss_j + last.stored_j + last.shaft_j, rel=1e-3)
    assert last.torque_nm > 0.0
