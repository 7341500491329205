"""What breaks: each failure's currents by circuit theory, and its event."""

from math import pi, sin, sqrt

import pytest

from automax_ros.drive.base.errors import GateError, ParameterError, SourceShortError
from automax_ros.drive.base.motor import FixedLoad
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.conduction import EventKind
from automax_ros.drive.circuit.scr import FORWARD, PARTNER, REVERSE
from drive.support import circuit_of, fire_all, plan

PEAK = sqrt(2) * 460
WINDOW_NS = 1e9 / 360


def kinds_of(circuit):
    return [event.kind for event in circuit.take_events()]


def greatest_phase(circuit, until_ns, phase, step_ns=20_000):
    most = 0.0
    for time in range(circuit.now_ns, until_ns, step_ns):
        circuit.advance(time)
        most = max(most, abs(circuit.phase_currents()[phase]))
    return most


def test_anti_parallel_pairs_are_the_manuals():
    assert [PARTNER[number] for number in FORWARD] == [14, 15, 16, 11, 12, 13]


@pytest.mark.parametrize("failed", [1, 2, 5])
def test_a_shorted_scr_shorts_the_line_through_the_next_of_its_rail(failed):
    """Line-to-line fault through 2 Ls, from zero at the angle of firing: (cos(alpha) - cos(wt)) sqrt2 V / 2X."""
    ls, alpha = 300e-6, 60.0
    circuit = circuit_of(ls=ls, rs=0.0, r=5.0, l=50e-3, emf=0.0, trace=True)
    circuit.short_scr(failed)
    following = (failed + 1) % 6 + 1  # the next SCR on the rail
    gates = [gate for gate in plan([alpha] * 6, first_window=6 + following - 1) if gate[2] == following][:1]
    fire_all(circuit, gates)
    phase = {1: 0, 4: 0, 3: 1, 6: 1, 5: 2, 2: 2}[following]
    # The voltage between the phases lasts until 180 degrees after natural commutation; then it drives the current down.
    peak = PEAK / (2 * 2 * pi * 60 * ls) * (1 + 0.5)
    assert greatest_phase(circuit, 60_000_000, phase) == pytest.approx(peak, rel=1e-3)
    events = circuit.take_events()
    assert [event.number for event in events if event.kind is EventKind.SCR_SHORTED] == [failed]
    short = next(event for event in events if event.kind is EventKind.LINE_SHORT)
    assert short.time_s == pytest.approx(gates[0][0] * 1e-9)


def test_an_open_gate_leaves_a_hole():
    """Without SCR 3 its rail misses a third of the cycle; each attempt to fire it is told."""
    circuit = circuit_of(emf=0, l=1e-3)
    circuit.open_gate(3)
    fire_all(circuit, plan([60.0] * 24))
    circuit.advance(round(12 * WINDOW_NS))
    circuit.sample()
    conducted = set()
    for window in range(1200, 1800, 3):
        circuit.advance(round(window * WINDOW_NS / 100))
        conducted |= set(circuit.conducting)
    assert conducted == {1, 2, 4, 5, 6}
    assert circuit.sample().mean_voltage_v < 0.75 * 310.6
    missed = [event for event in circuit.take_events() if event.kind is EventKind.GATE_OPEN]
    assert {event.number for event in missed} == {3}
    assert len(missed) == 2 * 2
    circuit.open_gate(3, is_open=False)
    circuit.advance(round(30 * WINDOW_NS))
    assert EventKind.GATE_OPEN not in kinds_of(circuit)


def test_a_blown_fuse_ends_its_phase_with_an_arc():
    """Phase A's current ends at (arc - driving voltage) / L; from then on only B and C feed."""
    circuit = circuit_of(emf=0, l=3e-3, energy=True)
    fire_all(circuit, plan([40.0] * 30))
    circuit.advance(round(12.9 * WINDOW_NS))
    assert circuit.phase_currents()[0] > 100
    circuit.open_phase(0)
    circuit.advance(round(29 * WINDOW_NS))
    opened = next(event for event in circuit.take_events() if event.kind is EventKind.PHASE_OPEN)
    assert opened.number == 0
    assert 0 < opened.time_s - 12.9 * WINDOW_NS * 1e-9 < 4e-3
    assert circuit.phase_currents()[0] == 0.0
    assert circuit.phase_currents()[1] == pytest.approx(-circuit.phase_currents()[2])
    energy = circuit.energy
    assert energy.arc_j > 10
    assert energy.source_j == pytest.approx(energy.loss_j + energy.stored_j + energy.emf_j, rel=1e-9)


