"""The verbs on a plant: break something, repair it, load it. Stimuli, commands and services use this one table.

A verb reads its numbers from a text (``3``, ``A``, ``70 0.2``) and acts at the plant's present. The plant notes what is
broken.

The verbs on the line are sags, other frequencies, a generator's load, and disturbances (52.4, 52.5). Voltage, frequency
and a generator's transient change the line itself, for bridge and sync transformer alike; ``sync_signal`` describes the
effect of notches, noise and harmonics on both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import radians
from typing import Protocol

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.values import number
from automax_ros.drive.base.errors import LARGEST, ParameterError
from automax_ros.drive.circuit.ac_line import HIGHEST_HZ, LOWEST_HZ
from automax_ros.drive.circuit.scr import BIT, numbers_of
from automax_ros.drive.plant.plant import DrivePlant

Numbers = tuple[float, ...]
Range = tuple[float, float]


LONGEST_SAG_S = 3600.0
"""Longest time that a sag can be given, s (decision)."""
SAG, HERTZ, LOAD, NOTCHES, NOISE, HARMONIC = (
    "line_sag", "line_hz", "generator_load", "line_notches", "line_noise", "line_harmonic",
)  # fmt: skip
_USUAL_LOAD = (0.1, 1.0)
_USUAL_NOTCHES = (300.0, 6.0, -4.0)
_TERMINALS = {"T1": 0, "1": 0, "C": 0, "T2": 1, "2": 1, "B": 1, "T3": 2, "3": 2, "A": 2}
"""Terminals of the drive, and the line's phases that they carry (decision: see ``PlantData.standard_rotation``)."""
_SCRS = {str(number): number for number in sorted(BIT)}
_YES = {"TRUE": 1}
_ALL = {"ALL": 1}
_SCR = "1 to 6 or 11 to 16"
_PHASE = "1, 2, 3 (the terminals T1, T2, T3) or A, B, C (the line's phases)"
_TORQUE = (-LARGEST, LARGEST)


@dataclass(frozen=True)
class PlantVerb:
    """The values and the action of a verb.

    Attributes:
        wants: a description of its values, for messages.
        read: converts a text to numbers; ValueError where the text is not valid for the verb.
        act: executes the verb.
        keys: names of the numbers, for a form with keys.
        needed: how many of them must be given, from the first on.
        usual: defaults of the others; those at the end without a default may be left out.
    """

    wants: str
    read: Callable[[str], Numbers]
    act: Callable[[DrivePlant, Numbers], None]
    keys: tuple[str, ...] = field(default=())
    needed: int = 1
    usual: Numbers = field(default=())


def one_of(words: Mapping[str, int]) -> Callable[[str], Numbers]:
    """Return a reader of one word, in any case."""

    def read(text: str) -> Numbers:
        word = text.strip().upper()
        if word not in words:
            raise ValueError(text)
        return (words[word],)

    return read


def in_ranges(
    *ranges: Range, needed: int = 1, usual: Numbers = (), whole: tuple[int, ...] = ()
) -> Callable[[str], Numbers]:
    """Return a reader of numbers separated by blanks, each in its range.

    Args:
        ranges: the least and the greatest value of each.
        needed: how many must be given.
        usual: defaults of those after them.
        whole: places of numbers that must be whole.
    """

    def read(text: str) -> Numbers:
        found = tuple(number(word) for word in text.split())
        if not needed <= len(found) <= len(ranges):
            raise ValueError(text)
        found += usual[len(found) - needed :]
        if any(not low <= value <= high for value, (low, high) in zip(found, ranges, strict=False)):
            raise ValueError(text)
        if any(found[place] != int(found[place]) for place in whole):
            raise ValueError(text)
        return found

    return read


def note(plant: DrivePlant, text: str) -> None:
    """Add a fault to the plant's notes."""
    if text not in plant.notes:
        plant.notes.append(text)


def forget(plant: DrivePlant, verb: str) -> None:
    """Remove the faults of a verb from the plant's notes."""
    plant.notes = [text for text in plant.notes if text.split(maxsplit=1)[0] != verb]


def is_over(plant: DrivePlant, text: str) -> bool:
    """Return whether the fault of a note has ended without repair."""
    verb = text.split(maxsplit=1)[0]
    if verb == LOAD:
        return not plant.line.is_moving
    return verb == SAG and 0 < plant.sag_end_ns <= plant.now_ns


def restore_line(plant: DrivePlant) -> None:
    """Restore a line's usual voltage and frequency, without disturbances; the caller updates the notes."""
    usual = plant.data.parameters
    plant.sync.clear()
    plant.usual_hz = usual.line_hz
    plant.line.cancel("frequency")
    plant.line.step_frequency(plant.now_ns, usual.line_hz)
    _end_sag(plant)
    _supply(plant)


