"""Reads the verbs on what stands around the tasks: switches of modules, plants, webs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Node, Scalar, YamlMapping
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import takes
from automax_ros.rack.modules.module import Operable
from automax_ros.rack.operator.plant_verbs import VERBS_OF, WorkVerb, named_in, read_values
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, integer_value, kind_of
from automax_ros.scenario.stimuli.player import Action, Operate
from automax_ros.scenario.stimuli.values import StimuliVerb, named

_NONE = {
    "plant": "a plant needs a motor to be simulated",
    "web": "it has none: write them under webs: of the rack file",
}
"""Hints of a rack without plants or webs."""


def control_verbs(rack: Rack) -> Mapping[str, StimuliVerb]:
    """Return the verbs ``module``, ``plant`` and ``web``."""
    return {
        "module": StimuliVerb(partial(_module, rack)),
        "plant": StimuliVerb(partial(_read_work, rack, "plant")),
        "web": StimuliVerb(partial(_read_work, rack, "web")),
    }


def _read_work(rack: Rack, kind: str, node: Node, what: str, findings: ProblemList) -> list[Action]:
    """Return the actions on plants, ``{UNWIND: {short_scr: 3}}``, or on webs, ``{W1: break}``."""
    verbs, known = VERBS_OF[kind], named_in(rack.plants, kind)
    operate = getattr(SwitchOperations(rack), kind)
    found: list[Action] = []
    for key, item in named(node, what, findings):
        name = findings.upper_case(key.text, key.span)
        where = f"{what} {name}"
        if rack.part.is_elsewhere(kind, name):
            continue
        if name not in known:
            message = f"the rack has no {kind} {quoted(key.text)} that can be operated"
            findings.add("AMX6742", message, key.span, near_or_listed(name, known) or _NONE[kind])
        alone = isinstance(item, Scalar) and any(verb.is_alone for verb in verbs.values()) and not item.is_null
        entries = ((item, item),) if isinstance(item, Scalar) and alone else entries_of(item, where, findings)
        if entries == ():
            findings.add("AMX6008", f"{where} names nothing", item.span)
        for verb, value in entries or ():
            text = _text(kind, verb, value, where, findings)
            if text is None:
                continue
            if name not in known or _is_possible(rack, verbs[verb.text], name, verb, text, findings):
                found.append(Operate(name, partial(operate, name, verb.text, text)))
    return found


def _text(kind: str, verb: Scalar, node: Node, where: str, findings: ProblemList) -> str | None:
    """Return the value of a verb as commands and services write it; None if a problem was reported."""
    verbs = VERBS_OF[kind]
    known = verbs.get(verb.text)
    if known is None:
        message = f"{where} has no control {quoted(verb.text)}"
        findings.add("AMX6742", message, verb.span, near_or_listed(verb.text, verbs))
        return None
    if node is verb:
        if known.is_alone:
            return ""
        findings.add("AMX6736", f"{verb.text} of {where} needs a value: it takes {takes(known)}", verb.span)
        return None
    if isinstance(node, YamlMapping) and known.keys:
        text = _join_values(known, node, f"{verb.text} of {where}", findings)
        if not text:
            return None
    else:
        text = _plain(node)
    try:
        read_values(kind, verb.text, text)
    except ParameterError:
        given = quoted(text) if isinstance(node, YamlMapping) and known.keys else kind_of(node)
        message = f"{verb.text} of {where} cannot be {given}: it takes {takes(known)}"
        findings.add("AMX6736", message, node.span)
        return None
    return text


def _is_possible(rack: Rack, known: WorkVerb, name: str, verb: Scalar, text: str, findings: ProblemList) -> bool:
    """Return whether the plant or web of a name can ever do so; report it if not."""
    if known.check is not None:
        try:
            known.check(rack.plants, name, known.read(text))
        except ParameterError as error:
            findings.add("AMX6736", f"{verb.text} of {name}: {error}", verb.span)
            return False
    return True


def _plain(node: Node) -> str:
    return node.text if isinstance(node, Scalar) and not node.is_null else ""


def _join_values(verb: WorkVerb, node: YamlMapping, what: str, findings: ProblemList) -> str:
    """Return the values of a form with keys, one after the other; "" if a problem was reported.

    A value that is left out before another is the usual one.
    """
    section = Section(node, what, verb.keys, findings)
    if not section.require(verb.keys[: verb.needed], what, node.span):
        return ""
    given = [section.get(key) for key in verb.keys]
    last = max(place for place, value in enumerate(given) if value is not None)
    return " ".join(
        f"{verb.usual[place - verb.needed]:g}" if value is None else _plain(value)
        for place, value in enumerate(given[: last + 1])
    )


def _module(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    controls, by_slot = SwitchOperations(rack), {module.config.slot: module for module in rack.modules}
    found: list[Action] = []
    for key, item in named(node, what, findings):
        plain = Scalar(key.text, True, key.span)  # JSON accepts only keys in quotes
        slot = integer_value(plain, f"slot of {what}", findings, low=0, high=15, code="AMX6200")
        if slot is None:
            continue
        module = by_slot.get(slot)
        if module is None and rack.part.is_elsewhere("module", slot):
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
    key: Scalar, node: Node, where: str, known: Mapping[str, tuple[str, ...]], findings: ProblemList
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
