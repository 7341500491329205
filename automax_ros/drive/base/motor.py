"""Loads of the bridge: a resistance, inductance and EMF; or a DC motor with field, inertia, friction and load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, fmod, pi, sqrt
from typing import Final

from automax_ros.drive.base.errors import LARGEST, SMALLEST, ParameterError, require
from automax_ros.drive.base.state import SavedState, Stateful, check_names

SpeedLoad = Callable[[float], float]
"""A load torque (N m) that depends on the speed (rad/s), such as a fan's; positive torque brakes positive speed."""
LoadCallback = Callable[[float, float], float]
"""A load torque (N m), called in every interval with the time (s) and the speed (rad/s)."""
TURN: Final = 2 * pi
LONGEST_NS: Final = 3_500_000
SHORTEST_NS: Final = 500_000
"""Bounds of an interval of constant EMF: at most just over a firing interval at 48 Hz, at least this."""
HELD_V_S: Final = 1e-3
"""The EMF is held over an interval so short that its slope times the interval's square stays below this, V s (decision:
0.1 % of what the line gives in a firing interval; keeps the error of speed below 0.01 %)."""
LONGEST_S2: Final = (LONGEST_NS * 1e-9) ** 2
SMOOTH_S: Final = 5e-3
"""Time constant that smooths the acceleration which sets the interval's length, so that ripple does not count."""
REPAID_S: Final = 1e-3
"""Time (s) within which the error of the last EMF is corrected, or an interval if that is longer."""


class Machine(Stateful):
    """Interface of a circuit's load. A class, not a Protocol: compiled, its methods are called without a lookup."""

    inductance_h: float
    resistance_ohm: float
    turns: bool
    """Whether the EMF can change: then ``advance`` is called for each interval."""
    step_ns: int
    """The longest interval for which the EMF may be held, ns."""

    def emf(self, duration_s: float) -> float:
        """Return the EMF (V) expected in the middle of the next ``duration_s``."""
        raise NotImplementedError

    def advance(self, duration_s: float, charge_c: float, change_a: float) -> None:
        """Advance by a time (s) in which a charge (C) flowed through the armature and its current changed (A)."""
        raise NotImplementedError


@dataclass
class FixedLoad(Machine):
    """A resistance (ohm), an inductance (H) and a constant EMF (V): a machine at a held speed, a choke, a battery."""

    resistance_ohm: float
    inductance_h: float
    emf_v: float = 0.0
    turns: bool = False
    step_ns: int = LONGEST_NS

    def __post_init__(self) -> None:
        _check_armature(self.resistance_ohm, self.inductance_h)
        require("EMF in V", self.emf_v, -LARGEST, LARGEST)

    def emf(self, duration_s: float) -> float:  # noqa: ARG002 - a Machine's
        """Return the EMF, V."""
        return self.emf_v

    def advance(self, duration_s: float, charge_c: float, change_a: float) -> None:
        """Do nothing: the EMF is held."""


FixedLoad._kept = ("emf_v",)


SETTLED: Final = 1e-9
"""A field current (over rated) as near as this to its voltage has settled."""


@dataclass
class FieldWinding(Stateful):
    """The field: its current follows its voltage with a time constant, and its flux follows the current.

    ``flux = (1 + s) x / (s + x)`` with x the current and flux over rated, s = ``knee`` (0.5 is a usual machine's).
    Without a knee the flux is proportional to the current (decision).

    Attributes:
        tau_s: time constant of the field current, s; 0 for none.
        knee: saturation of the iron, above 0, later the larger it is; None for a straight line.
        current: field current over rated.
        voltage: field voltage over rated; loss of field is 0.
    """

    tau_s: float = 0.0
    knee: float | None = None
    current: float = 1.0
    voltage: float = 1.0

    def __post_init__(self) -> None:
        require("time constant of the field in s", self.tau_s, 0.0)
        if self.knee is not None:
            require("knee of the saturation", self.knee, 0.0, above=True)

    def flux_of(self, current: float) -> float:
        """Return the flux over rated of a field current over rated, of either sign."""
        if self.knee is None:
            return current
        return (1 + self.knee) * current / (self.knee + abs(current))

    def flux(self, ahead_s: float) -> float:
        """Return the flux over rated after ``ahead_s`` (s) at the present voltage."""
        return self.flux_of(self._current(ahead_s))

    def advance(self, time_s: float) -> None:
        """Advance by a time (s) at the present voltage; exact."""
        self.current = self._current(time_s)

    def _current(self, ahead_s: float) -> float:
        if not self.tau_s or abs(self.current - self.voltage) < SETTLED:
            return self.voltage
        return self.voltage + (self.current - self.voltage) * exp(-ahead_s / self.tau_s)


FieldWinding._kept = ("current", "voltage")


FASTEST_SWING: Final = 1000.0
"""Fastest swing of a machine's current and speed, rad/s (decision: five times the fastest drive's, and speed is held
for 0.5 ms or more)."""


