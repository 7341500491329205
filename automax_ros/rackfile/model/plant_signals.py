"""The signals of a plant, of its roll or roller, and of a web: their names as a rack tells them, types and units.

They are fields of the messages ``PlantState``, ``RollState`` and ``WebState``. No name is in two of them, so a signal's
name says what it is of.
"""

from __future__ import annotations

from automax_ros.core.types import DataType
from automax_ros.drive.web.signals import END_KINDS, END_UNITS, WEB_KINDS, WEB_UNITS

SIGNAL_UNITS = {
    "current_a": "A",
    "current_rms_a": "A",
    "voltage_v": "V",
    "torque_nm": "N m",
    "load_nm": "N m",
    "speed_rpm": "rpm",
    "position_rad": "rad",
    "field": "",
    "line_hz": "Hz",
    "line_v": "V",
    "line_j": "J",
    "loss_j": "J",
    "stored_j": "J",
    "shaft_j": "J",
}
"""Units of the signals that are REALs; ``bridge`` is an INTEGER, ``contactor`` a BOOLEAN."""
SIGNAL_KINDS = {**dict.fromkeys(SIGNAL_UNITS, DataType.REAL), "bridge": DataType.INTEGER, "contactor": DataType.BOOLEAN}
"""The types of all signals of a plant."""
ALL_KINDS = {**SIGNAL_KINDS, **END_KINDS, **WEB_KINDS}
"""The types of all signals: of plants, of their rolls and rollers, of webs."""
ALL_UNITS = {**SIGNAL_UNITS, **END_UNITS, **WEB_UNITS}
"""The units of those that are REALs."""
