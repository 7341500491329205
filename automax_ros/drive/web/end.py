"""The end of a web at run time: the roll or roller on the shaft of a plant."""

from __future__ import annotations

from math import exp, pi, radians, sqrt
from typing import Final

from automax_ros.drive.base.state import SavedState, Stateful, check_names
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.web.data import Roll, SurfaceData

TURN: Final = 2 * pi
SLIP: Final = "slip"
"""The word of a plant's note that its roller has lost its traction."""


class WebTime:
    """The slice of time in which a chain is: all torques of webs are constant within it.

    Attributes:
        began_ns, ends_ns: its bounds, ns.
    """

    began_ns: int
    ends_ns: int

    def settle(self) -> None:
        """End the slice at the present of all plants, so that ends and spans can be changed; ``begin`` follows."""
        raise NotImplementedError

    def begin(self) -> None:
        """Begin a slice at the present."""
        raise NotImplementedError

    def arrange(self) -> None:
        """Note which webs there are."""
        raise NotImplementedError

    def carry(self) -> None:
        """Give the motors the inertias of the rolls as they are."""
        raise NotImplementedError

    def turn_at(self, end: WebEnd, speed_mps: float) -> None:
        """Bring the surface of an end to a speed, m/s, at once; a held shaft keeps its own."""
        raise NotImplementedError


