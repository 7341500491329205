"""Reads the ``webs`` section: what hangs between the rolls and rollers of plants, and from where to where it runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, entries, may_be_empty, section
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.web.data import (
    LEAST_LENGTH_M,
    LEAST_STIFFNESS_N,
    MOST_LENGTH_M,
    MOST_STIFFNESS_N,
    Dancer,
    WebData,
)
from automax_ros.rackfile.model.plants import (
    PLANT_NAME,
    PlantConfig,
    plant_name,
)
from automax_ros.rackfile.model.webs import MOST_WEBS, WebConfig
from automax_ros.rackfile.reading.values import (
    Key,
    ProblemList,
    Section,
    entries_of,
    flag_key,
    number_key,
    report_twice,
    schemas,
    text_key,
)
from automax_ros.rackfile.sections.feeds import WEB_SCHEMA as FEED_SCHEMA
from automax_ros.rackfile.sections.feeds import WEB_SIGNAL, GivenFeeds
from automax_ros.rackfile.sections.surfaces import CODE, has_all
from automax_ros.rackfile.sections.web_places import ENDS, PLACE, GivenWeb, place_webs

_NAME = re.compile(PLANT_NAME + r"\Z")
_FROM = text_key("from", plant_name("The plant that the web comes from."))
_TO = text_key("to", plant_name("The plant that the web goes to."))
_STIFFNESS = number_key("stiffness_n", "Tension at a strain of 100 %.", LEAST_STIFFNESS_N, MOST_STIFFNESS_N, CODE)
_MODULUS = number_key("modulus_mpa", "In its place, where a roll says width and caliper: modulus.", 0.1, 1e6, CODE)
_LENGTH = number_key("length_m", "Length of the span.", LEAST_LENGTH_M, MOST_LENGTH_M, CODE)
_BREAKS = number_key("breaks_above_n", "Tension at which the web breaks.", 0.001, 1e9, CODE)
_THREADED = flag_key("threaded", "Whether the web is in the machine at the start.", usual=True)
_NUMBERS: tuple[Key[float], ...] = (_LENGTH, _STIFFNESS, _MODULUS, _BREAKS)
_DANCER: tuple[Key[float], ...] = (
    number_key("force_n", "Force that pulls the dancer; at rest the tension is half of it.", 0.0, 1e6, CODE),
    number_key("mass_kg", "Mass that moves.", 0.1, 1e6, CODE),
    number_key("damping_ns_m", "Damping.", 0.0, 1e6, CODE),
    number_key("range_m", "Way from stop to stop.", 0.001, 100.0, CODE),
)
_DANCER_KEYS: Keys = schemas(*_DANCER)
KEYS: Keys = {
    **schemas(_FROM, _TO, _LENGTH, _STIFFNESS, _MODULUS, _THREADED, _BREAKS),
    "dancer": section("A dancer in the span.", _DANCER_KEYS, _DANCER_KEYS),
    "feeds": FEED_SCHEMA,
}
"""The keys of a web."""
_REQUIRED = (_FROM.name, _TO.name, _LENGTH.name)
SCHEMA: Schema = may_be_empty(
    entries(
        "Webs between plants, by their names.", plant_name("")["pattern"], section("A web.", KEYS, _REQUIRED), MOST_WEBS
    )
)


@dataclass
class Webs:
    """The webs of one rack file without errors of their own; ``feeds`` are read with the commons."""

    known: dict[str, WebConfig] = field(default_factory=dict)
    feeds: list[GivenFeeds] = field(default_factory=list)


def read_webs(node: Node | None, plants: Mapping[str, PlantConfig], findings: ProblemList) -> Webs:
    """Return the webs of the section, and judge what they make of the plants; report errors in the findings.

    While plants or webs have errors, which may be in what the webs hang on, how they hang is not judged.
    """
    webs = Webs()
    given: dict[str, GivenWeb] = {}
    places: dict[str, Span] = {}
    found = (entries_of(node, "webs", findings) or ()) if node is not None else ()
    if len(found) > MOST_WEBS:
        message = f"the rack file has {len(found)} webs; at most {MOST_WEBS} hang between its plants"
        findings.add(PLACE, message, found[MOST_WEBS][0].span)
    for key, value in found[:MOST_WEBS]:
        name = findings.upper_case(key.text, key.span)
        if not _is_free(name, key, plants, places, findings):
            continue
        places[name] = key.span
        web = _web(name, key, value, webs, findings)
        if web is not None:
            given[name] = web
    if not findings.errors:
        placed = place_webs(list(given.values()), plants, findings)
        webs.known.update({web.name: web for web in placed})
    return webs


def _is_free(
    name: str, key: Scalar, plants: Mapping[str, PlantConfig], places: Mapping[str, Span], findings: ProblemList
) -> bool:
    """Return whether a name may be that of one more web; report it if not."""
    if not _NAME.match(name):
        rule = "1 to 16 letters, digits and underscores, a letter first"
        findings.add(ENDS, f"{quoted(key.text)}: a web's name has {rule}", key.span)
    elif name in places:
        report_twice(key, f"web {name}", places[name], findings)
    elif name in plants:
        message = f"web {name} has the name of a plant (line {plants[name].line})"
        findings.add(ENDS, message, key.span, f"{name}/... would be signals of both: give it another name")
    else:
        return True
    return False


def _web(name: str, key: Scalar, node: Node, webs: Webs, findings: ProblemList) -> GivenWeb | None:
    what = f"web {name}"
    section = Section(node, what, KEYS, findings)
    if not section.require(_REQUIRED, what, key.span):
        return None
    start, end, numbers = section.read(_FROM), section.read(_TO), section.read_all(_NUMBERS)
    threaded, dancer = section.read(_THREADED), section.get("dancer")
    feeds = section.get("feeds")
    if feeds is not None:
        webs.feeds.append(GivenFeeds(name, feeds, WEB_SIGNAL, is_of_web=True))
    swing = _dancer(dancer, what, findings) if dancer is not None else None
    whole = start is not None and end is not None and has_all(section, numbers, _NUMBERS)
    if not whole or (dancer is not None and swing is None) or (threaded is None and _THREADED.name in section):
        return None
    if (_STIFFNESS.name in numbers) == (_MODULUS.name in numbers):
        both = _MODULUS.name in numbers
        message = (
            f"{what} has stiffness_n and modulus_mpa" if both else f"{what} has neither stiffness_n nor modulus_mpa"
        )
        hint = (
            "one of them follows from the other: leave it out" if both else "stiffness_n is the modulus times the area"
        )
        findings.add(CODE, message, section.key_span(_MODULUS.name) if both else key.span, hint)
        return None
    try:
        data = WebData(
            numbers[_LENGTH.name],
            numbers.get(_STIFFNESS.name, MOST_STIFFNESS_N),
            threaded is not False,
            numbers.get(_BREAKS.name),
            swing,
        )
    except ParameterError as error:
        findings.add(CODE, f"{what}: {error}", key.span)
        return None
    assert start is not None
    assert end is not None
    start, end = (findings.upper_case(text, _place(section, side)) for text, side in ((start, _FROM), (end, _TO)))
    config = WebConfig(name, start, end, data, key.span.line)
    return GivenWeb(config, key.span, numbers.get(_MODULUS.name))


def _place(section: Section, key: Key[str]) -> Span:
    node = section.get(key.name)
    assert node is not None
    return node.span


def _dancer(node: Node, what: str, findings: ProblemList) -> Dancer | None:
    where = f"dancer of {what}"
    section = Section(node, where, _DANCER_KEYS, findings)
    if not section.require(_DANCER_KEYS, where, node.span):
        return None
    numbers = section.read_all(_DANCER)
    try:
        return Dancer(**numbers) if has_all(section, numbers, _DANCER) else None
    except ParameterError as error:
        findings.add(CODE, f"{where}: {error}", node.span)
        return None
