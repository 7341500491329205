"""The keys ``line``, ``load`` and ``inertia`` of a plant, and the keys of a feed with their values."""

from __future__ import annotations

from automax_ros.core.json_schema import Keys, Schema, entries, listed, may_be_empty, number, section, words
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Node, Sequence
from automax_ros.drive.circuit.ac_line import HIGHEST_HZ, LOWEST_HZ
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.rackfile.model.plants import LoadConfig, SupplyConfig
from automax_ros.rackfile.reading.scale import SCHEMA as SCALE
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, number_value, text_value, wrong_kind

CODE = "AMX6477"
SUPPLY = {"v_ll": (50.0, 1000.0), "hz": (LOWEST_HZ, HIGHEST_HZ), "ls_mh": (0.001, 10.0), "rs_mohm": (0.0, 1000.0)}
"""Ranges of a line's numbers (decision: lines of these drives; without inductance a shorted SCR had no limit)."""
STANDARD, OTHER = "CBA", "ABC"
"""The two rotations of a line (52.1.5)."""
_SUPPLY_KEYS: Keys = {
    "v_ll": number("Line-to-line voltage, V rms.", *SUPPLY["v_ll"]),
    "hz": number("Frequency, Hz.", *SUPPLY["hz"]),
    "ls_mh": number("Source inductance of a phase, mH.", *SUPPLY["ls_mh"]),
    "rs_mohm": number("Source resistance of a phase, milliohm.", *SUPPLY["rs_mohm"], 5),
    "rotation": words("CBA is the standard rotation.", (STANDARD, OTHER), STANDARD),
}
LOAD = {"torque_nm": (-1e6, 1e6), "friction_nm": (0.0, 1e6), "speed_rpm": (-10_000.0, 10_000.0)}
"""Ranges of a load's numbers (decision)."""
LEAST_INERTIA, MOST_INERTIA = 1.0, 10_000.0
"""Range of ``inertia`` (decision): it includes the motor's own, which is 1."""
MOST_PAIRS = 100
"""Most pairs of ``torque_per_rpm`` (decision)."""
_LOAD_KEYS: Keys = {
    "torque_nm": number("Torque that keeps its direction, N m; positive brakes positive speed.", *LOAD["torque_nm"], 0),
    "friction_nm": number("Coulomb friction, N m.", *LOAD["friction_nm"], 0),
    "speed_rpm": number("The speed at which the shaft is held; alone. 0 is a locked rotor.", *LOAD["speed_rpm"]),
    "torque_per_rpm": listed(
        "A table of speed and torque, straight lines between its pairs.",
        listed("rpm and N m.", {"type": "number"}, least=2, most=2),
        least=2,
        most=MOST_PAIRS,
    ),
    "ros": words("`in`: ROS 2 sets torque_nm.", ("in",)),
}
_TORQUE = (
    "write load: {torque_nm: 100}; ros: in there lets ROS 2 set it, stimuli set load_torque_nm, couple: joins shafts"
)
LOAD_HINTS = dict.fromkeys(("torque_from", "torque", "torque_common", "torque_ref"), _TORQUE)
"""Hints for keys that users may try."""
SUPPLY_SCHEMA: Schema = may_be_empty(section("The AC line of the drive.", _SUPPLY_KEYS))
LOAD_SCHEMA: Schema = may_be_empty(section("What the motor turns.", _LOAD_KEYS))
INERTIA_SCHEMA: Schema = number("Inertia of motor and load over the motor's own.", LEAST_INERTIA, MOST_INERTIA, 1)
_ALONE = "speed_rpm"


LEAST_MS, MOST_MS, USUAL_MS = 0.1, 10_000.0, 1.0
"""Range of ``every_ms``, and its default (decision: an instrument is quicker than most scans)."""
FEED_KEYS: Keys = {
    "signal": words("What the instrument shows.", SIGNALS),
    "every_ms": number("How often it is written, ms.", LEAST_MS, MOST_MS, USUAL_MS),
    "scale": SCALE,
}
_FED = r"^[A-Za-z_][A-Za-z0-9_]{0,15}[%!]?\s*([(\[][0-9, ]*[)\]])?$"
FEED_SCHEMA: Schema = may_be_empty(
    entries("Signals of the plant into commons.", _FED, section("A feed.", FEED_KEYS, ("signal",)))
)


