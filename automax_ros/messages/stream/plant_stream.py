"""The plants of a running rack as messages, at the rate at which the rack samples them (``rack/plants``).

A plant is only metered (means, energies) if a sink takes its messages: metering costs time, and changes nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from math import fmod, nan, tau

from automax_ros.drive.plant.plant import DrivePlant, Means
from automax_ros.drive.plant.signals import Energies, signals_of
from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.signals import END_SIGNALS
from automax_ros.messages.cdr.cdr import encoder
from automax_ros.messages.types.messages import NAMES, Header, JointState, PlantState
from automax_ros.messages.types.topics import PLANT, Take, Takes, Topic
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import DrivenPlant
from automax_ros.rackfile.model.ros_names import JOINTS, plant_topic, roll_joint

NOT_METERED = Energies(nan, nan, nan, nan)


class _Plant:
    """One plant with its topics and the sinks of their messages."""

    def __init__(self, driven: DrivenPlant, plant: DrivePlant, end: WebEnd | None, space: str) -> None:
        self.driven, self.plant, self.end = driven, plant, end
        name, slot = driven.name, driven.slot
        self.state_topic = Topic(f"{space}/{plant_topic(name)}", NAMES[PlantState], PLANT, slot, name)
        self.joint_topic = Topic(f"{space}/{JOINTS}", NAMES[JointState], PLANT, slot, name)
        self.states: list[Take] = []
        self.joints: list[Take] = []
        self.last: PlantState | None = None


class PlantStream:
    """Streams the plants of one rack to sinks. ``stamp`` returns the stamp of an instant of rack time."""

    def __init__(self, rack: Rack, space: str, stamp: Callable[[int], int]) -> None:
        self._rack, self._stamp = rack, stamp
        plants, driven = rack.plants, rack.part.driven
        self._plants = [_Plant(item, plants[item.name], plants.ends.get(item.name), space) for item in driven]
        self._encode_state, self._encode_joint = encoder(NAMES[PlantState]), encoder(NAMES[JointState])

    @property
    def topics(self) -> list[Topic]:
        """All topics: two per plant."""
        return [topic for item in self._plants for topic in (item.state_topic, item.joint_topic)]

    def route(self, takes: Takes) -> None:
        """Send a sink the messages of the topics that it takes."""
        for item in self._plants:
            for topic, routed in ((item.state_topic, item.states), (item.joint_topic, item.joints)):
                if topic in takes:
                    routed.append(takes[topic])

    def last(self, plant: str) -> PlantState | None:
        """Return the last state of a plant that was sent; None before the first, or if no sink takes it."""
        return next((item.last for item in self._plants if item.driven.name == plant), None)

    def begin(self) -> None:
        """Begin to meter and to send the plants whose messages a sink takes."""
        for item in self._plants:
            if item.states:
                item.plant.begin_metering()
        if any(item.states or item.joints for item in self._plants):
            self._rack.sampling.observe(self._look)

    def _look(self, now_ns: int) -> None:
        stamp = self._stamp(now_ns)
        for item in self._plants:
            if item.states:
                item.last = state_message(item.driven, item.plant, stamp)
                payload = self._encode_state(item.last)
                for take in item.states:
                    take(stamp, payload)
            if item.joints:
                payload = self._encode_joint(joint_message(item.driven, item.plant, stamp, item.end))
                for take in item.joints:
                    take(stamp, payload)


def state_message(driven: DrivenPlant, plant: DrivePlant, stamp: int) -> PlantState:
    """Return the state of a plant at its present time; its means are those since the last call."""
    signals = signals_of(plant)
    means = Means() if plant.meter is None else plant.meter.look()
    energies = signals.energies or NOT_METERED
    return PlantState(
        stamp,
        driven.name,
        driven.slot,
        driven.drive,
        means.duration_s,
        means.current_a,
        means.voltage_v,
        means.current_rms_a,
        signals.torque_nm,
        signals.load_nm,
        signals.speed_rpm,
        signals.angle_rad,
        signals.field,
        signals.bridge,
        signals.contactor,
        signals.line_hz,
        signals.line_v,
        signals.faults,
        energies.line_j,
        energies.loss_j,
        energies.stored_j,
        energies.shaft_j,
    )


def joint_message(driven: DrivenPlant, plant: DrivePlant, stamp: int, end: WebEnd | None = None) -> JointState:
    """Return the shaft of a plant as a joint: angle in rad, rad/s, torque of the motor in N m.

    A roll or roller is a second joint, which turns forward with the web; its torque is that of the motor after the
    gear (decision).
    """
    motor, name, header = plant.motor, driven.config.joint_name, Header(stamp, "")
    angle, speed, torque = motor.angle_rad, motor.speed_rad_s, motor.torque_n_m
    if end is None:
        return JointState(header, (name,), (angle,), (speed,), (torque,))
    turned, ratio = fmod(tau * END_SIGNALS["roll_turns"](end), tau), end.sign / end.gear
    return JointState(
        header, (name, roll_joint(name)), (angle, turned), (speed, speed * ratio), (torque, torque / ratio)
    )
