"""Transients against an independent integration: alpha steps, EMF reversal, loss of a phase, drift, a shorted SCR."""

from math import pi

import numpy as np
import pytest

from automax_ros.drive.circuit.conduction import EventKind
from drive.support import circuit_of, currents_at, fire_all, oracle_gates, oracle_of, plan

WINDOW_NS = 1e9 / 360


def windows(count, first=6):
    """Instants that sample each of some windows of 60 degrees, ns."""
    return [round((first + n / 25) * WINDOW_NS) for n in range(25 * count)]


def compare(circuit, oracle, times, *, at_most=0.005):
    """The model at instants against the integration, relative to the greatest current."""
    ours = np.array(currents_at(circuit, times))
    oracle.run(times[-1] * 1e-9 + 1e-6)
    theirs = oracle.at(np.array(times) * 1e-9)
    assert np.abs(theirs).max() > 10
    assert np.abs(ours - theirs).max() < at_most * np.abs(theirs).max()
    return ours


def run(circuit, gates, times, **options):
    oracle = oracle_of(circuit, step=50e-6, rtol=1e-8, **options)
    oracle.gates = oracle_gates(gates)
    fire_all(circuit, gates)
    return compare(circuit, oracle, times)


def test_alpha_steps():
    alphas = [60.0] * 8 + [35.0] * 6 + [110.0] * 8
    ours = run(circuit_of(emf=150), plan(alphas), windows(22))
    assert ours.max() > 300
    assert ours[-1] == 0.0


def test_start_into_an_inverting_emf():
    run(circuit_of(emf=-350, ls=200e-6), plan([150.0] * 4 + [125.0] * 10), windows(14))


def test_emf_reversal_through_both_bridges():
    """Bridge 1 drives, phases back until no current flows, then bridge 2 brakes and drives the other way."""
    circuit = circuit_of(emf=150)
    oracle = oracle_of(circuit, step=50e-6, rtol=1e-8)
    gates = plan([65.0] * 8 + [150.0] * 6) + plan([110.0] * 8 + [80.0] * 8, bridge=2, first_window=21)
    fire_all(circuit, gates)
    oracle.gates = oracle_gates(gates)
    times = windows(15)
    first = compare(circuit, oracle, times)
    circuit.machine.emf_v = oracle.emf = -40.0
    later = windows(17, first=21)
    ours = np.array(currents_at(circuit, later))
    oracle.run(later[-1] * 1e-9 + 1e-6)
    theirs = oracle.at(np.array(later) * 1e-9)
    assert np.abs(ours - theirs).max() < 0.005 * np.abs(theirs).max()
    assert first.max() > 50
    assert ours.min() < -50


@pytest.mark.parametrize("phase", [0, 2])
def test_a_phase_is_lost_and_returns(phase):
    circuit = circuit_of(emf=150, trace=False)
    gates = plan([60.0] * 40)
    fire_all(circuit, gates)
    oracle = oracle_of(circuit, step=50e-6, rtol=1e-8)
    oracle.gates = oracle_gates(gates)
    lost_ns, back_ns = round(14.3 * WINDOW_NS), round(27.6 * WINDOW_NS)
    circuit.line.lose_phase(lost_ns, phase)
    circuit.line.restore_phase(back_ns, phase)
    times = windows(34)
    ours = np.array(currents_at(circuit, times))
    oracle.run(lost_ns * 1e-9)
    oracle.lose("abc"[phase], 1200.0)
    oracle.run(back_ns * 1e-9)
    assert oracle.lost == {"abc"[phase]}
    oracle.lost = frozenset()
    oracle.run(times[-1] * 1e-9 + 1e-6)
    theirs = oracle.at(np.array(times) * 1e-9)
    assert np.abs(ours - theirs).max() < 0.005 * theirs.max()
    kinds = [event.kind for event in circuit.take_events()]
    assert kinds.index(EventKind.PHASE_OPEN) < kinds.index(EventKind.PHASE_CLOSED)


def test_frequency_drifts_from_62_to_48_hz():
    """At 200 Hz/s, faster than any line, and gates at the true angle: an error of the line would show."""
    rate, start_s = 200.0, 0.02
    end_s = start_s + 14 / rate

    def angle(t):
        ramp = np.clip(t, start_s, end_s) - start_s
        after = max(t - end_s, 0.0)
        return 2 * pi * (62 * min(t, start_s) + 62 * ramp - rate * ramp**2 / 2 + 48 * after)

    def instant(wanted):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if angle(middle) < wanted else (low, middle)
        return round(low * 1e9)

    gates = []
    for window in range(7, 42):
        on, off = (instant((window + extra) * pi / 3) for extra in (0.0, 1.0))
        gates += [(on, off, window % 6 + 1), (on, off, (window - 1) % 6 + 1)]
    circuit = circuit_of(emf=150)
    circuit.line.step_frequency(0, 62.0)
    circuit.line.drift_frequency(round(start_s * 1e9), 48.0, rate)
    times = [round(20e6 + n * 0.1e6) for n in range(1000)]
    run(circuit, gates, times, angle=angle)
    assert circuit.line.frequency_hz == 48.0
    assert circuit.line.angle(circuit.now_ns) % (2 * pi) == pytest.approx(
        angle(circuit.now_ns * 1e-9) % (2 * pi), abs=1e-9
    )


@pytest.mark.parametrize("number", [1, 6])
def test_a_shorted_scr(number):
    """Through it and each SCR of its rail in turn the line is shorted, limited by the source alone."""
    gates = plan([75.0] * 24)
    circuit = circuit_of(emf=100, ls=200e-6)
    fire_all(circuit, gates)
    oracle = oracle_of(circuit, step=50e-6, rtol=1e-8)
    oracle.gates = oracle_gates(gates)
    failed_ns = round(12.4 * WINDOW_NS)
    times = [time for time in windows(22) if time != failed_ns]
    before = [time for time in times if time < failed_ns]
    ours = currents_at(circuit, before)
    circuit.advance(failed_ns)
    circuit.short_scr(number)
    phases, ours_later = [], []
    for time in times[len(before) :]:
        circuit.advance(time)
        ours_later.append(circuit.current_a)
        phases.append(circuit.phase_currents())
    oracle.run(failed_ns * 1e-9)
    oracle.shorted = (number,)
    oracle.on = oracle.on - {number}
    oracle.run(times[-1] * 1e-9 + 1e-6)
    theirs = oracle.at(np.array(times) * 1e-9)
    assert np.abs(np.array(ours + ours_later) - theirs).max() < 0.005 * np.abs(theirs).max()
    time = np.concatenate([segment.time for segment in oracle.segments])
    for phase in range(3):
        whole = np.concatenate([segment.phases[phase] for segment in oracle.segments])
        expected = np.interp(np.array(times[len(before) :]) * 1e-9, time, whole)
        worst = np.abs(np.array(phases)[:, phase] - expected).max()
        assert worst < 0.005 * np.abs(np.array(phases)).max()
    # The fault current of two phases: sqrt2 V / (2 X) with its offset up to twice that.
    peak = np.sqrt(2) * 460 / (2 * 2 * pi * 60 * 200e-6)
    assert peak < np.abs(np.array(phases)).max() < 2 * peak
    kinds = {event.kind for event in circuit.take_events()}
    assert {EventKind.SCR_SHORTED, EventKind.LINE_SHORT} <= kinds