def read_supply(node: Node, what: str, findings: ProblemList) -> SupplyConfig:
    """Return a plant's AC line; report errors in the findings."""
    where = f"line of {what}"
    section = Section(entries_of(node, where, findings) or (), where, _SUPPLY_KEYS, findings)
    return SupplyConfig(
        **_numbers(section, SUPPLY, where, findings),
        standard=_standard(section.get("rotation"), where, findings),
    )


def read_load(node: Node, what: str, findings: ProblemList) -> LoadConfig:
    """Return a plant's load; report errors in the findings."""
    where = f"load of {what}"
    section = Section(entries_of(node, where, findings) or (), where, _LOAD_KEYS, findings, LOAD_HINTS)
    _check_alone(section, where, findings)
    numbers = _numbers(section, LOAD, where, findings)
    return LoadConfig(
        torque_nm=numbers.get("torque_nm", 0.0),
        torque_per_rpm=_table(section.get("torque_per_rpm"), where, findings),
        friction_nm=numbers.get("friction_nm", 0.0),
        speed_rpm=numbers.get("speed_rpm"),
        from_ros=_from_ros(section.get("ros"), where, findings),
    )


def read_inertia(node: Node, what: str, findings: ProblemList) -> float:
    """Return a plant's inertia over its motor's own, 1 if a problem was reported."""
    where = f"inertia of {what}"
    found = number_value(node, where, findings, low=LEAST_INERTIA, high=MOST_INERTIA, code=CODE)
    return 1.0 if found is None else found


def _numbers(
    section: Section, ranges: dict[str, tuple[float, float]], where: str, findings: ProblemList
) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for key, (low, high) in ranges.items():
        node = section.get(key)
        found = number_value(node, f"{key} of {where}", findings, low=low, high=high, code=CODE) if node else None
        if found is not None:
            numbers[key] = found
    return numbers


def _standard(node: Node | None, where: str, findings: ProblemList) -> bool:
    text = text_value(node, f"rotation of {where}", findings, limit=100) if node is not None else None
    if node is not None and text is not None and text not in (STANDARD, OTHER):
        message = f"rotation of {where} is {quoted(text)}; it must be {STANDARD} (the standard one) or {OTHER}"
        findings.add(CODE, message, node.span)
    return text != OTHER


def _check_alone(section: Section, where: str, findings: ProblemList) -> None:
    """Report a held shaft with other loads, which would have no effect."""
    others = [key for key in ("torque_nm", "torque_per_rpm", "friction_nm", "ros") if key in section]
    if _ALONE in section and others:
        message = f"{where} holds the shaft at a speed: {others[0]} has no effect"
        findings.add(CODE, message, section.key_span(others[0]), f"leave out {others[0]} or {_ALONE}")


def _from_ros(node: Node | None, where: str, findings: ProblemList) -> bool:
    text = text_value(node, f"ros of {where}", findings, limit=100) if node is not None else None
    if node is not None and text is not None and text != "in":
        message = f"ros of {where} is {quoted(text)}; it can only be in: ROS 2 sets torque_nm"
        findings.add(CODE, message, node.span, "leave it out where ROS 2 does not set it")
    return text == "in"


def _table(node: Node | None, where: str, findings: ProblemList) -> tuple[tuple[float, float], ...]:
    if node is None:
        return ()
    what = f"torque_per_rpm of {where}"
    if not isinstance(node, Sequence) or not 2 <= len(node.items) <= MOST_PAIRS:
        wrong_kind(node, what, f"a list of 2 to {MOST_PAIRS} pairs, such as [[0, 0], [1750, 300]]", findings)
        return ()
    pairs = [_pair(item, what, findings) for item in node.items]
    table = tuple(pair for pair in pairs if pair is not None)
    for below, above, item in zip(table, table[1:], node.items[1:], strict=False):
        if len(table) == len(pairs) and above[0] <= below[0]:
            findings.add(CODE, f"{what}: the speeds must rise, {above[0]:g} follows {below[0]:g} rpm", item.span)
            return ()
    return table


def _pair(node: Node, what: str, findings: ProblemList) -> tuple[float, float] | None:
    if not isinstance(node, Sequence) or len(node.items) != 2:
        wrong_kind(node, f"a pair of {what}", "a list of two numbers: rpm and N m", findings)
        return None
    (low, high), (least, most) = LOAD["speed_rpm"], LOAD["torque_nm"]
    rpm = number_value(node.items[0], f"rpm of {what}", findings, low=low, high=high, code=CODE)
    torque = number_value(node.items[1], f"N m of {what}", findings, low=least, high=most, code=CODE)
    return None if rpm is None or torque is None else (rpm, torque)
