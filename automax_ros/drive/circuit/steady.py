"""The steady state of a bridge that feeds R, L and an EMF at a constant firing angle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, pi, radians, sqrt

from automax_ros.drive.base.errors import LARGEST, SMALLEST, SteadyStateError, require
from automax_ros.drive.base.motor import FixedLoad
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.firing import ConstantAlpha, natural_angle
from automax_ros.drive.circuit.meter import Sample
from automax_ros.drive.circuit.scr import FORWARD, REVERSE
from automax_ros.drive.circuit.waves import WavePiece

SETTLED = 1e-9
"""Two windows whose relative difference is less than this are equal."""
MOST_CYCLES = 2000


@dataclass(frozen=True)
class BridgeCase:
    """The case that ``automax bridge`` computes; SI units, alpha in degrees from natural commutation.

    Attributes:
        v_ll_v: line-to-line voltage, V rms.
        frequency_hz: line frequency.
        source_h: source inductance of a phase.
        source_ohm: source resistance of a phase.
        resistance_ohm: resistance of the load.
        inductance_h: inductance of the load.
        emf_v: EMF of the load, positive against current of bridge 1.
        alpha_deg: firing angle, 0 to 180.
        reverse: whether bridge 2 is fired.
    """

    v_ll_v: float = 460.0
    frequency_hz: float = 60.0
    source_h: float = 0.0
    source_ohm: float = 0.0
    resistance_ohm: float = 0.05
    inductance_h: float = 2e-3
    emf_v: float = 0.0
    alpha_deg: float = 60.0
    reverse: bool = False

    def check(self) -> None:
        """Raise a ParameterError for an impossible value."""
        require("line-to-line voltage in V", self.v_ll_v, SMALLEST, LARGEST)
        require("alpha in degrees", self.alpha_deg, 0.0, 180.0)
        self.line()
        FixedLoad(self.resistance_ohm, self.inductance_h, self.emf_v)

    def line(self, angle_rad: float = 0.0) -> AcLine:
        """Return the line with an angle at its start."""
        return AcLine(
            self.v_ll_v,
            self.frequency_hz,
            inductance_h=self.source_h,
            resistance_ohm=self.source_ohm,
            angle_rad=angle_rad,
        )

    def circuit(self, angle_rad: float = 0.0) -> Circuit:
        """Return the circuit with ideal SCRs: their recovery is reported as a margin instead."""
        load = FixedLoad(self.resistance_ohm, self.inductance_h, self.emf_v)
        return Circuit(self.line(angle_rad), Bridge(turn_off_s=0.0), load)

    @property
    def window_ns(self) -> int:
        """A sixth of a cycle, ns."""
        return round(1e9 / (6 * self.frequency_hz))


@dataclass(frozen=True)
class SteadyState:
    """The steady state, which repeats every 60 degrees.

    Attributes:
        mean_current_a: mean armature current, A; negative from bridge 2.
        rms_current_a: its root mean square, A.
        ripple_pp_a: its peak-to-peak ripple, A.
        mean_voltage_v: mean voltage over the load, V.
        zero_current_us: time without current, us in each 60 degrees.
        overlap_deg: degrees in each 60 during which two SCRs share a rail.
        continuous: whether the current is never zero.
        margin_deg: rest of the half cycle after firing and overlap, for the outgoing SCR to recover, degrees.
        start_current_a: armature current at the instant of firing, A.
    """

    mean_current_a: float
    rms_current_a: float
    ripple_pp_a: float
    mean_voltage_v: float
    zero_current_us: float
    overlap_deg: float
    continuous: bool
    margin_deg: float
    start_current_a: float


def steady_state(case: BridgeCase) -> SteadyState:
    """Return the steady state; gates are 60 degrees long, so that discontinuous conduction starts when it can.

    Raises:
        ParameterError: the case is impossible.
        SteadyStateError: no state repeats, because commutation fails.
    """
    case.check()
    current = _fixed_point(case)
    if current is not None:
        circuit = _window(case, current)
        if circuit is not None:
            pieces = circuit.pieces()
            return _describe(case, [(circuit.sample(), pieces)], current)
    return _simulate(case)


def _window(case: BridgeCase, current_a: float) -> Circuit | None:
    """Return the circuit 60 degrees after its first SCR is fired at a current, None if the window is not valid.

    It is valid if two SCRs, or none, conduct before and after it.
    """
    numbers = REVERSE if case.reverse else FORWARD
    circuit = case.circuit(natural_angle(numbers[0], case.line()) + radians(case.alpha_deg))
    if current_a:
        circuit.begin_with((numbers[4], numbers[5]), current_a)
    circuit.fire(0, case.window_ns, numbers[0], numbers[5])
    circuit.advance(case.window_ns)
    fits = circuit.conducting in {(), tuple(sorted((numbers[0], numbers[5])))}
    return circuit if fits else None


def _fixed_point(case: BridgeCase) -> float | None:
    """Return the current at firing that recurs after 60 degrees (secant method), None if there is none."""
    sign = -1.0 if case.reverse else 1.0
    before, gain_before = 0.0, None
    current = 0.0
    for _ in range(60):
        circuit = _window(case, sign * current)
        if circuit is None:
            return None
        gain = sign * circuit.current_a - current
        if abs(gain) <= SETTLED * max(1.0, current):
            return sign * current
        if gain_before is None or gain == gain_before:
            following = current + gain
        else:
            following = current - gain * (current - before) / (gain - gain_before)
        before, gain_before = current, gain
        current = max(0.0, following)
    return None


def _simulate(case: BridgeCase) -> SteadyState:
    """Return the state in which a simulation from rest settles: for overlaps beyond 60 degrees, or to find none."""
    circuit = case.circuit()
    bridge = ConstantAlpha(circuit, radians(case.alpha_deg), bridge=2 if case.reverse else 1)
    before = mean = inf
    for _ in range(MOST_CYCLES):
        start_current_a = circuit.current_a
        windows, ends = [], set()
        for _ in range(6):
            windows.append(_one_window(circuit, bridge, case))
            ends.add(circuit.conducting)
        means = [sample.mean_current_a for sample, _ in windows]
        before, mean = mean, sum(means) / 6
        least = max(1.0, abs(mean))
        if abs(mean - before) <= SETTLED * least:
            # A pair that stays on for ever repeats too, but then the bridge does not work.
            if max(means) - min(means) > 1e-4 * least or len(ends) < 6:
                break
            return _describe(case, windows, start_current_a)
    raise SteadyStateError(_why(case, mean))


def _one_window(circuit: Circuit, bridge: ConstantAlpha, case: BridgeCase) -> tuple[Sample, list[WavePiece]]:
    bridge.advance(circuit.now_ns + case.window_ns)
    pieces = circuit.pieces()
    return circuit.sample(), pieces


def _why(case: BridgeCase, current_a: float) -> str:
    current = f"{abs(current_a):.4g} A on average"
    text = f"no steady state at alpha {case.alpha_deg:g} degrees: SCRs fail to commutate, at {current}"
    if case.alpha_deg <= 90:
        return text
    reactance = 2 * pi * case.frequency_hz * case.source_h
    return (
        f"{text}. An inverter at I ampere needs cos(alpha) > 2 X I / (sqrt(2) V) - 1 with X = {reactance:.4g} ohm "
        f"a phase, V = {case.v_ll_v:g} V: take a smaller alpha or an EMF nearer to 0 than {1.35 * case.v_ll_v:.4g} V"
    )


def _describe(case: BridgeCase, windows: list[tuple[Sample, list[WavePiece]]], start_current_a: float) -> SteadyState:
    time = sum(sample.duration_s for sample, _ in windows)
    mean = sum(sample.charge_c for sample, _ in windows) / time
    square = sum(sample.rms_current_a**2 * sample.duration_s for sample, _ in windows) / time
    voltage = sum(sample.volt_s for sample, _ in windows) / time
    zero = sum(sample.zero_current_s for sample, _ in windows) / time
    overlap_deg = 60 * sum(sample.overlap_s for sample, _ in windows) / time
    least, most = _extremes([piece for _, pieces in windows for piece in pieces], zero > 0)
    return SteadyState(
        mean_current_a=mean,
        rms_current_a=sqrt(square),
        ripple_pp_a=most - least,
        mean_voltage_v=voltage,
        zero_current_us=zero * 1e6 / (6 * case.frequency_hz),
        overlap_deg=overlap_deg,
        continuous=zero == 0.0,
        margin_deg=180.0 - case.alpha_deg - overlap_deg,
        start_current_a=start_current_a,
    )


def _extremes(pieces: list[WavePiece], with_zero: bool) -> tuple[float, float]:
    least, most = (0.0, 0.0) if with_zero or not pieces else (inf, -inf)
    for piece in pieces:
        low, high = piece.extremes()
        least, most = min(least, low), max(most, high)
    return least, most


@dataclass(frozen=True)
class Moment:
    """The waveforms at one instant: times in s, volts, amperes, numbers of SCRs."""

    time_s: float
    phases_v: tuple[float, float, float]
    armature_v: float
    current_a: float
    conducting: tuple[int, ...]
    gated: tuple[int, ...]


def waveforms(case: BridgeCase, state: SteadyState, *, cycles: int = 2, step_ns: int = 10_000) -> Iterator[Moment]:
    """Yield the steady state from a firing of the first SCR on, every ``step_ns``."""
    bridge = 2 if case.reverse else 1
    numbers = REVERSE if case.reverse else FORWARD
    alpha = radians(case.alpha_deg)
    circuit = case.circuit(natural_angle(numbers[0], case.line()) + alpha)
    if state.start_current_a:
        circuit.begin_with((numbers[4], numbers[5]), state.start_current_a)
    controller = ConstantAlpha(circuit, alpha, bridge=bridge)
    for number in range(round(cycles * 6 * case.window_ns / step_ns) + 1):
        # A nanosecond after the grid, so that events on it are included.
        controller.advance(number * step_ns + 1)
        now = circuit.now_ns
        phases = (
            circuit.line.phase_voltage(0, now),
            circuit.line.phase_voltage(1, now),
            circuit.line.phase_voltage(2, now),
        )
        gated = circuit.bridge.gated_numbers(now)
        yield Moment(now * 1e-9, phases, circuit.armature_v, circuit.current_a, circuit.conducting, gated)
