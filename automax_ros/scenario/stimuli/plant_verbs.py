"""Reads the stimuli verbs ``module``, on controls of modules, and ``plant``, on plants of a rack."""

from __future__ import annotations

from collections.abc import Mapping as AbstractMapping
from functools import partial

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Mapping, Node, Scalar
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import VERBS, PlantVerb, values_of
from automax_ros.rack.modules.module import Operable
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, integer_value, kind_of
from automax_ros.scenario.stimuli.actions import Operate
from automax_ros.scenario.stimuli.reading import Verb, named
from automax_ros.scenario.stimuli.wave_player import Action


def read_plant_work(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    """Return the actions on plants: ``{UNWIND: {short_scr: 3}}``."""
    controls = SwitchOperations(rack)
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
                found.append(Operate(name, partial(controls.plant, name, verb.text, text)))
    return found


def _text(verb: Scalar, node: Node, where: str, findings: ProblemList) -> str | None:
    """Return the value of a verb as commands and services write it; None if a problem was reported."""
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


def _joined(verb: PlantVerb, node: Mapping, what: str, findings: ProblemList) -> str:
    """Return the values of a form with keys, one after the other; "" if a problem was reported.

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


def control_verbs(rack: Rack) -> AbstractMapping[str, Verb]:
    """Return the verbs ``module`` and ``plant``."""
    return {"module": Verb(partial(_module, rack)), "plant": Verb(partial(read_plant_work, rack))}


def _module(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    controls, by_slot = SwitchOperations(rack), {module.config.slot: module for module in rack.modules}
    found: list[Action] = []
    for key, item in named(node, what, findings):
        plain = Scalar(key.text, True, key.span)  # JSON accepts only keys in quotes
        slot = integer_value(plain, f"slot of {what}", findings, low=0, high=15, code="AMX6200")
        if slot is None:
            continue
        module = by_slot.get(slot)
        if module is None and rack.part.is_elsewhere(slot):
            continue
        if module is None:
            findings.add("AMX6742", f"the rack has no module in slot {slot}", key.span)
            continue
        known = module.controls if isinstance(module, Operable) else {}
        where = f"the {module.config.model} in slot {slot}"
        entries = entries_of(item, where, findings)
        if entries == ():
            findings.add("AMX6008", f"{where}: no control is named", item.span)
        for control, position in entries or ():
            if _is_position(control, position, where, known, findings):
                move = partial(controls.module, str(slot), control.text, _plain(position))
                found.append(Operate(str(slot), move))
    return found


def _is_position(
    key: Scalar, node: Node, where: str, known: AbstractMapping[str, tuple[str, ...]], findings: ProblemList
) -> bool:
    """Return whether a control of a module has the position in a file; report it if not."""
    if key.text not in known:
        message = f"{where} has no control {quoted(key.text)}"
        findings.add("AMX6742", message, key.span, near_or_listed(key.text, known))
        return False
    positions = known[key.text]
    if not isinstance(node, Scalar) or node.is_null or (positions and node.text not in positions):
        takes = ", ".join(positions) if positions else "a number"
        findings.add("AMX6736", f"{key.text} of {where} cannot be {kind_of(node)}: it takes {takes}", node.span)
        return False
    return True
