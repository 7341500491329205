"""The power circuit of a drive: AC line, SCR bridges, DC motor; SI units, sign conventions in ``docs/drive.md``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.drive.ac_line import AcLine
    from automax_ros.drive.bridge import Bridge
    from automax_ros.drive.circuit import Circuit
    from automax_ros.drive.coupling import Coupling
    from automax_ros.drive.errors import DriveError
    from automax_ros.drive.firing import ConstantAlpha
    from automax_ros.drive.meter import EnergyMeter
    from automax_ros.drive.motor import FixedLoad, Motor, MotorData
    from automax_ros.drive.nameplate import DriveParameters, NamePlate, derive
    from automax_ros.drive.sensors import Resolver, Tachometer
    from automax_ros.drive.steady import BridgeCase, SteadyState, steady_state, waveforms

__all__ = [
    "AcLine",
    "Bridge",
    "BridgeCase",
    "Circuit",
    "ConstantAlpha",
    "Coupling",
    "DriveError",
    "DriveParameters",
    "EnergyMeter",
    "FixedLoad",
    "Motor",
    "MotorData",
    "NamePlate",
    "Resolver",
    "SteadyState",
    "Tachometer",
    "derive",
    "steady_state",
    "waveforms",
]

__getattr__ = face(
    __name__,
    "errors",
    "nameplate",
    "ac_line",
    "bridge",
    "firing",
    "motor",
    "coupling",
    "sensors",
    "meter",
    "circuit",
    "steady",
)
