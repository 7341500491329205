"""Steady state of a six-pulse SCR bridge that feeds R, L and an EMF; with --motor-k the run of a motor from rest.

Alpha counts in degrees from natural commutation: 0 is a diode bridge, above 90 the bridge inverts. Currents and
voltages are positive as bridge 1 drives them; the EMF is positive against its current. Gates are 60 degrees long.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from math import cos, pi, radians, sqrt
from pathlib import Path
from typing import Any

from automax_ros.cli.options.values import number
from automax_ros.cli.output.files import opened_for_writing
from automax_ros.core.user_error import UsageError
from automax_ros.drive.base.errors import LARGEST, DriveError, require
from automax_ros.drive.base.motor import Motor, MotorData
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.drive.circuit.scr import FORWARD, PHASES, REVERSE, phase_of
from automax_ros.drive.circuit.steady import BridgeCase, Moment, SteadyState, steady_state, waveforms

KEYS = (
    "mean_current_a", "rms_current_a", "ripple_pp_a", "mean_voltage_v", "zero_current_us", "overlap_deg", "continuous",
)  # fmt: skip
"""Fields of a steady state that --json prints."""
COLUMNS = ("t_s", "armature_a", "armature_v", "speed_rad_s")
ROW_NS = 1_000_000
SHORT_MARGIN_US = 400.0
"""Margin below which the report warns: SCRs of these drives recover in 100 to 400 us."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax bridge``."""
    # argparse before 3.14 mistakes -1e-3 for an option and reports a missing number.
    parser._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)
    line = parser.add_argument_group("line")
    line.add_argument("--v-ll", type=number, default=460.0, metavar="V", help="line-to-line voltage, rms (default 460)")
    line.add_argument("--freq", type=number, default=60.0, metavar="HZ", help="48 to 62 (default 60)")
    line.add_argument("--ls", type=number, default=0.0, metavar="H", help="source inductance of a phase (default 0)")
    line.add_argument("--rs", type=number, default=0.0, metavar="OHM", help="source resistance of a phase (default 0)")
    load = parser.add_argument_group("load")
    load.add_argument("--r", type=number, required=True, metavar="OHM", help="armature resistance")
    load.add_argument("--l", type=number, required=True, metavar="H", help="armature inductance, above 0")
    load.add_argument("--emf", type=number, default=0.0, metavar="V", help="EMF of the load (default 0)")
    fire = parser.add_argument_group("bridge")
    fire.add_argument("--alpha", type=number, required=True, metavar="DEG", help="firing angle, 0 to 180")
    fire.add_argument("--reverse", action="store_true", help="fire bridge 2")
    motor = parser.add_argument_group("a motor in place of the EMF, from rest")
    motor.add_argument("--motor-k", type=number, metavar="VS", help="EMF of 1 rad/s, torque of 1 A")
    motor.add_argument("--inertia", type=number, metavar="KGM2", help="inertia at the shaft")
    motor.add_argument("--friction", type=number, metavar="NMS", help="viscous friction, N m s/rad (default 0)")
    motor.add_argument("--load", type=number, metavar="NM", help="load torque (default 0)")
    motor.add_argument("--duration", type=number, metavar="S", help="length of the run")
    motor.add_argument(
        "--csv", type=Path, metavar="FILE", help=f"table of the run, a row every 1 ms: {', '.join(COLUMNS)}"
    )
    parser.add_argument("--json", action="store_true", help="print the steady state as JSON")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw two cycles of the steady state")


def run(arguments: argparse.Namespace) -> int:
    """Print the steady state, or run the motor."""
    case = BridgeCase(
        v_ll_v=arguments.v_ll,
        frequency_hz=arguments.freq,
        source_h=arguments.ls,
        source_ohm=arguments.rs,
        resistance_ohm=arguments.r,
        inductance_h=arguments.l,
        emf_v=arguments.emf,
        alpha_deg=arguments.alpha,
        reverse=arguments.reverse,
    )
    try:
        if arguments.motor_k is None:
            for name in ("inertia", "friction", "load", "duration", "csv"):
                if getattr(arguments, name) is not None:
                    raise UsageError(f"--{name} is for a motor's run", "give --motor-k as well")
            _steady(case, arguments)
        else:
            _run_motor(case, arguments)
    except DriveError as error:
        raise UsageError(str(error)) from error
    return 0


