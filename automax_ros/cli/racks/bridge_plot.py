"""The drawing of ``automax bridge --plot``: two cycles of a steady state for a report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from automax_ros.cli.output.figure import new_figure
from automax_ros.core.safe_file import atomic_write
from automax_ros.core.user_error import UsageError
from automax_ros.drive.circuit.scr import FORWARD, PHASES, REVERSE, phase_of
from automax_ros.drive.circuit.steady import BridgeCase, Moment, SteadyState, waveforms

_COLOURS = ("#c1272d", "#2e7d32", "#1f4e9c")


def plot(case: BridgeCase, state: SteadyState, path: Path) -> None:
    """Draw phase and output voltages, current, conducting SCRs and gate pulses over two cycles.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
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
    try:
        with atomic_write(path) as place:
            figure.savefig(place, dpi=150)
    except (OSError, ValueError) as error:  # ValueError: the suffix is not that of a picture format
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"{path} cannot be written: {reason}") from error


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
    for row, number in enumerate(numbers):
        bars: list[tuple[float, float]] = []
        for moment, members in zip(time_ms, sets, strict=True):
            if number not in members:
                continue
            if bars and moment - sum(bars[-1]) < step / 2:
                bars[-1] = (bars[-1][0], moment + step - bars[-1][0])
            else:
                bars.append((moment, step))
        axis.broken_barh(bars, (row - 0.35, 0.7), color=_COLOURS[phase_of(number)])
    axis.set_yticks(range(len(numbers)), [str(number) for number in numbers], fontsize=7)
    axis.set_ylim(len(numbers) - 0.4, -0.6)
    axis.set_ylabel(label, fontsize=8)
    axis.grid(alpha=0.3, axis="x")