def test_a_phase_without_current_opens_at_once():
    circuit = circuit_of()
    circuit.open_phase(1)
    assert kinds_of(circuit) == [EventKind.PHASE_OPEN]
    fire_all(circuit, plan([30.0] * 12))
    circuit.advance(round(20 * WINDOW_NS))
    assert circuit.phase_currents()[1] == 0.0
    circuit.close_phase(1)
    assert kinds_of(circuit)[-1] is EventKind.PHASE_CLOSED


def test_a_line_that_begins_with_a_phase_missing():
    line = AcLine(460.0, inductance_h=60e-6, missing=[2])
    circuit = Circuit(line, Bridge(), FixedLoad(0.3, 2e-3))
    fire_all(circuit, plan([30.0] * 12))
    most = greatest_phase(circuit, round(20 * WINDOW_NS), 0)
    assert most > 50
    assert circuit.phase_currents()[2] == 0.0


def inverter(turn_off_s, alpha, last_window=16):
    circuit = circuit_of(ls=150e-6, r=0.3, l=2e-3, emf=-620.0, turn_off_s=turn_off_s, trace=True)
    fire_all(circuit, plan([alpha] * (last_window - 5)))
    circuit.advance(round((last_window + 3) * WINDOW_NS))
    return circuit


def test_too_little_turn_off_angle_fails_the_commutation():
    """At alpha 150 an ideal SCR commutates with some 20 degrees to spare; one that needs 1.5 ms does not."""
    assert EventKind.COMMUTATION_FAILURE not in kinds_of(inverter(0.0, 150.0))
    circuit = inverter(1.5e-3, 150.0)
    events = circuit.take_events()
    failed = next(event for event in events if event.kind is EventKind.COMMUTATION_FAILURE)
    out = [event for event in events if event.kind is EventKind.EXTINCTION and event.number == failed.number]
    last_out = max(event.time_s for event in out if event.time_s < failed.time_s)
    assert failed.time_s - last_out < 1.5e-3
    assert EventKind.ARMATURE_SHORT in {event.kind for event in events}
    # Shoot-through: the EMF drives the armature through 0.3 ohm alone, toward 620 / 0.3 A.
    assert circuit.current_a > 1000


def test_fired_too_late_the_incoming_scr_goes_out_again():
    circuit = circuit_of(ls=600e-6, r=0.3, l=4e-3, emf=-640.0, trace=True)
    fire_all(circuit, plan([135.0] * 4 + [172.0] * 6))
    circuit.advance(round(20 * WINDOW_NS))
    events = circuit.take_events()
    failed = next(event for event in events if event.kind is EventKind.COMMUTATION_FAILURE)
    assert any(
        event.kind is EventKind.EXTINCTION and event.number == failed.number and event.time_s == failed.time_s
        for event in events
    )


def test_cross_fire_shorts_the_line_through_both_bridges():
    """SCR 1 of bridge 1 and SCR 16 of bridge 2 join phases A and B at rail P."""
    ls = 200e-6
    circuit = circuit_of(ls=ls, rs=0.0)
    on = round(1e9 / 60 - 1e9 / 720)  # at 30 degrees before A's maximum A is far above B
    circuit.fire(on, on + 50_000, 1, 16)
    circuit.advance(on + 4_000_000)
    angle_on, angle = (2 * pi * 60 * time * 1e-9 + pi / 6 for time in (on, on + 4_000_000))
    # v_ab = sqrt2 V cos(angle): i = sqrt2 V (sin(angle) - sin(angle_on)) / 2X
    expected = PEAK / (2 * 2 * pi * 60 * ls) * (sin(angle) - sin(angle_on))
    assert circuit.phase_currents() == pytest.approx((expected, -expected, 0.0), rel=1e-4)
    assert circuit.current_a == 0.0
    assert circuit.conducting == (1, 16)
    assert set(kinds_of(circuit)) == {EventKind.CROSS_FIRE, EventKind.LINE_SHORT}


def test_both_scrs_of_a_phase_short_the_armature():
    circuit = circuit_of(emf=-100.0, r=0.5, l=1e-3)
    circuit.fire(0, 1000, 1, 4)
    circuit.advance(10_000_000)
    assert circuit.current_a == pytest.approx(200 * (1 - 2.718281828459045**-5), rel=1e-6)
    assert kinds_of(circuit) == [EventKind.ARMATURE_SHORT]
    assert circuit.phase_currents() == (0.0, 0.0, 0.0)
    assert circuit.armature_v == pytest.approx(0.0, abs=1e-9)


