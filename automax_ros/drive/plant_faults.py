"""What can be done to a plant: break something, mend it, load it. One table; stimuli, commands and services use it.

A verb takes a text (``3``, ``A``, ``70 0.2``), which is numbers of its own once it was read. It acts at the plant's
present.
"""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.drive.errors import LARGEST, ParameterError
from automax_ros.drive.line_faults import LINE_VERBS, is_over, mend_line
from automax_ros.drive.plant import DrivePlant
from automax_ros.drive.plant_verbs import Numbers, PlantVerb, in_ranges, note, one_of
from automax_ros.drive.scr import BIT, numbers_of

_TERMINALS = {"T1": 0, "1": 0, "C": 0, "T2": 1, "2": 1, "B": 1, "T3": 2, "3": 2, "A": 2}
"""Terminals of the drive, and the line's phases that they carry (decision: see ``PlantData.standard_rotation``)."""
_SCRS = {str(number): number for number in sorted(BIT)}
_YES = {"TRUE": 1}
_ALL = {"ALL": 1}


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
    """Let a verb act at the plant's present.

    Raises:
        ParameterError: the plant, as it stands, cannot take these values; nothing has happened then.
    """
    VERBS[verb].act(plant, values)


def active_faults(plant: DrivePlant) -> tuple[str, ...]:
    """Return what is broken at a plant's present, as verbs with values, in the order in which it broke."""
    return tuple(text for text in plant.notes if not is_over(plant, text))


def _short_scr(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.short_scr(int(values[0]))
    note(plant, f"short_scr {int(values[0])}")


def _open_gate(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.open_gate(int(values[0]))
    note(plant, f"open_gate {int(values[0])}")


def _blow_fuse(plant: DrivePlant, values: Numbers) -> None:
    """Open a phase between line and bridge: the 57C406 sees the line through fuses of its own and stays locked."""
    plant.circuit.open_phase(int(values[0]))
    note(plant, f"blow_fuse T{int(values[0]) + 1}")


def _lose_phase(plant: DrivePlant, values: Numbers) -> None:
    """Open a phase upstream of everything."""
    plant.line.lose_phase(plant.now_ns, int(values[0]))
    note(plant, f"lose_phase T{int(values[0]) + 1}")


def _lose_tach(plant: DrivePlant, _: Numbers) -> None:
    note(plant, "lose_tach")


def _lose_field(plant: DrivePlant, _: Numbers) -> None:
    _field(plant, 0.0)
    note(plant, "lose_field")


def _field(plant: DrivePlant, voltage: float) -> None:
    assert plant.motor.field is not None
    plant.motor.field.voltage = voltage


def _load(plant: DrivePlant, values: Numbers) -> None:
    plant.load_torque_nm = values[0]


def _repair(plant: DrivePlant, _: Numbers) -> None:
    """Put all that is broken right; the load stays, the contactor too."""
    circuit, line = plant.circuit, plant.line
    for scr, bit in BIT.items():
        if circuit.bridge.wiring.shorted >> bit // 2 & 1:
            circuit.short_scr(scr, shorted=False)
    for scr in numbers_of(circuit.bridge.open_gates):
        circuit.open_gate(scr, is_open=False)
    for text in plant.notes:
        verb, terminal = (*text.split(), "")[:2]
        if verb == "lose_phase":
            line.restore_phase(plant.now_ns, _TERMINALS[terminal])
        elif verb == "blow_fuse":
            circuit.close_phase(_TERMINALS[terminal])
    _field(plant, 1.0)
    mend_line(plant)
    plant.notes.clear()


_SCR = "1 to 6 or 11 to 16"
_PHASE = "1, 2, 3 (the terminals T1, T2, T3) or A, B, C (the line's phases)"
_TORQUE = (-LARGEST, LARGEST)
VERBS: Mapping[str, PlantVerb] = {
    "short_scr": PlantVerb(_SCR, one_of(_SCRS), _short_scr),
    "open_gate": PlantVerb(_SCR, one_of(_SCRS), _open_gate),
    "blow_fuse": PlantVerb(_PHASE, one_of(_TERMINALS), _blow_fuse),
    "lose_phase": PlantVerb(_PHASE, one_of(_TERMINALS), _lose_phase),
    "lose_tach": PlantVerb("true", one_of(_YES), _lose_tach),
    "lose_field": PlantVerb("true", one_of(_YES), _lose_field),
    **LINE_VERBS,
    "load_torque_nm": PlantVerb("N m, -1e6 to 1e6", in_ranges(_TORQUE), _load),
    "repair": PlantVerb("all", one_of(_ALL), _repair),
}  # fmt: skip
"""Everything that can be done to a plant, by its name."""
