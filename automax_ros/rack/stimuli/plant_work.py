"""How the stimuli verb ``plant`` is read: what happens to the plants of a rack."""

from __future__ import annotations

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Mapping, Node, Scalar
from automax_ros.drive.errors import ParameterError
from automax_ros.drive.plant_faults import VERBS, values_of
from automax_ros.drive.plant_verbs import PlantVerb
from automax_ros.rack.controls import Controls
from automax_ros.rack.findings import Findings
from automax_ros.rack.rack import Rack
from automax_ros.rack.scalars import kind_of
from automax_ros.rack.sections import Section, entries_of
from automax_ros.rack.stimuli.operating import Control
from automax_ros.rack.stimuli.reading import named
from automax_ros.rack.stimuli.stage import Action


def read_plant_work(rack: Rack, node: Node, what: str, findings: Findings) -> list[Action]:
    """Return what is done to plants: ``{UNWIND: {short_scr: 3}}``."""
    controls = Controls(rack)
    found: list[Action] = []
    for key, item in named(node, what, findings):
        name = findings.upper_case(key.text, key.span)
        where = f"{what} {name}"
        if rack.part.is_elsewhere(name):
            continue
        if name not in rack.plants:
            hint = near_or_listed(name, rack.plants) or "a plant needs a motor to be simulated"
            message = f"the rack has no plant {quoted(key.text)} that can be operated"
            findings.add("AMX6742", message, key.span, hint)
        entries = entries_of(item, where, findings)
        if entries == ():
            findings.add("AMX6008", f"{where} names nothing", item.span)
        for verb, value in entries or ():
            text = _text(verb, value, where, findings)
            if text is not None:
                found.append(Control(name, verb.text, text, controls.plant))
    return found


def _text(verb: Scalar, node: Node, where: str, findings: Findings) -> str | None:
    """Return the value of a verb as commands and services write it, None where there was something to report."""
    known = VERBS.get(verb.text)
    if known is None:
        message = f"{where} has no control {quoted(verb.text)}"
        findings.add("AMX6742", message, verb.span, near_or_listed(verb.text, VERBS))
        return None
    if isinstance(node, Mapping) and known.keys:
        text = _joined(known, node, f"{verb.text} of {where}", findings)
        if not text:
            return None
    else:
        text = _plain(node)
    try:
        values_of(verb.text, text)
    except ParameterError:
        given = quoted(text) if isinstance(node, Mapping) and known.keys else kind_of(node)
        message = f"{verb.text} of {where} cannot be {given}: it takes {known.wants}"
        findings.add("AMX6736", message, node.span)
        return None
    return text


def _plain(node: Node) -> str:
    return node.text if isinstance(node, Scalar) and not node.is_null else ""


def _joined(verb: PlantVerb, node: Mapping, what: str, findings: Findings) -> str:
    """Return the values of a form with keys, one after the other; "" where there was something to report.

    A value that is left out before another is the usual one.
    """
    section = Section(node.entries, what, verb.keys, findings)
    if not section.require(verb.keys[: verb.needed], what, node.span, findings):
        return ""
    given = [section.get(key) for key in verb.keys]
    last = max(place for place, value in enumerate(given) if value is not None)
    return " ".join(
        f"{verb.usual[place - verb.needed]:g}" if value is None else _plain(value)
        for place, value in enumerate(given[: last + 1])
    )