@dataclass(frozen=True)
class MotorData:
    """A motor's constants.

    Attributes:
        resistance_ohm: armature circuit resistance, ohm.
        inductance_h: armature circuit inductance with any choke, H.
        k_v_s: EMF of 1 rad/s at rated flux, V s; also torque of 1 A, N m.
        inertia_kg_m2: inertia at the motor's shaft.
        viscous_n_m_s: viscous friction, N m s/rad.
        coulomb_n_m: Coulomb friction, N m, which also holds the shaft at rest.
    """

    resistance_ohm: float
    inductance_h: float
    k_v_s: float
    inertia_kg_m2: float
    viscous_n_m_s: float = 0.0
    coulomb_n_m: float = 0.0

    def __post_init__(self) -> None:
        _check_armature(self.resistance_ohm, self.inductance_h)
        require("motor constant k in V s/rad", self.k_v_s, SMALLEST, LARGEST)
        require("inertia in kg m2", self.inertia_kg_m2, SMALLEST, LARGEST)
        require("viscous friction in N m s/rad", self.viscous_n_m_s, 0.0, LARGEST)
        require("Coulomb friction in N m", self.coulomb_n_m, 0.0, LARGEST)
        swing = self.k_v_s / sqrt(self.inertia_kg_m2 * self.inductance_h)
        if swing > FASTEST_SWING:
            raise ParameterError(
                f"current and speed would swing at {swing:.4g} rad/s, k / sqrt(inertia x inductance); the model "
                f"follows {FASTEST_SWING:g} at most: take a larger inertia, or a smaller motor constant k"
            )


