"""What can be done to a plant: break something, mend it, load it. One table; stimuli, commands and services use it.

A verb takes a text (``3``, ``A``, ``70 0.2``), which is numbers of its own once it was read. It acts at the plant's
present.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.values import number
from automax_ros.drive.ac_line import HIGHEST_HZ, LOWEST_HZ
from automax_ros.drive.errors import LARGEST, ParameterError
from automax_ros.drive.plant import DrivePlant
from automax_ros.drive.scr import BIT, numbers_of

Numbers = tuple[float, ...]
LONGEST_SAG_S = 3600.0
"""Longest time that a sag can be given, s (decision)."""
_TERMINALS = {"T1": 0, "1": 0, "C": 0, "T2": 1, "2": 1, "B": 1, "T3": 2, "3": 2, "A": 2}
"""Terminals of the drive, and the line's phases that they carry (decision: see ``PlantData.standard_rotation``)."""
_SCRS = {str(number): number for number in sorted(BIT)}
_YES = {"TRUE": 1}
_ALL = {"ALL": 1}
_SAG = "line_sag"


@dataclass(frozen=True)
class PlantVerb:
    """What a verb takes and does.

    Attributes:
        wants: what it takes, for messages.
        read: makes numbers of a text; ValueError where it is none of the verb's.
        act: does it.
        keys: names of the numbers, for a form with keys; the first is always needed.
    """

    wants: str
    read: Callable[[str], Numbers]
    act: Callable[[DrivePlant, Numbers], None]
    keys: tuple[str, ...] = field(default=())


def values_of(verb: str, text: str) -> Numbers:
    """Return what a verb makes of a text.

    Raises:
        ParameterError: there is no such verb, or it does not take that.
    """
    if verb not in VERBS:
        raise ParameterError(f"a plant has no {quoted(verb)}: {near_or_listed(verb, VERBS)}")
    try:
        return VERBS[verb].read(text)
    except ValueError as error:
        raise ParameterError(f"{verb} cannot be {quoted(text)}: it takes {VERBS[verb].wants}") from error


def work_on(plant: DrivePlant, verb: str, values: Numbers) -> None:
    """Let a verb act at the plant's present."""
    VERBS[verb].act(plant, values)


def active_faults(plant: DrivePlant) -> tuple[str, ...]:
    """Return what is broken at a plant's present, as verbs with values, in the order in which it broke."""
    over = plant.sag_end_ns and plant.sag_end_ns <= plant.now_ns
    return tuple(note for note in plant.notes if not (over and note.startswith(_SAG)))


def _one_of(words: Mapping[str, int]) -> Callable[[str], Numbers]:
    def read(text: str) -> Numbers:
        word = text.strip().upper()
        if word not in words:
            raise ValueError(text)
        return (words[word],)

    return read


def _in_range(*ranges: tuple[float, float]) -> Callable[[str], Numbers]:
    """Read numbers with a blank between; all but the first may be missing."""

    def read(text: str) -> Numbers:
        found = tuple(number(word) for word in text.split())
        if not 1 <= len(found) <= len(ranges):
            raise ValueError(text)
        if any(not low <= value <= high for value, (low, high) in zip(found, ranges, strict=False)):
            raise ValueError(text)
        return found

    return read


def _note(plant: DrivePlant, text: str) -> None:
    if text not in plant.notes:
        plant.notes.append(text)


def _forget(plant: DrivePlant, verb: str) -> None:
    plant.notes = [note for note in plant.notes if note.split()[0] != verb]