class WebEnd(Stateful):
    """A roll or roller that a plant's motor turns.

    Torque and motion pass between motor and web through ``arm_m``: meters of web per radian of the motor, positive
    where a motor that turns forward moves the web from ``from`` to ``to``.

    Attributes:
        plant, data: the plant, and what is on its shaft.
        roll: the roll, None for a roller.
        radius_m: of the roll when the slice began, or of the roller.
        wound_m: unstretched length of web on the roll when the slice began.
        web_m: length that had gone through when the slice began, m; backwards is negative.
        turns: turns of roll or roller likewise.
        slip: part of the arriving tension that a roller can carry at most; None where it has its traction.
        slipped_m: length by which the web has slipped forward on a roller.
        torque_n_m: torque of the web at the motor in this slice.
        time: the chain's slice.
    """

    _kept = ("wound_m", "web_m", "turns", "slip", "slipped_m", "torque_n_m", "angle_rad", "omega", "free_rad_s2")

    def __init__(self, plant: DrivePlant, data: SurfaceData) -> None:
        """Put a roll or roller on the shaft of a plant at its start; a chain gives the motor its inertia."""
        surface = data.surface
        self.plant = plant
        self.motor = plant.motor
        self.data = data
        self.roll: Roll | None = None
        self.time: WebTime | None = None
        self.sign = 1.0
        self.gear = data.gear
        self.wound_m = 0.0
        self.radius_m = 0.5 * surface.diameter_m
        self.core_m = self.caliper_m = 0.0
        self.grip = 0.0
        if isinstance(surface, Roll):
            self.roll = surface
            self.core_m = 0.5 * surface.core_m
            self.caliper_m = surface.caliper_um * 1e-6
            if surface.runs_from == "bottom":
                self.sign = -1.0
            self.wound_m = surface.wound_m(surface.diameter_m)
        elif surface.wrap_deg is not None and surface.friction is not None:
            self.grip = exp(min(surface.friction * radians(surface.wrap_deg), 700.0))
        if self.roll is not None:
            self.wind(self.wound_m)  # as restore does: the same bits
        self.web_m = self.turns = self.slipped_m = self.torque_n_m = 0.0
        self.slip: float | None = None
        self.angle_rad = self.motor.angle_rad
        self.omega = self.motor.speed_rad_s
        self.free_rad_s2 = 0.0
        # What a chain knows of this end: how many webs there are, the sense in which they change a roll, and
        # unstretched over stretched length of the web that comes from the roll.
        self.webs = 0
        self.growth = 0.0
        self.supply = 1.0
        # Within a slice: meters of web per radian of the motor, speed, acceleration by 1 N, and that by all;
        # unstretched over stretched length of what goes forward and backward; what has gone, stretched and unstretched.
        self.arm_m = self.speed = self.give = self.pull_n = self.acceleration = 0.0
        self.ahead = self.back = 1.0
        self.way_m = self.flow_m = 0.0

    @property
    def speed_mps(self) -> float:
        """Speed of the surface at the plant's present, m/s; positive from ``from`` to ``to``."""
        return self.sign * 0.5 * self.diameter_m / self.gear * self.motor.speed_rad_s

    @property
    def diameter_m(self) -> float:
        """Diameter at the plant's present, m."""
        return 2.0 * self.radius_m + self.growth * self.caliper_m * self.turned() / pi

    @property
    def inertia_kg_m2(self) -> float:
        """Inertia that the roll adds at the motor's shaft now, kg m2; 0 for a roller."""
        return 0.0 if self.roll is None else self.roll.inertia_kg_m2(self.radius_m) / self.gear**2

    @property
    def present_web_m(self) -> float:
        """Length that has gone through at the plant's present, m."""
        return self.web_m + self.way(self.turned())

    @property
    def present_turns(self) -> float:
        """Turns since the start at the plant's present."""
        return self.turns + self.turned() / TURN

    def look(self) -> None:
        """Note what the motor does at the beginning of a slice."""
        motor = self.motor
        self.omega = omega = motor.speed_rad_s
        self.angle_rad = motor.angle_rad
        self.arm_m = arm = self.sign * self.radius_m / self.gear
        self.speed = arm * omega
        self.give = 0.0 if motor.held else arm * arm / motor.inertia_kg_m2
        self.pull_n = 0.0
        self.ahead = self.back = self.supply

    def accelerate(self) -> None:
        """Note the acceleration of the surface by the pull and by all else that turned the shaft in the last slice."""
        motor = self.motor
        if motor.held or (motor.speed_rad_s == 0.0 and motor.data.coulomb_n_m > 0.0):  # friction holds it
            self.acceleration = 0.0
        else:
            self.acceleration = self.arm_m * self.free_rad_s2 + self.give * self.pull_n

    def apply(self) -> None:
        """Let the web pull in this slice."""
        self.torque_n_m = self.motor.web_n_m = self.arm_m * self.pull_n

    def turned(self) -> float:
        """Return by how many radians roll or roller has turned since the slice began; backwards is negative."""
        angle = self.motor.angle_rad - self.angle_rad
        if angle > pi:
            angle -= TURN
        elif angle < -pi:
            angle += TURN
        return self.sign * angle / self.gear

    def way(self, turned: float) -> float:
        """Return the length that has gone through (m) while it turned (rad): a roll changes by a caliper in a turn."""
        return turned * (self.radius_m + self.growth * self.caliper_m * turned / (2 * TURN))

    def follow(self, time_s: float) -> None:
        """Note what the motor did in a slice of time (s)."""
        motor = self.motor
        turned = self.turned()
        self.way_m = way = self.way(turned)
        self.flow_m = way * self.supply
        self.web_m += way
        self.turns += turned / TURN
        self.angle_rad = motor.angle_rad
        self.free_rad_s2 = (motor.speed_rad_s - self.omega) / time_s - self.torque_n_m / motor.inertia_kg_m2

    def wind(self, wound_m: float) -> bool:
        """Set the unstretched length on the roll, m; return False where nothing is left."""
        self.wound_m = wound_m = max(wound_m, 0.0)
        self.radius_m = sqrt(self.core_m * self.core_m + self.caliper_m * wound_m / pi)
        return wound_m > 0.0

    def has_note(self) -> bool:
        """Return whether the plant's notes still have the slip: its repair ends it."""
        return any(note.split(maxsplit=1)[0] == SLIP for note in self.plant.notes)

    def state(self) -> SavedState:
        """Return all that its future depends on, with the chain's slice."""
        time = self.time
        return super().state() | {"slice": [0, 0] if time is None else [time.began_ns, time.ends_ns]}

    def restore(self, state: SavedState) -> None:
        """Restore a state, after or before that of the plant.

        Raises:
            ParameterError: it is not the state of such an end.
        """
        check_names("roll or roller", state, (*self._kept, "slice"))
        super().restore({name: state[name] for name in self._kept})
        if self.roll is not None:
            self.wind(self.wound_m)
        self.motor.web_n_m = self.torque_n_m
        if self.time is not None:
            self.time.began_ns, self.time.ends_ns = state["slice"]
            self.time.carry()
