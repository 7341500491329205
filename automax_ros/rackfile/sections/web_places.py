"""What the webs of a rack file make of its plants: whether each has its two ends, and whether they can hang so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.text import near_or_listed
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.plant import RAD_S_PER_RPM
from automax_ros.drive.web.data import Roll, SurfaceData
from automax_ros.rackfile.model.plants import PlantConfig, build_plants, couple_plants, plant_data
from automax_ros.rackfile.model.webs import WebConfig, build_line
from automax_ros.rackfile.reading.values import ProblemList
from automax_ros.rackfile.sections.surfaces import CODE

ENDS, PLACE, BRIEF = "AMX6502", "AMX6503", "AMX6505"
"""The codes of ends that do not hold a web, of webs that cannot hang so, and of what does not last; ``CODE`` is that of
impossible numbers."""
LEAST_S = 1.0
"""A roll that is empty sooner at its motor's speed is warned of, s."""


@dataclass(frozen=True)
class GivenWeb:
    """A web as the file says it, at ``place``; its stiffness follows from a roll where ``modulus_mpa`` is not None."""

    config: WebConfig
    place: Span
    modulus_mpa: float | None


def place_webs(given: Sequence[GivenWeb], plants: Mapping[str, PlantConfig], findings: ProblemList) -> list[WebConfig]:
    """Return the webs with their stiffness, none if they cannot hang so; report that, and what would not last."""
    fine = [_has_ends(item, plants, findings) for item in given]
    if not all(fine) or not _fits(given, plants, findings):
        return []
    configs = [item.config for item in given]
    found = [_with_stiffness(item, configs, plants, findings) for item in given]
    webs = [item for item in found if item is not None]
    if not findings.errors:
        _try(webs, plants, {item.config.name: item.place for item in given}, findings)
    return webs


def _with_stiffness(
    item: GivenWeb, webs: Sequence[WebConfig], plants: Mapping[str, PlantConfig], findings: ProblemList
) -> WebConfig | None:
    """Return a web with the stiffness that it has, or that its modulus and a roll make; None (reported) without one."""
    web = item.config
    if item.modulus_mpa is None:
        return web
    area = _section_m2(web, webs, plants)
    if area is None:
        message = f"web {web.name} has modulus_mpa, and no roll of its chain says width and caliper"
        findings.add(CODE, message, item.place, "write stiffness_n: the modulus times width times caliper")
        return None
    try:
        return replace(web, data=replace(web.data, stiffness_n=item.modulus_mpa * 1e6 * area))
    except ParameterError as error:
        findings.add(CODE, f"web {web.name}: {error}", item.place)
        return None


def _has_ends(item: GivenWeb, plants: Mapping[str, PlantConfig], findings: ProblemList) -> bool:
    """Return whether both ends of a web are plants that hold one; report those that are not."""
    web, fine = item.config, True
    for word, name in (("from", web.start), ("to", web.end)):
        plant, hint = plants.get(name), None
        if plant is None:
            why, hint = "which the rack does not have", near_or_listed(name, plants)
        elif plant.motor is None:
            why, hint = "which has no motor: it is not simulated", "give the plant a motor"
        elif plant.surface is None:
            why, hint = "which has neither roll nor roller", "give the plant roll: or roller:"
        else:
            continue
        fine = False
        way = "comes from" if word == "from" else "goes to"
        findings.add(ENDS, f"web {web.name} {way} {name}, {why}", item.place, hint)
    return fine


def _fits(given: Sequence[GivenWeb], plants: Mapping[str, PlantConfig], findings: ProblemList) -> bool:
    """Return whether each roll has one web, each roller one on each side, and nothing closes; report what does not."""
    first: dict[tuple[str, str], GivenWeb] = {}
    joined = {name: frozenset((name,)) for name in plants}
    fine = True
    for item in given:
        web = item.config
        for word, name in (("from", web.start), ("to", web.end)):
            surface = plants[name].surface
            is_roll = surface is not None and isinstance(surface.surface, Roll)
            side = "" if is_roll else word
            other = first.setdefault((name, side), item)
            if other is not item:
                fine = False
                what = "roll" if is_roll else "roller"
                message = f"web {web.name} hangs on the {what} of {name}, as web {other.config.name} does"
                hint = "a roll has one web" if is_roll else "a roller has one web that comes and one that leaves"
                notes = (Note("the other", other.place),)
                findings.add(PLACE, message, item.place, hint, notes)
        if web.end in joined[web.start]:
            fine = False
            message = f"web {web.name} closes a ring: {web.end} is before {web.start} already"
            findings.add(PLACE, message, item.place, "a chain of webs has two ends")
        else:
            both = joined[web.start] | joined[web.end]
            joined.update(dict.fromkeys(both, both))
    return fine


