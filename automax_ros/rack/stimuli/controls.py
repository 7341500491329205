"""The verb on what stands in a rack: controls of modules."""

from __future__ import annotations

from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass
from functools import partial

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rack.controls import Controls
from automax_ros.rack.findings import Findings
from automax_ros.rack.modules.running import Operable
from automax_ros.rack.rack import Rack
from automax_ros.rack.scalars import integer_value, kind_of
from automax_ros.rack.sections import Entry, entries_of
from automax_ros.rack.stimuli.operating import Control
from automax_ros.rack.stimuli.plant_work import read_plant_work
from automax_ros.rack.stimuli.reading import Verb, named
from automax_ros.rack.stimuli.stage import Action


def control_verbs(rack: Rack) -> AbstractMapping[str, Verb]:
    """Return the verbs ``module`` and ``plant``."""
    return {"module": Verb(partial(_module, rack)), "plant": Verb(partial(read_plant_work, rack))}


def _module(rack: Rack, node: Node, what: str, findings: Findings) -> list[Action]:
    controls, by_slot = Controls(rack), {module.config.slot: module for module in rack.modules}
    found: list[Action] = []
    for key, item in named(node, what, findings):
        plain = Scalar(key.text, True, key.span)  # JSON knows keys in quotes only
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
        moved = _controls(item, f"the {module.config.model} in slot {slot}", known, findings)
        found += [Control(str(slot), control.verb, control.value, controls.module) for control in moved]
    return found


@dataclass(frozen=True)
class _Given:
    """A control of the file with the value that it is moved to."""

    key: Scalar
    verb: str
    value: str


def _controls(node: Node, what: str, known: AbstractMapping[str, tuple[str, ...]], findings: Findings) -> list[_Given]:
    entries = entries_of(node, what, findings)
    if entries == ():
        findings.add("AMX6008", f"{what}: no control is named", node.span)
    found = (_control(entry, what, known, findings) for entry in entries or ())
    return [item for item in found if item is not None]


def _control(
    entry: Entry, what: str, known: AbstractMapping[str, tuple[str, ...]], findings: Findings
) -> _Given | None:
    key, node = entry
    if key.text not in known:
        message = f"{what} has no control {quoted(key.text)}"
        findings.add("AMX6742", message, key.span, near_or_listed(key.text, known))
        return None
    positions = known[key.text]
    if not isinstance(node, Scalar) or node.is_null or (positions and node.text not in positions):
        takes = ", ".join(positions) if positions else "a number"
        findings.add("AMX6736", f"{key.text} of {what} cannot be {kind_of(node)}: it takes {takes}", node.span)
        return None
    return _Given(key, key.text, node.text)
