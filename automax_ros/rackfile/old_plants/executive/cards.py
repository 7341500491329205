"""What the rack file says of a module by its record in $CARD, and how records are shown in comments."""

from __future__ import annotations

from automax_ros.core.text import quoted
from automax_ros.core.ticks import MAX_TICK_NS, NS_PER_MS, NS_PER_US, TICK_STEP_NS
from automax_ros.core.yaml_text import flow_text
from automax_ros.rackfile.modules.network import MASTER
from automax_ros.rackfile.modules.registry import NOT_YET, REFUSED
from automax_ros.rackfile.old_plants.executive.fields import Record
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.parts import OldModule

_LONGEST_COMMENT = 160


def tick_keys(card: Record, findings: Findings) -> list[str]:
    """Return the key of a Processor's tick: WIRE_NOTE1 is its high byte in microseconds (J2-3106-1 p. F-2).

    That alone fixes it, since each of the 20 ticks has a high byte of its own. That WIRE_NOTE2 is the low byte is
    inferred; one that does not agree is told (decision).
    """
    high, low = card.whole("note1"), card.whole("note2")
    possible = range(TICK_STEP_NS, MAX_TICK_NS + 1, TICK_STEP_NS)
    tick = next((tick for tick in possible if tick // NS_PER_US // 256 == high), None)
    if tick is None:
        shown = "blank" if high is None else str(high)
        message = f"WIRE_NOTE1 is {shown}, which is not a tick: tick_ms is left out, which means 5.5"
        findings.add("AMX6792", message, card.file, card.number)
        return []
    if low is not None and tick // NS_PER_US % 256 != low:
        message = f"WIRE_NOTE1 {high} fixes the tick at {tick / NS_PER_MS:g} ms; WIRE_NOTE2 {low} does not agree"
        findings.add("AMX6792", message, card.file, card.number, "what WIRE_NOTE2 holds is not sure: check the tick")
    return [f"tick_ms: {tick / NS_PER_MS:g}"]


def network_keys(card: Record) -> str:
    """Return the keys of a 57C404 that follow its number."""
    drop, depth = card.whole("net_drop"), card.whole("depth")
    keys = f", network: {flow_text(card.text('network') or 'NET')}, drop: {MASTER if drop is None else drop}"
    return keys + (f", depth: {depth}" if drop and depth and depth > 1 else "")


def why_not(module: OldModule) -> str:
    """Return why a module stands as a comment."""
    if module.model is not None:
        title = NOT_YET.get(module.model)
        return f"the {title} is not emulated" if title else REFUSED.get(module.model, ("", "it is not emulated"))[1]
    return "which module it is, is not known" + (f": {module.why}" if module.why else "")


def comment_of(text: str) -> str:
    """Return a text for a comment: one line, not too long."""
    return quoted(text, marks="", limit=_LONGEST_COMMENT)


def described(record: Record) -> str:
    """Return what a record of $SYSTEM, $SECT or $RACK says, for a comment."""
    words = ("location", "customer", "engineer", "part")
    more = [f"{word.replace('part', 'RACK_PART')} {record.text(word)}" for word in words if record.text(word)]
    return "; ".join(part for part in (record.text("desc"), *more, record.place) if part)


def values_of(record: Record) -> str:
    """Return all values of a record that are not blank, for a comment."""
    shown = ((key, record.text(key)) for key in record.values)
    return ", ".join(f"{key} {text}" for key, text in shown if text)