def _section_m2(web: WebConfig, webs: Sequence[WebConfig], plants: Mapping[str, PlantConfig]) -> float | None:
    """Return the cross-section of a web as the nearest roll says it, upstream first (decision); None without one."""
    came, goes = {item.end: item.start for item in webs}, {item.start: item.end for item in webs}
    for name, following in ((web.start, came), (web.end, goes)):
        at: str | None = name
        while at is not None:
            surface = plants[at].surface
            if surface is not None and isinstance(surface.surface, Roll):
                return surface.surface.width_m * surface.surface.caliper_um * 1e-6
            at = following.get(at)
    return None


def _try(
    webs: Sequence[WebConfig], plants: Mapping[str, PlantConfig], places: Mapping[str, Span], findings: ProblemList
) -> None:
    """Make the line once: report what the model does not take, and what would not last, at the places of webs."""
    made = build_plants(plants.values())
    try:
        build_line(made, plants.values(), webs, couple_plants(made, plants.values()))
    except ParameterError as error:
        alone = Span(next((item.line for item in plants.values() if item.surface is not None), 1), 1, 2)
        place = places[webs[0].name] if webs else alone
        findings.add(CODE, f"the webs cannot hang so: {error}", place)
        return
    for web in webs:
        for message, hint in (*_brief_roll(web, plants), *_taut(web, plants)):
            findings.add(BRIEF, message, places[web.name], hint)


def _brief_roll(web: WebConfig, plants: Mapping[str, PlantConfig]) -> Iterator[tuple[str, str]]:
    """Yield what to say of a roll that its motor's speed would empty in less than ``LEAST_S``.

    A motor at its base speed turns the way that unwinds; a shaft that is held winds up where its speed says so.
    """
    plant = plants[web.start]
    surface = plant.surface
    if surface is None or not isinstance(surface.surface, Roll):
        return
    roll, speed = surface.surface, web_speed(plant, surface)
    if plant.load.speed_rpm is None:
        speed = abs(speed)
    stock_m = roll.wound_m(roll.diameter_m)
    if speed * LEAST_S > stock_m:
        message = (
            f"at its motor's {speed:.4g} m/s the roll of {web.start} is empty after {stock_m / speed:.2g} s: "
            f"{stock_m:.4g} m are on it"
        )
        yield message, "look at gear, diameter_m, core_m and caliper_um"


def web_speed(plant: PlantConfig, surface: SurfaceData) -> float:
    """Return the speed of a web at the speed of its motor, m/s: that at which the shaft is held, or the base speed."""
    rpm = plant.load.speed_rpm
    data = plant_data(plant)
    assert data is not None
    rad_s = data.parameters.values["base_speed_rad_s"].value if rpm is None else rpm * RAD_S_PER_RPM
    sign = -1.0 if isinstance(surface.surface, Roll) and surface.surface.runs_from == "bottom" else 1.0
    return sign * rad_s / surface.gear * surface.surface.diameter_m / 2


def _taut(web: WebConfig, plants: Mapping[str, PlantConfig]) -> Iterator[tuple[str, str]]:
    """Yield what to say of a web that is taut beyond its strength when the power comes on."""
    data, surface = web.data, plants[web.start].surface
    if data.breaks_above_n is None or not data.threaded:
        return
    if data.dancer is not None and data.dancer.force_n / 2 > data.breaks_above_n:
        pulls = f"{data.dancer.force_n / 2:g} N"
        message = f"the dancer of web {web.name} pulls with {pulls}, and it breaks above {data.breaks_above_n:g}"
        yield message, "the tension is half of force_n"
    wound = surface.surface.wound_at_n if surface is not None and isinstance(surface.surface, Roll) else 0.0
    if wound > data.breaks_above_n:
        message = f"web {web.name} was wound at {wound:g} N, and it breaks above {data.breaks_above_n:g}"
        yield message, "look at wound_at_n and breaks_above_n"