def _short_scr(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.short_scr(int(values[0]))
    _note(plant, f"short_scr {int(values[0])}")


def _open_gate(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.open_gate(int(values[0]))
    _note(plant, f"open_gate {int(values[0])}")


def _blow_fuse(plant: DrivePlant, values: Numbers) -> None:
    """Open a phase between line and bridge: the 57C406 sees the line through fuses of its own and stays locked."""
    plant.circuit.open_phase(int(values[0]))
    _note(plant, f"blow_fuse T{int(values[0]) + 1}")


def _lose_phase(plant: DrivePlant, values: Numbers) -> None:
    """Open a phase upstream of everything."""
    plant.line.lose_phase(plant.now_ns, int(values[0]))
    _note(plant, f"lose_phase T{int(values[0]) + 1}")


def _lose_tach(plant: DrivePlant, _: Numbers) -> None:
    _note(plant, "lose_tach")


def _lose_field(plant: DrivePlant, _: Numbers) -> None:
    _field(plant, 0.0)
    _note(plant, "lose_field")


def _field(plant: DrivePlant, voltage: float) -> None:
    assert plant.motor.field is not None
    plant.motor.field.voltage = voltage


def _line_sag(plant: DrivePlant, values: Numbers) -> None:
    usual = plant.data.parameters.line_v
    _end_sag(plant)
    plant.line.step_voltage(plant.now_ns, usual * values[0] / 100.0)
    if len(values) > 1:
        plant.sag_end_ns = plant.now_ns + round(values[1] * 1e9)
        plant.line.step_voltage(plant.sag_end_ns, usual)
    _note(plant, f"{_SAG} {values[0]:g}")


def _end_sag(plant: DrivePlant) -> None:
    plant.line.cancel("voltage")
    plant.sag_end_ns = 0
    _forget(plant, _SAG)


def _line_hz(plant: DrivePlant, values: Numbers) -> None:
    plant.line.step_frequency(plant.now_ns, values[0])
    _forget(plant, "line_hz")
    if values[0] != plant.data.parameters.line_hz:
        _note(plant, f"line_hz {values[0]:g}")


def _load(plant: DrivePlant, values: Numbers) -> None:
    plant.load_torque_nm = values[0]


def _repair(plant: DrivePlant, _: Numbers) -> None:
    """Put all that is broken right; the load stays, the contactor too."""
    circuit, line, usual = plant.circuit, plant.line, plant.data.parameters
    for scr, bit in BIT.items():
        if circuit.bridge.wiring.shorted >> bit // 2 & 1:
            circuit.short_scr(scr, shorted=False)
    for scr in numbers_of(circuit.bridge.open_gates):
        circuit.open_gate(scr, is_open=False)
    for note in plant.notes:
        verb, terminal = (*note.split(), "")[:2]
        if verb == "lose_phase":
            line.restore_phase(plant.now_ns, _TERMINALS[terminal])
        elif verb == "blow_fuse":
            circuit.close_phase(_TERMINALS[terminal])
    _field(plant, 1.0)
    _end_sag(plant)
    line.step_voltage(plant.now_ns, usual.line_v)
    line.step_frequency(plant.now_ns, usual.line_hz)
    plant.notes.clear()


_SCR = "1 to 6 or 11 to 16"
_PHASE = "1, 2, 3 (the terminals T1, T2, T3) or A, B, C (the line's phases)"
_TORQUE = (-LARGEST, LARGEST)
VERBS: Mapping[str, PlantVerb] = {
    "short_scr": PlantVerb(_SCR, _one_of(_SCRS), _short_scr),
    "open_gate": PlantVerb(_SCR, _one_of(_SCRS), _open_gate),
    "blow_fuse": PlantVerb(_PHASE, _one_of(_TERMINALS), _blow_fuse),
    "lose_phase": PlantVerb(_PHASE, _one_of(_TERMINALS), _lose_phase),
    "lose_tach": PlantVerb("true", _one_of(_YES), _lose_tach),
    "lose_field": PlantVerb("true", _one_of(_YES), _lose_field),
    _SAG: PlantVerb(
        "percent of the line's voltage, 0 to 100, and for how many seconds (without them until it is repaired)",
        _in_range((0.0, 100.0), (0.001, LONGEST_SAG_S)),
        _line_sag,
        ("to_percent", "for_s"),
    ),
    "line_hz": PlantVerb(
        f"{LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz", _in_range((LOWEST_HZ, HIGHEST_HZ)), _line_hz
    ),
    "load_torque_nm": PlantVerb("N m, -1e6 to 1e6", _in_range(_TORQUE), _load),
    "repair": PlantVerb("all", _one_of(_ALL), _repair),
}  # fmt: skip
"""Everything that can be done to a plant, by its name."""