def _steady(case: BridgeCase, arguments: argparse.Namespace) -> None:
    state = steady_state(case)
    if arguments.plot is not None:
        plot(case, state, arguments.plot)
    if arguments.json:
        values = asdict(state)
        print(json.dumps({key: values[key] for key in KEYS}, indent=2))
    else:
        sys.stdout.write(report(case, state))


def report(case: BridgeCase, state: SteadyState) -> str:
    """Return the steady state as text for a drive engineer."""
    ideal = 3 * sqrt(2) / pi * case.v_ll_v * cos(radians(case.alpha_deg)) * (-1 if case.reverse else 1)
    name = f"bridge {2 if case.reverse else 1}, alpha {case.alpha_deg:g} deg (delta {180 - case.alpha_deg:g})"
    ripple = f"rms {state.rms_current_a:.3f} A, ripple {state.ripple_pp_a:.3f} A peak to peak"
    lines = [
        f"{name}, line {case.v_ll_v:g} V {case.frequency_hz:g} Hz, EMF {case.emf_v:g} V",
        f"  mean current   {state.mean_current_a:12.3f} A      {ripple}",
        f"  mean voltage   {state.mean_voltage_v:12.3f} V      ideal bridge, continuous {ideal:.3f} V",
    ]
    if state.mean_current_a == 0.0:
        lines.append("  no current can flow: the EMF is above the line's voltage at this angle")
    elif state.continuous:
        lines.append(f"  conduction       continuous        overlap {state.overlap_deg:.3f} deg")
    else:
        window_us = 1e6 / (6 * case.frequency_hz)
        lines.append(
            f"  conduction    discontinuous        no current for {state.zero_current_us:.1f} of {window_us:.1f} us"
        )
    margin_us = state.margin_deg / 360 / case.frequency_hz * 1e6
    if state.mean_current_a and margin_us < SHORT_MARGIN_US:
        lines.append(
            f"  margin         {state.margin_deg:12.3f} deg    = {margin_us:.0f} us for the outgoing SCR to recover; "
            "SCRs need 100 to 400"
        )
    return "\n".join(lines) + "\n"


def _run_motor(case: BridgeCase, arguments: argparse.Namespace) -> None:
    if arguments.plot is not None:
        raise UsageError("--plot is for a steady state", "leave --motor-k out, or take --csv")
    for name in ("inertia", "duration"):
        if getattr(arguments, name) is None:
            raise UsageError(f"a motor's run needs --{name}")
    if case.emf_v:
        print("automax bridge: the EMF is the motor's, from its speed; --emf is not used", file=sys.stderr)
    case.check()
    duration_s = require("duration in s", arguments.duration, 0.0, 86_400.0)
    data = MotorData(
        case.resistance_ohm, case.inductance_h, arguments.motor_k, arguments.inertia, arguments.friction or 0.0
    )
    load = require("load torque in N m", arguments.load or 0.0, -LARGEST, LARGEST)
    circuit = Circuit(case.line(), Bridge(), Motor(data, load=load))
    if arguments.csv is None:
        last = _simulate(case, circuit, duration_s, lambda _: None)
    else:
        with opened_for_writing(arguments.csv) as file:
            last = _simulate(case, circuit, duration_s, csv.writer(file, lineterminator="\n").writerow)
    if arguments.json:
        print(json.dumps(last, indent=2))
    else:
        speed = last["speed_rad_s"]
        print(
            f"after {last['t_s']:g} s: {speed:.3f} rad/s ({speed * 30 / pi:.1f} rpm), {last['armature_a']:.2f} A; "
            f"greatest current {last['greatest_a']:.1f} A"
        )
    failures = {event.kind.value for event in circuit.take_events()}
    if failures:
        print(f"automax bridge: on the way: {', '.join(sorted(failures))}", file=sys.stderr)


