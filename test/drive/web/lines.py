"""What the tests of webs share: lines of plants by short words, and an independent model of them for scipy's solver."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from automax_ros.drive.plant.plant import LoadData
from automax_ros.drive.web.chain import Line, build_chains
from automax_ros.drive.web.data import Roll, Roller, SurfaceData, WebData
from drive.plants import plant_of

RPM = pi / 30
PAPER = {"width_m": 2.5, "caliper_um": 90.0, "density_kg_m3": 780.0}


def roll(diameter_m: float = 1.25, gear: float = 4.0, core_m: float = 0.15, **data) -> SurfaceData:
    return SurfaceData(Roll(diameter_m, core_m, **{**PAPER, **data}), gear)


def roller(diameter_m: float = 0.5, gear: float = 5.25, **data) -> SurfaceData:
    return SurfaceData(Roller(diameter_m, **data), gear)


def held(mps: float, surface: SurfaceData) -> LoadData:
    """A shaft that is held at a speed of the web."""
    return LoadData(held_rpm=mps * 2 * surface.gear / surface.surface.diameter_m / RPM)


def line_of(ends: dict, webs: dict, couplings: dict | None = None) -> tuple[dict, Line]:
    """Plants by name from (surface, load) or (surface, load, motor), webs between them, and the line."""
    plants = {
        name: plant_of(motor[0] if motor else "150hp", load=load or LoadData())
        for name, (_, load, *motor) in ends.items()
    }
    surfaces = {name: surface for name, (surface, *_) in ends.items() if surface is not None}
    pairs = {name: make(plants) for name, make in (couplings or {}).items()}
    return plants, build_chains(plants, surfaces, webs, pairs)


def advance(plants: dict, until_ns: int) -> None:
    for plant in plants.values():
        plant.advance(until_ns)


class Model:
    """The equations of a strand, written down again: speeds of motors, wound and spanned lengths, dancers.

    All plants carry a constant torque (the negative of their load) and the motor's own friction.
    """

    def __init__(self, plants: dict, surfaces: list[SurfaceData], webs: list[WebData]) -> None:
        self.surfaces, self.webs = surfaces, webs
        motors = [plant.motor for plant in plants.values()]
        self.torque = [-float(motor.load) for motor in motors]
        self.viscous = [motor.data.viscous_n_m_s for motor in motors]
        self.own = [motor.data.inertia_kg_m2 for motor in motors]
        self.held = [motor.held for motor in motors]
        self.speeds = [motor.speed_rad_s for motor in motors]
        self.sign = [-1.0 if getattr(item.surface, "runs_from", "top") == "bottom" else 1.0 for item in surfaces]

    def start(self, spans: list[float] | None = None) -> list[float]:
        wound = [
            pi / 4 * (item.surface.diameter_m**2 - item.surface.core_m**2) / (item.surface.caliper_um * 1e-6)
            if isinstance(item.surface, Roll)
            else 0.0
            for item in self.surfaces
        ]
        lengths = spans or [web.length_m for web in self.webs]
        return [*self.speeds, *wound, *lengths, *[0.0] * (2 * len(self.webs))]

    def radius(self, end: int, wound: float) -> float:
        surface = self.surfaces[end].surface
        if isinstance(surface, Roll):
            return sqrt((surface.core_m / 2) ** 2 + surface.caliper_um * 1e-6 * wound / pi)
        return surface.diameter_m / 2

    def inertia(self, end: int, radius: float) -> float:
        surface, gear = self.surfaces[end].surface, self.surfaces[end].gear
        if isinstance(surface, Roll):
            web = pi / 2 * surface.density_kg_m3 * surface.width_m * (radius**4 - (surface.core_m / 2) ** 4)
            return self.own[end] + (web + (surface.core_inertia_kg_m2 or 0.0)) / gear**2
        return self.own[end]

    def strains(self, y) -> list[float]:
        count = len(self.surfaces)
        spans = len(self.webs)
        m = y[2 * count : 2 * count + spans]
        x = y[2 * count + spans : 2 * count + 2 * spans]
        return [max((web.length_m + 2 * x[j]) / m[j] - 1, 0.0) for j, web in enumerate(self.webs)]

    def tensions(self, y) -> list[float]:
        return [web.stiffness_n * strain for web, strain in zip(self.webs, self.strains(y), strict=True)]

    def slope(self, _: float, y) -> list[float]:
        count, spans = len(self.surfaces), len(self.webs)
        omega, wound = y[:count], y[count : 2 * count]
        x = y[2 * count + spans : 2 * count + 2 * spans]
        v = y[2 * count + 2 * spans :]
        strain, tension = self.strains(y), self.tensions(y)
        radii = [self.radius(end, wound[end]) for end in range(count)]
        speed = [self.sign[e] * omega[e] * radii[e] / self.surfaces[e].gear for e in range(count)]
        flow = []
        for end in range(count):
            surface = self.surfaces[end].surface
            forward = strain[end - 1] if end else 0.0
            backward = strain[end] if end < spans else 0.0
            if isinstance(surface, Roll):
                wound_at = surface.wound_at_n / self.webs[min(end, spans - 1)].stiffness_n
                forward, backward = (wound_at, backward) if end == 0 else (forward, wound_at)
            flow.append(speed[end] / (1 + (forward if speed[end] >= 0 else backward)))
        turns = []
        for end in range(count):
            arm = self.sign[end] * radii[end] / self.surfaces[end].gear
            pull = (tension[end] if end < spans else 0.0) - (tension[end - 1] if end else 0.0)
            torque = self.torque[end] - self.viscous[end] * omega[end] + arm * pull
            turns.append(0.0 if self.held[end] else torque / self.inertia(end, radii[end]))
        winding = [
            (flow[e] * (1 if e else -1)) if isinstance(self.surfaces[e].surface, Roll) else 0.0 for e in range(count)
        ]
        comes = [flow[j] - flow[j + 1] for j in range(spans)]
        lifts = [
            (web.dancer.force_n - 2 * tension[j] - web.dancer.damping_ns_m * v[j]) / web.dancer.mass_kg
            if web.dancer
            else 0.0
            for j, web in enumerate(self.webs)
        ]
        assert len(x) == len(v)
        return [*turns, *winding, *comes, *v, *lifts]

    def solve(self, seconds: list[float], spans: list[float] | None = None) -> list[np.ndarray]:
        """Return the state at instants, s."""
        found = solve_ivp(
            self.slope, (0.0, seconds[-1]), self.start(spans), "DOP853", t_eval=seconds, rtol=1e-10, atol=1e-12
        )
        assert found.success
        return list(found.y.T)
