"""The PMI of an SD3000 drive: it regulates the current of a plant as a UDC commands (S-3006, S-3056 p. 4-8, 4-10).

It runs the current minor loop of section 52 on its own raster, six times per line cycle, not synchronized with the
scans of the UDC (decision: it is so with AC drives). Its gains are those of ``current_loop/proposals`` for its motor
(decision). LIM_BAR is the Motor Overload Ratio, and it trips at that ratio + 75 points of the rated current (S-3006,
page 109). Each start tests the SCRs (decision). It has its own power supply and follows its line whatever happens to
the rack (decision); a drive that the UDC no longer commands stops. Faults are set in its register and not logged
(decision).
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from automax_ros.core.numbers import sign_extended
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.sensors import Resolver
from automax_ros.drive.base.state import SavedState, Stateful, check_names
from automax_ros.drive.current_loop import proposals
from automax_ros.drive.current_loop.faults import BAD_SCR, EXT_IET, IOC, PHROT, SYNC_LOSS
from automax_ros.drive.current_loop.inputs import AT_REST, Inputs
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.sequence import Phase
from automax_ros.drive.current_loop.signals import (
    EXTERNAL_TRIP,
    FMCR,
    PERMISSIVE,
    RATED,
    RMCR,
    ROTATION_ABC,
    VOLTAGE,
    VOLTS,
)
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.plant.signals import tach_rpm
from automax_ros.drive.pmi import registers as table

USUAL_RATIO = 150
"""Motor Overload Ratio of a drive for which none is given, % (decision: the default of LIM_BAR in section 36)."""
TRIP_ABOVE = 75
"""Points of rated current from the Motor Overload Ratio to the overcurrent trip (S-3006 p. 109)."""
HIGHEST_TRIP = 400
"""Greatest level of the overcurrent trip, % (decision: that of IOC_THRESH)."""
DROPOUT_S = 0.1
"""Longest time from a stop to the opening of the contactor, s (decision: the default of MAX_M_DROPOUT)."""
VOLTAGE_LAG_NS = 20_000_000
"""Time constant of the armature voltage that the PMI reports, ns (decision: TACHLOSS_OVERSPEED has no filter, and at
standstill a change of the current needs more voltage than its limit of tach loss for some scans)."""
_WORD = 32767
_BITS = {
    IOC: table.OVERCURRENT,
    SYNC_LOSS: table.SYNC_LOSS,
    EXT_IET: table.EXTERNAL_TRIP,
    PHROT: table.ROTATION,
    BAD_SCR: table.BAD_SCR,
}
"""The faults of the loop and their bits of the fault register."""


class Commands(NamedTuple):
    """The PMI's inputs at an instant: command registers, input register, and the state of its UDC.

    Attributes:
        control, reference, alpha: the registers 100 to 102; a UDC that is not linked commands nothing.
        inputs: register 201.
        linked: whether there is a common clock.
        fed: whether a UDC task that commands the drive is scanning.
    """

    control: int = 0
    reference: int = 0
    alpha: int = 180
    inputs: int = 0
    linked: bool = False
    fed: bool = False


class Pmi(Stateful):
    """The PMI of one drive with its plant.

    Attributes:
        loop: its current minor loop.
        link_faults: bits of the fault register for faults of the UDC.
        warnings: the warning register.
        ready: whether a start would be accepted.
        current: ``Measured.current`` at the last interrupt.
        voltage: ``Measured.voltage`` after its lag.
        position: the count of the resolver.
    """

    _kept = ("link_faults", "warnings", "ready", "current", "voltage", "position")

    def __init__(self, plant: DrivePlant, ratio: int | None = None) -> None:
        """Create the PMI in standby; ``ratio`` is the Motor Overload Ratio, %."""
        parameters = plant.data.parameters
        self.plant = plant
        self.ratio = USUAL_RATIO if ratio is None else ratio
        self._controller = DriveController(plant)
        self._resolver = Resolver(table.TURN)
        self._base_rpm = parameters.values["base_speed_rad_s"].value * 30 / pi
        values = parameters.values
        self._rated_v = values["emf_v"].value + values["resistance_ohm"].value * parameters.amps
        self._inputs = inputs_of(plant, self.ratio)
        self.loop = CurrentMinorLoop(tests_scrs=True)
        self.link_faults = self.warnings = 0
        self.ready = False
        self.current = self.position = 0
        self.voltage = 0.0

    @property
    def faults(self) -> int:
        """The fault register."""
        active = self.loop.faults.active
        return self.link_faults | sum(bit for fault, bit in _BITS.items() if active & fault)

    def interrupt(self, now_ns: int, commands: Commands) -> int:
        """Execute a scan of the loop; return the time to the next, ns."""
        control = commands.control if commands.linked else 0
        self._judge_link(commands)
        permitted = bool(commands.inputs & table.PERMITTED)
        status = VOLTAGE | (EXTERNAL_TRIP if commands.inputs & table.TRIPPED else 0)
        if permitted and commands.linked and commands.fed and not self.link_faults:
            status |= PERMISSIVE
        measured = self._controller.measure(now_ns, status, (109, 4, 2, 1 if control & table.FAST_CHANGE else 0))
        self.current = measured.current
        limited = max(-table.FULL, min(table.FULL, commands.reference))
        inputs = self._inputs._replace(
            reference=limited,
            cml_run=bool(control & table.RUN),
            cml_coast_stop=bool(control & table.COAST),
            mcr_select=bool(control & table.REVERSE_CONTACTOR),
            cml_test=bool(control & table.TEST),
            test_brpol=bool(control & table.TEST_BRIDGE_2),
            test_alpha=max(0, min(180, commands.alpha)),
            nonstand_phrot=bool(control & table.ANY_ROTATION and measured.status & ROTATION_ABC),
            fault_reset=bool(control & table.FAULT_RESET),
        )
        outcome = self.loop.scan(now_ns, measured, inputs)
        self._controller.command(outcome.command, now_ns)
        scan_ns = outcome.command.next_ns
        self.voltage += (measured.voltage - self.voltage) * scan_ns / (scan_ns + VOLTAGE_LAG_NS)
        standby = self.loop.sequence.phase is Phase.STANDBY
        if standby and control & table.FAULT_RESET:
            self.link_faults = 0
        self.ready = bool(standby and self.loop.pll.locked and status & PERMISSIVE and not self.faults)
        wanted = standby and bool(control & table.RUN)
        self.warnings = (
            (table.NOT_PERMITTED if wanted and not permitted else 0)
            | (table.REFUSED if wanted and self.faults else 0)
            | (table.REFERENCE_LIMITED if limited != commands.reference else 0)
        )
        return scan_ns

    def feedback(self, now_ns: int) -> dict[int, int]:
        """Advance the plant to an instant and return the feedback registers by their numbers for drive A.

        Speed and position are those of the instant, the current is the mean between the last two interrupts of the
        PMI, the voltage such means after a lag (decision: the ripple is not to be seen). A lost tachometer shows 0,
        and the position stays (decision).
        """
        plant, loop = self.plant, self.loop
        plant.advance(now_ns)
        if "lose_tach" not in plant.notes:
            self.position = self._resolver.read(plant.motor.angle_rad)
        running = loop.sequence.running
        volts = self.voltage * plant.data.parameters.line_v / VOLTS
        return {
            table.STATUS: self._status(),
            table.FAULTS: sign_extended(self.faults, 16),
            table.WARNINGS: self.warnings,
            table.SPEED: _limit(tach_rpm(plant) / self._base_rpm * table.FULL),
            table.POSITION: self.position,
            table.VOLTAGE: _limit(volts / self._rated_v * table.RATED_VOLTAGE),
            table.CURRENT: _limit(self.current * (table.FULL * 100 / RATED) / self.ratio),
            table.VOLTS: _limit(volts),
            table.DELTA: round(loop.control.delta_us) if running else 0,
            table.DC_TIME: loop.control.dc_time,
            table.LINE_PERIOD: loop.pll.period_us,
            table.BAD_SCR_NUM: loop.faults.bad_scr_num,
            table.REF_LAG_OUT: loop.outputs.ref_lag_out if running else 0,
        }

    def state(self) -> SavedState:
        """Return the state, without that of the plant."""
        return super().state() | {"loop": self.loop.numbers(), "firing": self._controller.state()}

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a PMI."""
        check_names("PMI", state, (*self._kept, "loop", "firing"))
        super().restore({name: state[name] for name in self._kept})
        try:
            self.loop.take(state["loop"])
        except (TypeError, ValueError) as error:
            raise ParameterError(f"this is not the state of a PMI: {error}") from error
        self._controller.load(state["firing"])

    def _judge_link(self, commands: Commands) -> None:
        """Trip a drive that is not in standby when its UDC no longer commands it."""
        if self.loop.sequence.phase is Phase.STANDBY:
            return
        if not commands.linked:
            self.link_faults |= table.COMMUNICATION
        elif not commands.fed:
            self.link_faults |= table.UDC_RUN

    def _status(self) -> int:
        sequence = self.loop.sequence
        return (
            (table.RUNNING if sequence.running else 0)
            | (table.LOCKED if self.loop.pll.locked else 0)
            | (table.READY if self.ready else 0)
            | (table.FORWARD_ON if sequence.relays & FMCR else 0)
            | (table.REVERSE_ON if sequence.relays & RMCR else 0)
            | (table.ON_BRIDGE_2 if self.loop.control.bridge == 2 else 0)
            | (table.FAULT if self.faults else 0)
            | (table.WARNING if self.warnings else 0)
        )


def inputs_of(plant: DrivePlant, ratio: int) -> Inputs:
    """Return the inputs of a PMI's loop at rest: the drive's parameters; ``ratio``: Motor Overload Ratio, %."""
    data = plant.data
    circuit = proposals.circuit_of(data.parameters, ratio, source_ohm=data.resistance_ohm)
    return AT_REST._replace(
        ac_line_freq=round(data.parameters.line_hz),
        ref_lag=float(proposals.ref_lag(circuit)),
        kp=proposals.kp(circuit),
        pi_w_lead=float(proposals.pi_w_lead(circuit)),
        ag_factor=proposals.ag_factor(circuit),
        cc_thresh=proposals.cc_thresh(circuit),
        max_m_dropout=DROPOUT_S,
        ioc_thresh=min(HIGHEST_TRIP, ratio + TRIP_ABOVE),
        lim_bar=ratio,
    )


def _limit(number: float) -> int:
    return round(max(-_WORD, min(_WORD, number)))
