"""Two motors on one shaft, or on two shafts with a spring or a gear between them, each fed by its own circuit.

Plants whose shafts are coupled advance together: advancing one of them advances both.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from automax_ros.drive.base.errors import ParameterError, require
from automax_ros.drive.base.motor import Motor
from automax_ros.drive.base.state import SavedState, Stateful
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.plant.plant import DrivePlant

LEAST_RATIO, MOST_RATIO = 0.01, 100.0
LONGEST_SLICE_NS = 1_000_000
"""The circuits exchange torque at least this often, ns."""


DAMPING_RATIO = 0.05
"""Damping over the critical one of a coupling without damping of its own (decision: steel shafts and couplings)."""
FASTEST_SWING = 1000.0
"""Fastest swing of a coupling, rad/s (decision: the circuits exchange torque at least every 50 us; what is quicker is a
stiff shaft to every controller of a drive)."""


class Coupling(Stateful):
    """Advances two circuits together, in slices after which their motors exchange torque.

    Attributes:
        twist_rad: angle of the first motor ahead of the second's times the ratio, rad; 0 on a stiff shaft.
        torque_n_m: torque that the shaft carries from the first motor to the second, N m, at the first.

    Its state is that of the shaft only: the two circuits have their own.
    """

    _kept = ("twist_rad", "torque_n_m")

    def __init__(
        self,
        first: Circuit,
        second: Circuit,
        *,
        stiffness_n_m_rad: float | None = None,
        damping_n_m_s: float = 0.0,
        ratio: float = 1.0,
    ) -> None:
        """Couple two motors; stiffly coupled ones start at their common speed.

        ``ratio`` is the speed of the first motor over that of the second; stiffness (torque per twist, N m/rad, None
        for a stiff shaft) and damping (torque per difference of speeds, N m s/rad) are those at the first.

        Raises:
            ParameterError: a machine is not a Motor, a held one is coupled stiffly, or a value is outside its range.
        """
        self.first, self.second = first, second
        self._one, self._two = one, two = _motor(first), _motor(second)
        self.twist_rad = self.torque_n_m = 0.0
        self._ratio = require("ratio of the coupling", ratio, LEAST_RATIO, MOST_RATIO)
        self._stiffness = stiffness_n_m_rad
        self._inertias = one.inertia_kg_m2, two.inertia_kg_m2
        self._damping = require("damping of the coupling in N m s/rad", damping_n_m_s, 0.0)
        self.slice_ns = LONGEST_SLICE_NS
        if stiffness_n_m_rad is None:
            self._become_one(one, two)
        else:
            require("stiffness of the coupling in N m/rad", stiffness_n_m_rad, 0.0, above=True)
            # A twentieth of a radian of the shaft's oscillation, and of the damper's time constant.
            swing = swing_rad_s(one, two, stiffness_n_m_rad, ratio)
            decay = self._damping * _compliance(one, two, ratio)
            self.slice_ns = max(1000, min(self.slice_ns, round(0.05e9 / max(swing, decay, 1e-9))))

    def _become_one(self, one: Motor, two: Motor) -> None:
        """Give each motor the inertia of both, at the speed of their common momentum."""
        if one.held or two.held:
            raise ParameterError("a shaft that is held at a speed cannot be coupled stiffly: give it a stiffness")
        ratio, inertia = self._ratio, two.inertia_kg_m2 / self._ratio**2
        whole = one.inertia_kg_m2 + inertia
        self._share = one.inertia_kg_m2 / whole
        speed = self._share * one.speed_rad_s + (1 - self._share) * two.speed_rad_s * ratio
        one.speed_rad_s, two.speed_rad_s = speed, speed / ratio
        one.inertia_kg_m2, two.inertia_kg_m2 = whole, whole * ratio**2

    def carry(self, first_kg_m2: float, second_kg_m2: float) -> None:
        """Set what the loads add to the inertias of the motors at present, kg m2: rolls of web change."""
        one, two, ratio = self._one, self._two, self._ratio
        first, second = self._inertias[0] + first_kg_m2, self._inertias[1] + second_kg_m2
        if self._stiffness is None:
            whole = first + second / ratio**2
            self._share = first / whole
            first, second = whole, whole * ratio**2
        one.inertia_kg_m2, two.inertia_kg_m2 = first, second

    def turn_at(self, speed_rad_s: float, *, first: bool) -> None:
        """Set the speed of one motor (rad/s), and of the other where the shaft is stiff."""
        if first or self._stiffness is None:
            self._one.speed_rad_s = speed_rad_s if first else speed_rad_s * self._ratio
        if not first or self._stiffness is None:
            self._two.speed_rad_s = speed_rad_s / self._ratio if first else speed_rad_s

    def advance(self, until_ns: int) -> None:
        """Advance both circuits to an instant, ns."""
        now = self.first.now_ns
        while now < until_ns:
            now = min(until_ns, now + self.slice_ns)
            if self._stiffness is None:
                self._stiff_slice(now)
            else:
                self._elastic_slice(now)

    def _stiff_slice(self, until_ns: int) -> None:
        """Advance each motor with the whole inertia, its own torque and the other's last one; then add both."""
        one, two, ratio = self._one, self._two, self._ratio
        time_s = (until_ns - self.first.now_ns) * 1e-9
        began = one.speed_rad_s
        first = _gain(self.first, one, until_ns, time_s)
        second = _gain(self.second, two, until_ns, time_s)
        impulse = first + second / ratio
        speed = began + impulse / one.inertia_kg_m2
        one.speed_rad_s, two.speed_rad_s = speed, speed / ratio
        one.acceleration = impulse / one.inertia_kg_m2 / time_s
        two.acceleration = one.acceleration / ratio
        one.coupling_n_m, two.coupling_n_m = second / ratio / time_s, first * ratio / time_s
        # The torque that the first does not need for its own inertia goes to the second.
        self.torque_n_m = (first - self._share * impulse) / time_s

    def _elastic_slice(self, until_ns: int) -> None:
        """Advance both with the torque of the middle of the slice (leapfrog)."""
        one, two, stiffness, ratio = self._one, self._two, self._stiffness or 0.0, self._ratio
        half_s = (until_ns - self.first.now_ns) * 0.5e-9
        slip = one.speed_rad_s - ratio * two.speed_rad_s
        torque = stiffness * (self.twist_rad + slip * half_s) + self._damping * slip
        one.coupling_n_m, two.coupling_n_m = -torque, ratio * torque
        self.first.advance(until_ns)
        self.second.advance(until_ns)
        self.twist_rad += (slip + one.speed_rad_s - ratio * two.speed_rad_s) * half_s
        self.torque_n_m = torque