def _simulate(
    case: BridgeCase, circuit: Circuit, duration_s: float, write: Callable[[Sequence[object]], object]
) -> dict[str, float]:
    """Run the motor and return its last row, with the greatest current of all rows."""
    motor = circuit.machine
    assert isinstance(motor, Motor)
    bridge = ConstantAlpha(circuit, radians(case.alpha_deg), bridge=2 if case.reverse else 1)
    write(COLUMNS)
    greatest = 0.0
    values = (0.0, 0.0, 0.0, 0.0)
    for row in range(int(duration_s * 1e9 + 0.5) // ROW_NS + 1):
        bridge.advance(row * ROW_NS)
        values = (row / 1000, circuit.current_a, circuit.armature_v, motor.speed_rad_s)
        greatest = max(greatest, abs(circuit.current_a))
        write([f"{values[0]:.3f}", *(f"{value:.6g}" for value in values[1:])])
    return {**dict(zip(COLUMNS, values, strict=True)), "greatest_a": greatest}


_COLOURS = ("#c1272d", "#2e7d32", "#1f4e9c")


def plot(case: BridgeCase, state: SteadyState, path: Path) -> None:
    """Draw phase and output voltages, current, conducting SCRs and gate pulses over two cycles.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    from automax_ros.cli.output.figure import new_figure, save

    figure = new_figure(10, 9, dpi=100, what="--plot")
    moments = list(waveforms(case, state))
    axes: Any = figure.subplots(4, 1, sharex=True, height_ratios=(3, 2, 1.4, 1.4))
    time_ms = [moment.time_s * 1e3 for moment in moments]
    _draw_voltages(axes[0], time_ms, moments, case)
    _draw_current(axes[1], time_ms, moments, state)
    numbers = REVERSE if case.reverse else FORWARD
    _draw_bars(axes[2], time_ms, [moment.conducting for moment in moments], numbers, "SCR conducts")
    _draw_bars(axes[3], time_ms, [moment.gated for moment in moments], numbers, "gate pulses")
    axes[3].set_xlabel(f"time from a firing of SCR {numbers[0]}, ms")
    axes[3].set_xlim(0.0, time_ms[-1])
    figure.suptitle(
        f"Six-pulse bridge {2 if case.reverse else 1}, alpha {case.alpha_deg:g}°, line {case.v_ll_v:g} V "
        f"{case.frequency_hz:g} Hz ({case.source_h * 1e6:g} µH, {case.source_ohm * 1e3:g} mΩ a phase), "
        f"load {case.resistance_ohm:g} Ω, {case.inductance_h * 1e3:g} mH, EMF {case.emf_v:g} V",
        fontsize=10,
    )
    save(figure, path, dpi=150)


def _draw_voltages(axis: Any, time_ms: list[float], moments: list[Moment], case: BridgeCase) -> None:
    for phase, colour in enumerate(_COLOURS):
        volts = [moment.phases_v[phase] for moment in moments]
        axis.plot(time_ms, volts, color=colour, linewidth=0.8, label=f"phase {PHASES[phase]} to neutral")
    axis.plot(time_ms, [moment.armature_v for moment in moments], color="black", linewidth=1.2, label="output")
    axis.axhline(case.emf_v, color="grey", linewidth=0.8, linestyle="--", label="EMF")
    axis.set_ylabel("voltage, V")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=7, ncols=5, frameon=False)
    axis.grid(alpha=0.3)


def _draw_current(axis: Any, time_ms: list[float], moments: list[Moment], state: SteadyState) -> None:
    axis.plot(time_ms, [moment.current_a for moment in moments], color="black", linewidth=1.2)
    axis.axhline(state.mean_current_a, color="grey", linewidth=0.8, linestyle="--")
    mode = (
        f"overlap {state.overlap_deg:.2f}°" if state.continuous else f"no current {state.zero_current_us:.0f} µs in 60°"
    )
    axis.set_title(
        f"mean {state.mean_current_a:.2f} A, rms {state.rms_current_a:.2f} A, ripple {state.ripple_pp_a:.2f} A p-p, "
        f"mean output {state.mean_voltage_v:.2f} V, {mode}",
        fontsize=9,
    )
    axis.set_ylabel("current, A")
    axis.grid(alpha=0.3)


def _draw_bars(
    axis: Any, time_ms: list[float], sets: list[tuple[int, ...]], numbers: tuple[int, ...], label: str
) -> None:
    step = time_ms[1] - time_ms[0]
    for row, scr in enumerate(numbers):
        bars: list[tuple[float, float]] = []
        for moment, members in zip(time_ms, sets, strict=True):
            if scr not in members:
                continue
            if bars and moment - sum(bars[-1]) < step / 2:
                bars[-1] = (bars[-1][0], moment + step - bars[-1][0])
            else:
                bars.append((moment, step))
        axis.broken_barh(bars, (row - 0.35, 0.7), color=_COLOURS[phase_of(scr)])
    axis.set_yticks(range(len(numbers)), [str(scr) for scr in numbers], fontsize=7)
    axis.set_ylim(len(numbers) - 0.4, -0.6)
    axis.set_ylabel(label, fontsize=8)
    axis.grid(alpha=0.3, axis="x")
