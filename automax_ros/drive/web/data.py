"""What webs, rolls, rollers and dancers are made of: data, SI units but for the caliper in um.

A web is between two plants, ``from`` and ``to``: its speed counts from the one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Final, Literal

from automax_ros.drive.base.errors import ParameterError, require

LEAST_GEAR: Final = 0.01
MOST_GEAR: Final = 1000.0
LEAST_LENGTH_M: Final = 0.1
MOST_LENGTH_M: Final = 1000.0
LEAST_STIFFNESS_N: Final = 1e2
MOST_STIFFNESS_N: Final = 1e9
LEAST_DIAMETER_M: Final = 0.001
MOST_DIAMETER_M: Final = 20.0
"""Bounds of diameters of rolls, cores and rollers, m (decision: beyond every machine)."""
MOST_FORCE_N: Final = 1e9
MOST_WRAP_DEG: Final = 3600.0


@dataclass(frozen=True)
class Roll:
    """A roll of web on a core.

    Attributes:
        diameter_m, core_m: diameters of the roll at the start and of its core.
        width_m, caliper_um, density_kg_m3: of the web on it; the caliper is its thickness.
        runs_from: "top", or "bottom": then the roll turns the other way.
        core_inertia_kg_m2: inertia of the core at the roll's shaft; None where that of motor and load has it.
        wound_at_n: tension at which the web on it was wound, N.

    Raises:
        ParameterError: a value is outside its range, or the roll is smaller than its core.
    """

    diameter_m: float
    core_m: float
    width_m: float
    caliper_um: float
    density_kg_m3: float
    runs_from: Literal["top", "bottom"] = "top"
    core_inertia_kg_m2: float | None = None
    wound_at_n: float = 0.0

    def __post_init__(self) -> None:
        require("diameter of the core in m", self.core_m, LEAST_DIAMETER_M, MOST_DIAMETER_M)
        require("diameter of the roll in m", self.diameter_m, LEAST_DIAMETER_M, MOST_DIAMETER_M)
        require("width of the roll in m", self.width_m, 1e-3, 100.0)
        require("caliper of the web in um", self.caliper_um, 0.1, 1e5)
        require("density of the web in kg/m3", self.density_kg_m3, 1.0, 3e4)
        require("inertia of the core in kg m2", self.core_inertia_kg_m2 or 0.0, 0.0, 1e6)
        require("tension at which the roll was wound in N", self.wound_at_n, 0.0, MOST_FORCE_N)
        if self.runs_from not in ("top", "bottom"):
            raise ParameterError(f"a roll runs from top or bottom, not from {self.runs_from}")
        self.check(self.diameter_m)

    def check(self, diameter_m: float) -> None:
        """Check a diameter of a roll on this core, m; raises ParameterError."""
        require("diameter of the roll in m", diameter_m, LEAST_DIAMETER_M, MOST_DIAMETER_M)
        if diameter_m < self.core_m:
            raise ParameterError(
                f"the roll's diameter of {diameter_m:g} m is less than the {self.core_m:g} m of its core: "
                "give it at least that of the core"
            )

    def wound_m(self, diameter_m: float) -> float:
        """Return the unstretched length of web on the core at a diameter (m), m."""
        return pi / 4 * (diameter_m * diameter_m - self.core_m * self.core_m) / (self.caliper_um * 1e-6)

    def inertia_kg_m2(self, radius_m: float) -> float:
        """Return the inertia of core and web at the roll's shaft at a radius (m), kg m2."""
        core = 0.5 * self.core_m
        web = 0.5 * pi * self.density_kg_m3 * self.width_m * (radius_m**4 - core**4)
        return web + (self.core_inertia_kg_m2 or 0.0)


@dataclass(frozen=True)
class Roller:
    """What the web runs over without slip: a driven cylinder, a nip, an S-wrap. Its inertia is that of the load.

    Attributes:
        diameter_m: its diameter.
        wrap_deg, friction: angle of wrap and coefficient of friction, for the traction by Eytelwein; None where the web
            does not slip. Both or neither.

    Raises:
        ParameterError: a value is outside its range, or one of wrap and friction is missing.
    """

    diameter_m: float
    wrap_deg: float | None = None
    friction: float | None = None

    def __post_init__(self) -> None:
        require("diameter of the roller in m", self.diameter_m, LEAST_DIAMETER_M, MOST_DIAMETER_M)
        if (self.wrap_deg is None) != (self.friction is None):
            raise ParameterError("the traction of a roller takes wrap_deg and friction: give both or neither")
        if self.wrap_deg is not None and self.friction is not None:
            require("wrap of the roller in degrees", self.wrap_deg, 0.0, MOST_WRAP_DEG)
            require("friction of the roller", self.friction, 0.0, 10.0)


Surface = Roll | Roller


@dataclass(frozen=True)
class SurfaceData:
    """The roll or roller of a plant, and how many turns the motor makes per turn of it.

    Raises:
        ParameterError: the gear is outside its range.
    """

    surface: Roll | Roller
    gear: float = 1.0

    def __post_init__(self) -> None:
        require("gear (turns of the motor per turn of the roll or roller)", self.gear, LEAST_GEAR, MOST_GEAR)


@dataclass(frozen=True)
class Dancer:
    """A roller that hangs in the web, with a force that pulls it; the span is longer by twice its way.

    Attributes:
        force_n: the force that lengthens the span; at rest the tension is half of it.
        mass_kg: the mass that moves.
        damping_ns_m: damping, N s/m.
        range_m: from stop to stop; the middle is 0.

    Raises:
        ParameterError: a value is outside its range.
    """

    force_n: float
    mass_kg: float
    damping_ns_m: float
    range_m: float

    def __post_init__(self) -> None:
        require("force of the dancer in N", self.force_n, 0.0, MOST_FORCE_N)
        require("mass of the dancer in kg", self.mass_kg, 0.1, 1e6)
        require("damping of the dancer in N s/m", self.damping_ns_m, 0.0, 1e6)
        require("range of the dancer in m", self.range_m, 0.0, 100.0, above=True)


@dataclass(frozen=True)
class WebData:
    """The web between two plants.

    Attributes:
        length_m: length of the span; with a dancer, that in the middle of its range.
        stiffness_n: tension at 100 % strain, N: modulus times cross-section.
        threaded: whether there is web at the start, without tension.
        breaks_above_n: tension above which it breaks, N; None for never.
        dancer: the dancer in it.

    Raises:
        ParameterError: a value is outside its range, or the dancer could take up the whole span.
    """

    length_m: float
    stiffness_n: float
    threaded: bool = True
    breaks_above_n: float | None = None
    dancer: Dancer | None = None

    def __post_init__(self) -> None:
        require("length of the web in m", self.length_m, LEAST_LENGTH_M, MOST_LENGTH_M)
        require("stiffness of the web in N", self.stiffness_n, LEAST_STIFFNESS_N, MOST_STIFFNESS_N)
        if self.breaks_above_n is not None:
            require("tension at which the web breaks in N", self.breaks_above_n, 0.0, MOST_FORCE_N, above=True)
        if self.dancer is not None and self.dancer.range_m > 0.9 * self.length_m:
            raise ParameterError(
                f"a dancer with a range of {self.dancer.range_m:g} m takes up the span of {self.length_m:g} m: "
                "take a longer span or a shorter range"
            )