def swing_rad_s(one: Motor, two: Motor, stiffness_n_m_rad: float, ratio: float) -> float:
    """Return the angular frequency of two motors on a spring, rad/s; 0 where both are held."""
    return sqrt(stiffness_n_m_rad * _compliance(one, two, ratio))


def _compliance(one: Motor, two: Motor, ratio: float) -> float:
    """Return the acceleration of the slip per torque at the first motor, 1/(kg m2)."""
    first = 0.0 if one.held else 1.0 / one.inertia_kg_m2
    return first if two.held else first + ratio**2 / two.inertia_kg_m2


def _gain(circuit: Circuit, motor: Motor, until_ns: int, time_s: float) -> float:
    """Advance a circuit; return the angular momentum that its motor gained without the coupling, N m s."""
    before, helped = motor.speed_rad_s, motor.coupling_n_m
    circuit.advance(until_ns)
    return motor.inertia_kg_m2 * (motor.speed_rad_s - before) - helped * time_s


def _motor(circuit: Circuit) -> Motor:
    if not isinstance(circuit.machine, Motor):
        raise ParameterError("only circuits that feed a Motor can be coupled")
    return circuit.machine


@dataclass(frozen=True)
class CouplingData:
    """The coupling of two plants.

    Attributes:
        ratio: speed of the first plant's motor over that of the second's.
        stiffness_nm_per_rad: torque per twist at the first motor, N m/rad; None for a stiff shaft.
        damping_nms_per_rad: torque per difference of speeds at the first motor, N m s/rad; None for
            ``DAMPING_RATIO``.
    """

    ratio: float = 1.0
    stiffness_nm_per_rad: float | None = None
    damping_nms_per_rad: float | None = None


class CoupledPlants:
    """Two plants, ``first`` and ``second``, that advance together, with the ``coupling`` between them."""

    def __init__(self, first: DrivePlant, second: DrivePlant, data: CouplingData) -> None:
        """Couple two plants at their start.

        Raises:
            ParameterError: a value is outside its range, the coupling would swing faster than the model follows, or a
                held shaft would be coupled stiffly.
        """
        self.first, self.second = first, second
        self.coupling = Coupling(
            first.circuit,
            second.circuit,
            stiffness_n_m_rad=data.stiffness_nm_per_rad,
            damping_n_m_s=_damping(first, second, data),
            ratio=data.ratio,
        )
        first.go_together(self.advance)
        second.go_together(self.advance)

    def advance(self, until_ns: int) -> None:
        """Advance both to an instant, ns."""
        first, second, coupling = self.first, self.second, self.coupling
        while True:
            due_ns = min(first.contacts_ns, second.contacts_ns, until_ns)
            coupling.advance(int(due_ns))
            moved = [plant for plant in (first, second) if plant.contacts_ns <= due_ns]
            if not moved:
                return
            for plant in moved:
                plant.switch_contacts()

    def state(self) -> SavedState:
        """Return the state of the shaft between them; the plants have their own."""
        return self.coupling.state()

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a coupling."""
        self.coupling.restore(state)


def _damping(first: DrivePlant, second: DrivePlant, data: CouplingData) -> float:
    """Return the damping of a coupling, N m s/rad; raise a ParameterError if it is faster than the model follows."""
    if data.stiffness_nm_per_rad is None:
        return 0.0
    require("ratio of the coupling", data.ratio, LEAST_RATIO, MOST_RATIO)
    require("stiffness of the coupling in N m/rad", data.stiffness_nm_per_rad, 0.0, above=True)
    stiffness = data.stiffness_nm_per_rad
    swing = swing_rad_s(first.motor, second.motor, stiffness, data.ratio)
    # Critical damping of a spring K and an inertia J is 2 sqrt(K J); the swing is sqrt(K / J).
    damping = data.damping_nms_per_rad
    if damping is None:
        damping = 2 * DAMPING_RATIO * stiffness / swing if swing else 0.0
    rate = max(swing, damping * swing**2 / stiffness)
    if rate > FASTEST_SWING:
        raise ParameterError(
            f"the coupling would swing or settle at {rate:.4g} rad/s; the model follows {FASTEST_SWING:g} at most: "
            "take less stiffness or damping, or leave the stiffness out for a stiff shaft"
        )
    return damping
