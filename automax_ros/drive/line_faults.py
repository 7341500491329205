"""What can be done to the line of a plant: sags, other frequencies, a generator's load, disturbances (52.4, 52.5).

Voltage, frequency and a generator's transient are those of the line: bridge and sync transformer see them alike. What
they see of notches, noise and harmonics ``sync_signal`` says.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import radians

from automax_ros.drive.ac_line import HIGHEST_HZ, LOWEST_HZ
from automax_ros.drive.errors import ParameterError
from automax_ros.drive.plant import DrivePlant
from automax_ros.drive.plant_verbs import Numbers, PlantVerb, forget, in_ranges, note

LONGEST_SAG_S = 3600.0
"""Longest time that a sag can be given, s (decision)."""
SAG, HERTZ, LOAD, NOTCHES, NOISE, HARMONIC = (
    "line_sag", "line_hz", "generator_load", "line_notches", "line_noise", "line_harmonic",
)  # fmt: skip


def is_over(plant: DrivePlant, text: str) -> bool:
    """Return whether what a note tells of has ended by itself."""
    verb = text.split(maxsplit=1)[0]
    if verb == LOAD:
        return not plant.line.is_moving
    return verb == SAG and 0 < plant.sag_end_ns <= plant.now_ns


def mend_line(plant: DrivePlant) -> None:
    """Give a line its usual voltage and frequency, without disturbances; the notes are the caller's."""
    usual = plant.data.parameters
    plant.sync.clear()
    plant.usual_hz = usual.line_hz
    plant.line.cancel("frequency")
    plant.line.step_frequency(plant.now_ns, usual.line_hz)
    _end_sag(plant)
    _supply(plant)


def _supply(plant: DrivePlant) -> None:
    """Give a line the voltage that sag and notches leave, now and after the sag's end."""
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
    _disturbed(plant, NOTCHES, values)


def _line_noise(plant: DrivePlant, values: Numbers) -> None:
    plant.sync.set_noise(values[0] / 100.0, int(values[1]))
    _disturbed(plant, NOISE, values)


def _line_harmonic(plant: DrivePlant, values: Numbers) -> None:
    order, percent, phase_deg = values
    plant.sync.set_harmonic(int(order), percent / 100.0, radians(phase_deg))
    plant.notes = [text for text in plant.notes if not text.startswith(f"{HARMONIC} {order:g} ")]
    if percent:
        note(plant, f"{HARMONIC} {order:g} {percent:g} {phase_deg:g}")


def _disturbed(plant: DrivePlant, verb: str, values: Numbers) -> None:
    """Note a disturbance, in the place of one before; one of 0 is none."""
    forget(plant, verb)
    if values[0]:
        note(plant, " ".join([verb, *(f"{value:g}" for value in values)]))


_USUAL_LOAD = (0.1, 1.0)
_USUAL_NOTCHES = (300.0, 6.0, -4.0)
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
"""What can be done to a plant's line, by its name."""