def test_the_contactor_opens_with_an_arc_and_closes():
    """The arc takes what the inductance holds: i falls at (arc + R i - driving voltage) / L."""
    circuit = circuit_of(emf=0, l=5e-3)
    fire_all(circuit, plan([50.0] * 30))
    circuit.advance(round(16.5 * WINDOW_NS))
    before = circuit.current_a
    assert before > 500
    circuit.open_contactor()
    circuit.advance(round(29 * WINDOW_NS))
    opened = next(event for event in circuit.take_events() if event.kind is EventKind.ARMATURE_OPEN)
    took = opened.time_s - 16.5 * WINDOW_NS * 1e-9
    longest = 5.12e-3 * before / (1200 - PEAK)
    assert 5e-3 * before / (1200 + 0.31 * before + PEAK) < took < longest
    assert (circuit.current_a, circuit.conducting) == (0.0, ())
    circuit.close_contactor()
    fire_all(circuit, plan([50.0] * 6, first_window=36))
    circuit.advance(round(40 * WINDOW_NS))
    assert circuit.current_a > 50
    assert EventKind.ARMATURE_CLOSED in kinds_of(circuit)


def test_without_the_armature_no_scr_conducts():
    circuit = circuit_of()
    circuit.open_contactor()
    fire_all(circuit, plan([30.0] * 12))
    circuit.advance(round(20 * WINDOW_NS))
    assert circuit.sample().zero_current_s == pytest.approx(20 / 360, rel=1e-6)


def test_a_line_without_impedance_cannot_be_shorted():
    circuit = circuit_of(ls=0.0, rs=0.0)
    circuit.fire(15_000_000, 15_100_000, 1, 16)
    with pytest.raises(SourceShortError, match=r"SCRs 1, 16 short two phases .* give it an inductance"):
        circuit.advance(16_000_000)


def test_an_scr_with_a_drop_loses_it():
    """2 VT less voltage: the current is that of an EMF higher by as much."""
    plain, dropping = circuit_of(emf=202.8), circuit_of(emf=200.0, drop_v=1.4)
    for circuit in (plain, dropping):
        fire_all(circuit, plan([60.0] * 60))
        circuit.advance(round(60 * WINDOW_NS))
    assert dropping.current_a == pytest.approx(plain.current_a, abs=1e-3)


def test_gates_are_refused_where_there_is_nothing_to_fire():
    line = AcLine(460.0)
    s6 = Circuit(line, Bridge(reversing=False), FixedLoad(0.3, 2e-3))
    with pytest.raises(GateError, match="S6 has no bridge 2"):
        s6.fire(0, 1000, 11)
    with pytest.raises(GateError, match="no SCR 7"):
        s6.fire(0, 1000, 7)
    with pytest.raises(GateError, match="empty"):
        s6.fire(1000, 1000, 1)
    s6.advance(5000)
    with pytest.raises(GateError, match="in the past"):
        s6.fire(4999, 6000, 1)
    with pytest.raises(ParameterError, match="cannot go back"):
        s6.advance(4999)


def test_a_short_pulse_before_forward_voltage_is_lost():
    """Section 12.3: a pair latches only where the line is above the EMF; a train of pulses fires when it is."""
    on = plan([0.0])[0][0]
    for width, starts in ((50_000, False), (3_000_000, True)):
        circuit = circuit_of(emf=640.0)
        circuit.fire(on, on + width, 1, 6)
        circuit.advance(on + 3_000_000)
        assert (circuit.sample().zero_current_s < (on + 3_000_000) * 1e-9) is starts


def test_cancelled_gates_do_not_fire():
    circuit = circuit_of()
    fire_all(circuit, plan([30.0] * 12))
    circuit.bridge.cancel(circuit.now_ns)
    circuit.advance(round(20 * WINDOW_NS))
    assert circuit.sample().mean_current_a == 0.0


def test_numbers_of_both_bridges():
    assert set(FORWARD) & set(REVERSE) == set()


def test_events_are_kept_within_bounds():
    circuit = circuit_of(trace=True)
    fire_all(circuit, plan([60.0] * 3000))
    circuit.advance(round(3006 * WINDOW_NS))
    assert len(circuit.take_events()) == 10_000
    assert circuit.events_lost > 1000
    assert circuit.take_events() == []
