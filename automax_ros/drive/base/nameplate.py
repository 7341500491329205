"""A drive's parameters from the motor's name plate, each value with the rule that it came from.

The rules are textbook practice; a measured value replaces its rule. The three example motors are plausible, not real.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

from automax_ros.drive.base.errors import ParameterError, require
from automax_ros.drive.base.motor import MotorData

HP_W = 745.7
KG_M2_PER_LB_FT2 = 0.04214
LINE_OF_ARMATURE_V = {240: 230, 500: 460, 600: 575, 700: 660}
"""Nominal line-to-line voltage of each armature voltage of these drives, V (table 3 of the manual's section 52)."""


@dataclass(frozen=True)
class NamePlate:
    """The data on a motor's name plate, and measured values.

    Attributes:
        hp: rated shaft power, horsepower.
        volts: rated armature voltage, V.
        rpm: base speed.
        amps: rated armature current, A; None derives it from the efficiency.
        efficiency: rated efficiency, for a plate without amps.
        poles: number of poles.
        compensated: whether there is a compensating winding.
        line_v: line-to-line voltage, V rms; None means the drive's usual one.
        line_hz: line frequency, Hz.
        source_pu: source reactance, per unit of the drive's rating.
        resistance_ohm: measured armature resistance; None derives it.
        resistance_pu: armature resistance over rated volts / amps, where it is not measured; None derives it from hp.
        inductance_h: measured armature inductance; None derives it.
        inertia_kg_m2: measured inertia at the shaft, kg m2; None means ``wk2_lb_ft2``.
        wk2_lb_ft2: inertia at the shaft, lb ft2; None derives it.
    """

    hp: float
    volts: float
    rpm: float
    amps: float | None = None
    efficiency: float = 0.9
    poles: int = 4
    compensated: bool = False
    line_v: float | None = None
    line_hz: float = 60.0
    source_pu: float = 0.04
    resistance_ohm: float | None = None
    resistance_pu: float | None = None
    inductance_h: float | None = None
    inertia_kg_m2: float | None = None
    wk2_lb_ft2: float | None = None


@dataclass(frozen=True)
class PlateValue:
    """A number with its unit and the rule it came from."""

    value: float
    unit: str
    rule: str


@dataclass(frozen=True)
class DriveParameters:
    """The parameters of a drive, derived from the name plate.

    Attributes:
        motor: the motor's constants.
        line_v: line-to-line voltage, V rms.
        line_hz: frequency, Hz.
        source_h: source inductance of a phase, H.
        amps: rated armature current, A.
        values: every number by its name, with unit and rule.
    """

    motor: MotorData
    line_v: float
    line_hz: float
    source_h: float
    amps: float
    values: dict[str, PlateValue]


def derive(plate: NamePlate) -> DriveParameters:
    """Return the parameters of a drive.

    Raises:
        ParameterError: a number on the plate is outside its range, or the plate contradicts itself.
    """
    for name, number in (("hp", plate.hp), ("volts", plate.volts), ("rpm", plate.rpm), ("poles", plate.poles)):
        require(name, number, 0.0, above=True)
    require("efficiency", plate.efficiency, 0.0, 1.0, above=True)
    values: dict[str, PlateValue] = {}
    amps = _put(values, "amps", _amps(plate))
    resistance = _put(values, "resistance_ohm", _resistance(plate, amps))
    inductance = _put(values, "inductance_h", _inductance(plate, amps))
    inertia = _put(values, "inertia_kg_m2", _inertia(plate))
    speed = _put(values, "base_speed_rad_s", PlateValue(plate.rpm * pi / 30, "rad/s", "rpm x pi / 30"))
    emf = _put(values, "emf_v", PlateValue(plate.volts - resistance * amps, "V", "volts - resistance x amps"))
    if emf <= 0:
        raise ParameterError(
            f"{resistance:g} ohm drop {resistance * amps:g} V at rated current, more than the rated {plate.volts:g} V"
        )
    k = _put(values, "k_v_s", PlateValue(emf / speed, "V s/rad", "emf / base speed"))
    torque = _put(values, "shaft_torque_n_m", PlateValue(plate.hp * HP_W / speed, "N m", "hp x 745.7 W / base speed"))
    rubbing = _put(
        values,
        "viscous_n_m_s",
        PlateValue(
            max(0.0, k * amps - torque) / speed, "N m s/rad", "(k x amps - shaft torque) / base speed, all as viscous"
        ),
    )
    line_v = _put(values, "line_v", _line(plate))
    source = _put(values, "source_h", _source(plate, line_v, amps))
    _put(values, "inertia_time_s", PlateValue(inertia * speed / torque, "s", "inertia x base speed / shaft torque"))
    motor = MotorData(resistance, inductance, k, inertia, rubbing)
    return DriveParameters(motor, line_v, plate.line_hz, source, amps, values)


def _put(values: dict[str, PlateValue], name: str, value: PlateValue) -> float:
    values[name] = value
    return value.value


def _amps(plate: NamePlate) -> PlateValue:
    if plate.amps is not None:
        return PlateValue(require("amps", plate.amps, 0.0, above=True), "A", "name plate")
    rule = f"hp x 745.7 W / (efficiency {plate.efficiency:g} x volts)"
    return PlateValue(plate.hp * HP_W / (plate.efficiency * plate.volts), "A", rule)


def _resistance(plate: NamePlate, amps: float) -> PlateValue:
    if plate.resistance_ohm is not None:
        return PlateValue(require("resistance in ohm", plate.resistance_ohm, 0.0, above=True), "ohm", "measured")
    if plate.resistance_pu is not None:
        part = require("resistance per unit", plate.resistance_pu, 0.0, 0.5, above=True)
        return PlateValue(part * plate.volts / amps, "ohm", f"{100 * part:g} % of volts / amps, as given")
    # A curve through 8 % at 10 hp and 2.8 % at 800 hp.
    part = min(0.12, max(0.02, 0.08 * (plate.hp / 10) ** -0.24))
    return PlateValue(part * plate.volts / amps, "ohm", f"{100 * part:.1f} % of volts / amps: 8 % x (hp / 10)^-0.24")


def _inductance(plate: NamePlate, amps: float) -> PlateValue:
    if plate.inductance_h is not None:
        return PlateValue(require("inductance in H", plate.inductance_h, 0.0, above=True), "H", "measured")
    factor, winding = (0.25, "with") if plate.compensated else (0.4, "without")
    rule = f"Umanskii-Lindvill: 19.1 x {factor:g} ({winding} compensating winding) x volts / (poles x rpm x amps)"
    return PlateValue(19.1 * factor * plate.volts / (plate.poles * plate.rpm * amps), "H", rule)


def _inertia(plate: NamePlate) -> PlateValue:
    if plate.inertia_kg_m2 is not None:
        return PlateValue(require("inertia in kg m2", plate.inertia_kg_m2, 0.0, above=True), "kg m2", "measured")
    if plate.wk2_lb_ft2 is not None:
        require("inertia in lb ft2", plate.wk2_lb_ft2, 0.0, above=True)
        return PlateValue(plate.wk2_lb_ft2 * KG_M2_PER_LB_FT2, "kg m2", "WK2 in lb ft2 x 0.04214")
    rule = "0.4 s x 1.62e6 hp / rpm^2 lb ft2: an inertia time of 0.4 s, without the load's"
    return PlateValue(0.4 * 1.62e6 * plate.hp / plate.rpm**2 * KG_M2_PER_LB_FT2, "kg m2", rule)


def _line(plate: NamePlate) -> PlateValue:
    if plate.line_v is not None:
        return PlateValue(require("line voltage in V", plate.line_v, 0.0, above=True), "V", "as given")
    usual = LINE_OF_ARMATURE_V.get(round(plate.volts))
    if usual is not None:
        return PlateValue(float(usual), "V", f"usual with {plate.volts:g} V armatures")
    return PlateValue(plate.volts / 1.08, "V", "volts / 1.08, near the usual pairs")


def _source(plate: NamePlate, line_v: float, amps: float) -> PlateValue:
    part = require("source reactance per unit", plate.source_pu, 0.0, 0.5)
    reactance = part * line_v / (sqrt(3) * sqrt(2 / 3) * amps)
    rule = f"{100 * part:g} % of line volts / (sqrt(3) x AC amps), AC amps = sqrt(2/3) x amps, over 2 pi f"
    return PlateValue(reactance / (2 * pi * plate.line_hz), "H", rule)


EXAMPLES = {
    "10hp": NamePlate(10, 240, 1750, efficiency=0.86, resistance_pu=0.08, wk2_lb_ft2=1.5),
    "150hp": NamePlate(150, 500, 1750, efficiency=0.91, resistance_pu=0.045, wk2_lb_ft2=35),
    "800hp": NamePlate(
        800, 700, 1150, efficiency=0.94, poles=6, compensated=True, resistance_pu=0.028, wk2_lb_ft2=450, source_pu=0.05
    ),
}  # fmt: skip
"""Three plausible motors for 230, 460 and 660 V lines."""
