"""Two motors on one shaft, or on two shafts with a spring between them; each fed by a circuit of its own."""

from __future__ import annotations

from math import sqrt

from automax_ros.drive.circuit import Circuit
from automax_ros.drive.errors import ParameterError, require
from automax_ros.drive.motor import Motor
from automax_ros.drive.state import Stateful

LONGEST_SLICE_NS = 1_000_000
"""The circuits exchange torque at least this often, ns."""


class Coupling(Stateful):
    """Lets two circuits pass time together, in slices after which their motors exchange torque.

    Attributes:
        twist_rad: angle of the first motor ahead of the second's, rad; 0 on a stiff shaft.
        torque_n_m: torque that the shaft carries from the first motor to the second, N m.

    Its state is the shaft's alone: the two circuits have their own.
    """

    _kept = ("twist_rad", "torque_n_m")

    def __init__(
        self, first: Circuit, second: Circuit, *, stiffness_n_m_rad: float | None = None, damping_n_m_s: float = 0.0
    ) -> None:
        """Couple two motors; stiff ones begin at their common speed.

        Args:
            first: a circuit with a Motor.
            second: another.
            stiffness_n_m_rad: torque per twist, N m/rad; None couples them stiffly.
            damping_n_m_s: torque per difference of speeds, N m s/rad, of an elastic coupling.

        Raises:
            ParameterError: a machine is not a Motor, or a value is outside its range.
        """
        self.first, self.second = first, second
        self._one, self._two = _motor(first), _motor(second)
        self.twist_rad = self.torque_n_m = 0.0
        self._stiffness = stiffness_n_m_rad
        self._damping = require("damping of the coupling in N m s/rad", damping_n_m_s, 0.0)
        inertias = self._one.inertia_kg_m2, self._two.inertia_kg_m2
        self.slice_ns = LONGEST_SLICE_NS
        if stiffness_n_m_rad is None:
            self._share = inertias[0] / sum(inertias)
            speed = self._share * self._one.speed_rad_s + (1 - self._share) * self._two.speed_rad_s
            self._one.speed_rad_s = self._two.speed_rad_s = speed
            self._one.inertia_kg_m2 = self._two.inertia_kg_m2 = sum(inertias)
        else:
            require("stiffness of the coupling in N m/rad", stiffness_n_m_rad, 0.0, above=True)
            # A twentieth of a radian of the shaft's own oscillation and of the damper's decay.
            swing = sqrt(stiffness_n_m_rad * (1 / inertias[0] + 1 / inertias[1]))
            decay = self._damping * (1 / inertias[0] + 1 / inertias[1])
            self.slice_ns = max(1000, min(self.slice_ns, round(0.05e9 / max(swing, decay))))

    def advance(self, until_ns: int) -> None:
        """Let both circuits pass time to an instant, ns."""
        now = self.first.now_ns
        while now < until_ns:
            now = min(until_ns, now + self.slice_ns)
            if self._stiffness is None:
                self._stiff_slice(now)
            else:
                self._elastic_slice(now)

    def _stiff_slice(self, until_ns: int) -> None:
        """Let each motor turn the whole inertia with its own torque and what the other's was; then add both."""
        one, two = self._one, self._two
        before, inertia = one.speed_rad_s, one.inertia_kg_m2
        time_s = (until_ns - self.first.now_ns) * 1e-9
        gained = []
        for circuit, motor in ((self.first, one), (self.second, two)):
            helped = motor.coupling_n_m
            circuit.advance(until_ns)
            gained.append(inertia * (motor.speed_rad_s - before) - helped * time_s)
        speed = before + sum(gained) / inertia
        one.speed_rad_s = two.speed_rad_s = speed
        one.acceleration = two.acceleration = sum(gained) / inertia / time_s
        one.coupling_n_m, two.coupling_n_m = gained[1] / time_s, gained[0] / time_s
        # What the first does not need to turn its own part goes to the second.
        self.torque_n_m = gained[0] / time_s - self._share * sum(gained) / time_s

    def _elastic_slice(self, until_ns: int) -> None:
        """Let the torque of the middle of the slice act on both (leapfrog)."""
        one, two, stiffness = self._one, self._two, self._stiffness or 0.0
        half_s = (until_ns - self.first.now_ns) * 0.5e-9
        slip = one.speed_rad_s - two.speed_rad_s
        torque = stiffness * (self.twist_rad + slip * half_s) + self._damping * slip
        one.coupling_n_m, two.coupling_n_m = -torque, torque
        self.first.advance(until_ns)
        self.second.advance(until_ns)
        self.twist_rad += (slip + one.speed_rad_s - two.speed_rad_s) * half_s
        self.torque_n_m = torque


def _motor(circuit: Circuit) -> Motor:
    if not isinstance(circuit.machine, Motor):
        raise ParameterError("only circuits that feed a Motor can be coupled")
    return circuit.machine