def _supply(plant: DrivePlant) -> None:
    """Set a line's voltage to the rest that sag and notches leave, now and after the sag's end."""
    line = plant.line
    full = plant.data.parameters.line_v * (1.0 - plant.sync.lost_part)
    line.cancel("voltage")
    sagging = not plant.sag_end_ns or plant.sag_end_ns > plant.now_ns
    line.step_voltage(plant.now_ns, full * plant.sag / 100.0 if sagging else full)
    if plant.sag_end_ns > plant.now_ns:
        line.step_voltage(plant.sag_end_ns, full)


def _end_sag(plant: DrivePlant) -> None:
    plant.sag, plant.sag_end_ns = 100.0, 0
    forget(plant, SAG)


def _line_sag(plant: DrivePlant, values: Numbers) -> None:
    _end_sag(plant)
    plant.sag = values[0]
    if len(values) > 1:
        plant.sag_end_ns = plant.now_ns + round(values[1] * 1e9)
    _supply(plant)
    note(plant, f"{SAG} {values[0]:g}")


def _line_hz(plant: DrivePlant, values: Numbers) -> None:
    plant.line.cancel("frequency")
    plant.usual_hz = values[0]
    if len(values) > 1:
        plant.line.drift_frequency(plant.now_ns, values[0], values[1])
    else:
        plant.line.step_frequency(plant.now_ns, values[0])
    forget(plant, HERTZ)
    if values[0] != plant.data.parameters.line_hz:
        note(plant, f"{HERTZ} {values[0]:g}")


def _generator_load(plant: DrivePlant, values: Numbers) -> None:
    percent, dip_hz, fall_s, recovery_s = values
    lowest = plant.usual_hz - dip_hz
    if lowest < LOWEST_HZ:
        raise ParameterError(
            f"{LOAD}: the frequency would fall from {plant.usual_hz:g} to {lowest:g} Hz, and the line goes down to "
            f"{LOWEST_HZ:g} Hz: take a dip_hz of {plant.usual_hz - LOWEST_HZ:g} at most"
        )
    line = plant.line
    _end_sag(plant)
    for what in ("voltage", "frequency"):
        line.cancel(what)
    volts = plant.data.parameters.line_v * (1.0 - plant.sync.lost_part)
    line.generator_transient(
        plant.now_ns, percent / 100.0, dip_hz, fall_s, recovery_s, volts=volts, hertz=plant.usual_hz
    )
    forget(plant, LOAD)
    note(plant, f"{LOAD} {percent:g} {dip_hz:g}")


def _line_notches(plant: DrivePlant, values: Numbers) -> None:
    percent, width_us, count, phase_deg = values
    width = width_us * 1e-6 * plant.data.parameters.line_hz
    plant.sync.set_notches(percent / 100.0, width, int(count), radians(phase_deg))
    _supply(plant)
    _note_disturbance(plant, NOTCHES, values)


def _line_noise(plant: DrivePlant, values: Numbers) -> None:
    plant.sync.set_noise(values[0] / 100.0, int(values[1]))
    _note_disturbance(plant, NOISE, values)


def _line_harmonic(plant: DrivePlant, values: Numbers) -> None:
    order, percent, phase_deg = values
    plant.sync.set_harmonic(int(order), percent / 100.0, radians(phase_deg))
    plant.notes = [text for text in plant.notes if not text.startswith(f"{HARMONIC} {order:g} ")]
    if percent:
        note(plant, f"{HARMONIC} {order:g} {percent:g} {phase_deg:g}")


def _note_disturbance(plant: DrivePlant, verb: str, values: Numbers) -> None:
    forget(plant, verb)
    if values[0]:
        note(plant, " ".join([verb, *(f"{value:g}" for value in values)]))


LINE_VERBS: Mapping[str, PlantVerb] = {
    SAG: PlantVerb(
        "percent of the line's voltage, 0 to 100, and for how many seconds (without them until it is repaired)",
        in_ranges((0.0, 100.0), (0.001, LONGEST_SAG_S)),
        _line_sag,
        ("to_percent", "for_s"),
    ),
    HERTZ: PlantVerb(
        f"{LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz, and at how many Hz/s, 0.001 to 100 (without them at once)",
        in_ranges((LOWEST_HZ, HIGHEST_HZ), (0.001, 100.0)),
        _line_hz,
        ("hz", "rate_hz_s"),
    ),
    LOAD: PlantVerb(
        "by how many percent the voltage dips, 0 to 60, and the frequency by how many Hz, 0 to 14; time constants of "
        "fall (0.1) and recovery (1), 0.005 to 60 s",
        in_ranges((0.0, 60.0), (0.0, 14.0), (0.005, 60.0), (0.005, 60.0), needed=2, usual=_USUAL_LOAD),
        _generator_load,
        ("dip_percent", "dip_hz", "fall_s", "recovery_s"),
        2,
        _USUAL_LOAD,
    ),
    NOTCHES: PlantVerb(
        "depth in percent of the peak, 0 (none) to 200, width (300), 1 to 2000 us, how many per cycle (6), 1 to 12, "
        "and where the first begins (-4), -180 to 180 degrees from the sync's zero",
        in_ranges((0.0, 200.0), (1.0, 2000.0), (1.0, 12.0), (-180.0, 180.0), usual=_USUAL_NOTCHES, whole=(2,)),
        _line_notches,
        ("depth_percent", "width_us", "per_cycle", "phase_deg"),
        1,
        _USUAL_NOTCHES,
    ),
    NOISE: PlantVerb(
        "rms in percent of the peak, 0 (none) to 20, and the seed of its numbers (0), 0 to 65535",
        in_ranges((0.0, 20.0), (0.0, 65535.0), usual=(0.0,), whole=(1,)),
        _line_noise,
        ("percent", "seed"),
        1,
        (0.0,),
    ),
    HARMONIC: PlantVerb(
        "order, 2 to 50, percent of the peak, 0 (none) to 50, and phase at the sync's zero (0), -360 to 360 degrees",
        in_ranges((2.0, 50.0), (0.0, 50.0), (-360.0, 360.0), needed=2, usual=(0.0,), whole=(0,)),
        _line_harmonic,
        ("order", "percent", "phase_deg"),
        2,
        (0.0,),
    ),
}
"""The verbs on a plant's line, by name."""