class Motor(Machine):
    """A DC motor on its shaft: a ``Machine`` whose EMF follows the speed.

    The EMF is constant within an interval, at the value that the last acceleration predicts for its middle; the
    mechanics use the exact charge of the interval. The error of the prediction in volt-seconds is corrected in the next
    interval, so that errors do not add up: below 0.01 % of speed in a start at full voltage
    (``test/drive/circuit/test_energy``).

    Couplings and webs set their torques on the shaft, N m; that of webs, ``web_n_m``, is in their own state.
    """

    _kept = (
        "inertia_kg_m2", "speed_rad_s", "angle_rad", "acceleration", "time_s", "k_v_s", "step_ns", "_emf", "_owed_v_s",
        "_smooth", "coupling_n_m", "torque_n_m", "shaft_j", "friction_j", "load_j",
    )  # fmt: skip

    def __init__(
        self,
        data: MotorData,
        *,
        load: float | SpeedLoad = 0.0,
        load_callback: LoadCallback | None = None,
        field: FieldWinding | None = None,
        speed_rad_s: float = 0.0,
        held: bool = False,
    ) -> None:
        """Create the motor at a speed.

        Args:
            data: the constants.
            load: load torque in N m, which keeps its direction at any speed (a hoist), or a function of speed.
            load_callback: a callback for additional load torque.
            field: the field; constant and rated without it.
            speed_rad_s: the speed at the start.
            held: whether the shaft is held at that speed whatever the torque; ``load_j`` is the energy that this takes.
        """
        self.data = data
        self.resistance_ohm = data.resistance_ohm
        self.inductance_h = data.inductance_h
        self.inertia_kg_m2 = data.inertia_kg_m2
        self.turns = True
        self.field = field
        self.load = load
        self.load_callback = load_callback
        self.speed_rad_s = speed_rad_s
        self.held = held
        self.angle_rad = 0.0
        self.acceleration = 0.0
        self.time_s = 0.0
        self.k_v_s = data.k_v_s * (field.flux(0.0) if field else 1.0)
        self.step_ns = LONGEST_NS
        self._emf = self._owed_v_s = self._smooth = 0.0
        self.coupling_n_m = 0.0
        self.web_n_m = 0.0
        self.torque_n_m = 0.0
        self.shaft_j = self.friction_j = self.load_j = 0.0

    @property
    def load(self) -> float | SpeedLoad:
        """The load torque, N m: a number, or a function of the speed in rad/s."""
        return self._steady_nm if self._load_of is None else self._load_of

    @load.setter
    def load(self, load: float | SpeedLoad) -> None:
        self._load_of: SpeedLoad | None = load if callable(load) else None
        self._steady_nm = 0.0 if callable(load) else load

    def emf(self, duration_s: float) -> float:
        """Return the EMF (V) expected in the middle of the next ``duration_s``."""
        half = 0.5 * duration_s
        field = self.field
        if field is not None and field.current != field.voltage:
            self.k_v_s = self.data.k_v_s * field.flux(half)
        emf = self.k_v_s * (self.speed_rad_s + self.acceleration * half)
        self._emf = emf = emf + self._owed_v_s / (duration_s if duration_s > REPAID_S else REPAID_S)
        return emf

    def load_torque(self, speed_rad_s: float) -> float:
        """Return the load torque (N m) now, at a speed."""
        torque = self._steady_nm if self._load_of is None else self._load_of(speed_rad_s)
        if self.load_callback is not None:
            torque += self.load_callback(self.time_s, speed_rad_s)
        return torque

    def advance(self, duration_s: float, charge_c: float, change_a: float) -> None:
        """Advance by a time (s) in which a charge (C) flowed through the armature and its current changed (A)."""
        before, k_v_s = self.speed_rad_s, self.k_v_s
        self.torque_n_m = torque = k_v_s * charge_c / duration_s
        if self.held:
            self._hold(duration_s, torque)
            mean = before
        else:
            load = self._steady_nm
            if self._load_of is not None or self.load_callback is not None:
                load = self.load_torque(before + 0.5 * self.acceleration * duration_s)
            self._turn(duration_s, torque, load)
            after = self.speed_rad_s
            self.acceleration = (after - before) / duration_s
            # The mean speed: of both ends, corrected for a torque that rose only during the interval.
            mean = 0.5 * (before + after) - k_v_s * change_a * duration_s / (12.0 * self.inertia_kg_m2)
        self._owed_v_s += (k_v_s * mean - self._emf) * duration_s
        self._smooth = smooth = self._smooth + (self.acceleration - self._smooth) * (
            duration_s / (duration_s + SMOOTH_S)
        )
        slope = abs(k_v_s * smooth)
        if slope * LONGEST_S2 < HELD_V_S:
            self.step_ns = LONGEST_NS
        else:
            self.step_ns = max(SHORTEST_NS, int(1e9 * sqrt(HELD_V_S / slope)))
        self.time_s += duration_s
        field = self.field
        if field is not None and field.current != field.voltage:
            field.advance(duration_s)

    def state(self) -> SavedState:
        """Return speed, angle, field and energies, and the load torque where it is a number (None where a function)."""
        field = self.field.state() if self.field else None
        return super().state() | {"field": field, "load": self._steady_nm if self._load_of is None else None}

    def restore(self, state: SavedState) -> None:
        """Restore a state; a load that is a function is not replaced.

        Raises:
            ParameterError: it is not the state of such a motor.
        """
        check_names("motor", state, (*self._kept, "field", "load"))
        if (state["field"] is None) != (self.field is None) or (state["load"] is None) != (self._load_of is not None):
            raise ParameterError("the state is that of a motor with another field or another kind of load")
        super().restore({name: state[name] for name in self._kept})
        if self.field is not None:
            self.field.restore(state["field"])
        if state["load"] is not None:
            self.load = state["load"]

    def _turn(self, time_s: float, torque: float, load: float) -> None:
        """Apply constant torques (N m) for a time; trapezoidal in speed, so that the energies add up exactly."""
        data, speed = self.data, self.speed_rad_s
        drive = torque - load + self.coupling_n_m + self.web_n_m
        rubbing = data.coulomb_n_m
        if rubbing:
            if speed == 0.0:
                if abs(drive) <= rubbing:
                    return
                rubbing = rubbing if drive > 0 else -rubbing
            elif speed < 0.0:
                rubbing = -rubbing
        drag = 0.5 * data.viscous_n_m_s * time_s / self.inertia_kg_m2
        after = (speed * (1.0 - drag) + time_s * (drive - rubbing) / self.inertia_kg_m2) / (1.0 + drag)
        if rubbing and speed * after < 0.0:  # comes to rest within the time, and friction may hold it there
            part = time_s * speed / (speed - after)
            self._move(part, 0.5 * speed, torque, load, rubbing)
            self.speed_rad_s = 0.0
            self._turn(time_s - part, torque, load)
            return
        self._move(time_s, 0.5 * (speed + after), torque, load, rubbing)
        self.speed_rad_s = after

    def _hold(self, time_s: float, torque: float) -> None:
        """Apply a torque (N m) for a time to a held shaft: its holder absorbs what friction leaves."""
        data, speed = self.data, self.speed_rad_s
        rubbing = data.coulomb_n_m * ((speed > 0.0) - (speed < 0.0))
        left = torque + self.coupling_n_m + self.web_n_m - rubbing - data.viscous_n_m_s * speed
        self._move(time_s, speed, torque, left, rubbing)

    def _move(self, time_s: float, mean_speed: float, torque: float, load: float, rubbing: float) -> None:
        way = mean_speed * time_s
        angle = self.angle_rad + way
        self.angle_rad = angle if -TURN < angle < TURN else fmod(angle, TURN)
        self.shaft_j += torque * way
        self.load_j += load * way
        self.friction_j += (rubbing + self.data.viscous_n_m_s * mean_speed) * way


def _check_armature(resistance_ohm: float, inductance_h: float) -> None:
    require("armature resistance in ohm", resistance_ohm, 0.0, LARGEST)
    require("armature inductance in H", inductance_h, SMALLEST, LARGEST)