class Readable(Protocol):
    """What reads its values from a text; ``wants`` describes them, "" for none."""

    @property
    def wants(self) -> str: ...  # noqa: D102
    @property
    def read(self) -> Callable[[str], Numbers]: ...  # noqa: D102


def values_of(verb: str, text: str, verbs: Mapping[str, Readable] | None = None, owner: str = "a plant") -> Numbers:
    """Return the numbers that a verb of ``owner`` reads from a text; ``verbs`` are its verbs, ``VERBS`` if None.

    Raises:
        ParameterError: there is no such verb, or the text is not valid for it.
    """
    known: Mapping[str, Readable] = VERBS if verbs is None else verbs
    if verb not in known:
        raise ParameterError(f"{owner} has no {quoted(verb)}: {near_or_listed(verb, known)}")
    try:
        return known[verb].read(text)
    except ValueError as error:
        raise ParameterError(f"{verb} cannot be {quoted(text)}: it takes {takes(known[verb])}") from error


def takes(verb: Readable) -> str:
    """Return what a verb takes, in words."""
    return verb.wants or "no value"


def execute_verb(plant: DrivePlant, verb: str, values: Numbers) -> None:
    """Execute a verb at the plant's present.

    Raises:
        ParameterError: the plant cannot accept these values in its present state; nothing has changed then.
    """
    VERBS[verb].act(plant, values)


def active_faults(plant: DrivePlant) -> tuple[str, ...]:
    """Return a plant's present faults, as verbs with values, in the order in which they occurred."""
    return tuple(text for text in plant.notes if not is_over(plant, text))


def _short_scr(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.short_scr(int(values[0]))
    note(plant, f"short_scr {int(values[0])}")


def _open_gate(plant: DrivePlant, values: Numbers) -> None:
    plant.circuit.open_gate(int(values[0]))
    note(plant, f"open_gate {int(values[0])}")


def _blow_fuse(plant: DrivePlant, values: Numbers) -> None:
    """Open a phase between line and bridge: the 57C406 has its own fuses to the line and stays locked."""
    plant.circuit.open_phase(int(values[0]))
    note(plant, f"blow_fuse T{int(values[0]) + 1}")


def _lose_phase(plant: DrivePlant, values: Numbers) -> None:
    plant.line.lose_phase(plant.now_ns, int(values[0]))
    note(plant, f"lose_phase T{int(values[0]) + 1}")


def _lose_field(plant: DrivePlant, _: Numbers) -> None:
    assert plant.motor.field is not None
    plant.motor.field.voltage = 0.0
    note(plant, "lose_field")


def _load(plant: DrivePlant, values: Numbers) -> None:
    plant.load_torque_nm = values[0]


def _repair(plant: DrivePlant, _: Numbers) -> None:
    """Repair all faults; the load and the contactor stay as they are."""
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
    assert plant.motor.field is not None
    plant.motor.field.voltage = 1.0
    restore_line(plant)
    plant.notes.clear()


VERBS: Mapping[str, PlantVerb] = {
    "short_scr": PlantVerb(_SCR, one_of(_SCRS), _short_scr),
    "open_gate": PlantVerb(_SCR, one_of(_SCRS), _open_gate),
    "blow_fuse": PlantVerb(_PHASE, one_of(_TERMINALS), _blow_fuse),
    "lose_phase": PlantVerb(_PHASE, one_of(_TERMINALS), _lose_phase),
    "lose_tach": PlantVerb("true", one_of(_YES), lambda plant, _: note(plant, "lose_tach")),
    "lose_field": PlantVerb("true", one_of(_YES), _lose_field),
    **LINE_VERBS,
    "load_torque_nm": PlantVerb("N m, -1e6 to 1e6", in_ranges(_TORQUE), _load),
    "repair": PlantVerb("all", one_of(_ALL), _repair),
}  # fmt: skip
"""All verbs on a plant, by name."""
