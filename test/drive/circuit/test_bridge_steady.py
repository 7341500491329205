"""The steady state of the bridge: against an independent integration over a grid, and against textbook formulas."""

from math import acos, atan, cos, degrees, exp, pi, radians, sin, sqrt

import numpy as np
import pytest

from automax_ros.drive.base.errors import ParameterError, SteadyStateError
from automax_ros.drive.circuit.steady import BridgeCase, steady_state, waveforms
from drive.switched import Switched

SIXTH_S = 1 / 360


def one_window(case, current):
    """60 degrees from the firing of SCR 1 with a current in SCRs 5 and 6."""
    begin = (4 * pi - pi / 3 + radians(case.alpha_deg)) / (2 * pi * 60)
    # The integration needs some inductance; 0.1 uH commutates 100 A in 40 ns.
    circuit = Switched(
        case.v_ll_v, case.source_h or 1e-7, case.source_ohm, case.resistance_ohm, case.inductance_h, case.emf_v
    )
    circuit.time = begin
    circuit.gates = [(begin, begin + SIXTH_S, 1), (begin, begin + SIXTH_S, 6)]
    if current > 0:
        circuit.on, circuit.currents = frozenset({5, 6}), {"a": 0.0, "b": -current, "c": current, "d": current}
    circuit.run(begin + SIXTH_S)
    return circuit


def integrated(case):
    """The integration's own steady state: the secant method on the current at firing."""
    x0, circuit = 0.0, one_window(case, 0.0)
    f0 = circuit.currents["d"]
    x1 = f0
    for _ in range(20):
        circuit = one_window(case, x1)
        f1 = circuit.currents["d"]
        if abs(f1 - x1) < 1e-6 * max(1.0, x1):
            break
        slope = ((f1 - x1) - (f0 - x0)) / (x1 - x0)
        x0, f0, x1 = x1, f1, max(0.0, x1 - (f1 - x1) / slope)
    currents = np.concatenate([segment.current for segment in circuit.segments])
    spans = [(segment.on, segment.time[-1] - segment.time[0]) for segment in circuit.segments]
    return {
        "mean": circuit.charge / SIXTH_S,
        "rms": sqrt(circuit.square / SIXTH_S),
        "ripple": currents.max() - currents.min(),
        "zero_us": 1e6 * sum(span for on, span in spans if not on),
        "overlap_deg": 21600 * sum(span for on, span in spans if len(on) > 2),
    }


def agrees(case):
    ours, theirs = steady_state(case), integrated(case)
    scale = max(abs(theirs["mean"]), 0.1)
    assert abs(ours.mean_current_a - theirs["mean"]) < 0.002 * scale, case
    assert abs(ours.rms_current_a - theirs["rms"]) < 0.002 * max(theirs["rms"], 0.1), case
    assert abs(ours.ripple_pp_a - theirs["ripple"]) < 0.005 * max(theirs["ripple"], 0.1), case
    assert abs(ours.zero_current_us - theirs["zero_us"]) < 5, case
    assert abs(ours.overlap_deg - theirs["overlap_deg"]) < 0.1, case
    # The mean voltage follows from the mean current: no voltage stays over L.
    assert ours.mean_voltage_v == pytest.approx(case.emf_v + case.resistance_ohm * ours.mean_current_a, abs=0.01)
    return ours


INDUCTANCES = (0.5e-3, 2e-3, 8e-3)
SOURCES = (0.0, 60e-6, 300e-6)


def grid(alphas, inductances=INDUCTANCES, sources=SOURCES):
    """Cases from near extinction to strong inversion: the EMF below the ideal voltage by what drives a current."""
    for alpha in alphas:
        ideal = 1.35 * 460 * cos(radians(alpha))
        for inductance in inductances:
            for source in sources:
                for below in (150.0, 40.0, 8.0, -15.0):
                    yield BridgeCase(460.0, 60.0, source, 0.005, 0.3, inductance, ideal - below, float(alpha))


QUICK = list(grid((30, 60, 100, 140)))[::7]


@pytest.mark.parametrize("case", QUICK)
def test_steady_state_is_what_integration_gives(case):
    agrees(case)


def test_the_quick_cases_show_both_modes():
    modes = {steady_state(case).continuous for case in QUICK}
    assert modes == {True, False}


@pytest.mark.soak
def test_steady_state_is_what_integration_gives_over_the_whole_grid():
    states = [agrees(case) for case in grid(range(20, 141, 20))]
    assert sum(state.continuous for state in states) > 50
    assert sum(not state.continuous for state in states) > 50


def test_current_of_one_window_by_the_textbook_formula():
    """Section 12.3's closed form without source inductance, E 400 V and alpha 70 degrees: extinction by bisection."""
    v, w, r, l, e, alpha = 460.0, 2 * pi * 60, 0.09, 2.5e-3, 400.0, radians(70)  # noqa: E741
    z, phi = sqrt(r**2 + (w * l) ** 2), atan(w * l / r)
    psi = pi / 3 + alpha - phi

    def current(theta):
        fall = exp(-theta / (w * l / r))
        return sqrt(2) * v / z * (sin(theta + psi) - sin(psi) * fall) - e / r * (1 - fall)

    low, high = 0.05, pi / 3
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if current(middle) > 0 else (low, middle)
    state = steady_state(BridgeCase(v, 60.0, 0.0, 0.0, r, l, e, 70.0))
    assert state.zero_current_us == pytest.approx((pi / 3 - low) / w * 1e6, abs=0.01)
    terminal = 3 / pi * sqrt(2) * v * (cos(pi / 3 + alpha) - cos(pi / 3 + alpha + low)) + e * (1 - 3 * low / pi)
    assert state.mean_voltage_v == pytest.approx(terminal, rel=1e-6)
    assert state.mean_current_a == pytest.approx((terminal - e) / r, rel=1e-4)


def test_boundary_of_continuous_conduction():
    """Section 12.6: 460 V, 0.09 ohm, 2.5 mH, alpha 70 degrees: 57.692 A."""
    v, w, r, l, alpha = 460.0, 2 * pi * 60, 0.09, 2.5e-3, radians(70)  # noqa: E741
    phi = atan(w * l / r)
    psi, e3 = pi / 3 + alpha - phi, exp(-pi / 3 / (w * l / r))
    boundary = sqrt(2) * v * cos(phi) * (sin(pi / 3 + psi) - sin(psi) * e3) / (1 - e3)
    just_below = steady_state(BridgeCase(v, 60.0, 0.0, 0.0, r, l, boundary - 0.05, 70.0))
    just_above = steady_state(BridgeCase(v, 60.0, 0.0, 0.0, r, l, boundary + 0.05, 70.0))
    assert (just_below.continuous, just_above.continuous) == (True, False)
    assert just_below.mean_current_a == pytest.approx(57.692, rel=0.02)


@pytest.mark.parametrize("alpha", [20, 60, 100, 130])
def test_textbook_overlap_holds_for_a_smooth_current(alpha):
    """With a large choke the current is constant during overlap, which is all that the formulas neglect."""
    ideal = 3 * sqrt(2) / pi * 460 * cos(radians(alpha))
    case = BridgeCase(460.0, 60.0, 200e-6, 0.0, 0.2, 0.2, ideal - 60, float(alpha))
    state = steady_state(case)
    reactance = 2 * pi * 60 * 200e-6
    current = 60 / (0.2 + 3 * reactance / pi)
    assert state.mean_current_a == pytest.approx(current, rel=1e-3)
    end = acos(cos(radians(alpha)) - 2 * reactance * current / (sqrt(2) * 460))
    assert state.overlap_deg == pytest.approx(degrees(end) - alpha, rel=5e-3)
    assert state.mean_voltage_v == pytest.approx(ideal - 3 * reactance / pi * current, rel=1e-3)


def test_textbook_mean_current_errs_with_ripple():
    """With ripple the current at firing is far below the mean, so the formula takes overlap for longer than it is.

    The voltage lost in overlap is 6 f Ls times the current at its end; the formula takes the mean current.
    """
    case = BridgeCase(460.0, 60.0, 300e-6, 0.0, 0.3, 1e-3, 170.0, 70.0)
    state = steady_state(case)
    ideal = 3 * sqrt(2) / pi * 460 * cos(radians(70))
    textbook = (ideal - 170) / (0.3 + 3 * 2 * pi * 60 * 300e-6 / pi)
    assert state.continuous
    assert state.ripple_pp_a > state.mean_current_a
    assert state.mean_current_a > 1.05 * textbook
    moments = list(waveforms(case, state, cycles=1, step_ns=1000))
    after = next(moment for moment in moments[5:] if len(moment.conducting) == 2)
    assert state.mean_voltage_v == pytest.approx(ideal - 6 * 60 * 300e-6 * after.current_a, abs=0.3)


@pytest.mark.parametrize("alpha", [35.0, 80.0, 125.0])
def test_bridge_2_mirrors_bridge_1(alpha):
    emf = 1.35 * 460 * cos(radians(alpha)) - 30
    forward = steady_state(BridgeCase(460.0, 60.0, 60e-6, 0.005, 0.3, 2e-3, emf, alpha))
    reverse = steady_state(BridgeCase(460.0, 60.0, 60e-6, 0.005, 0.3, 2e-3, -emf, alpha, reverse=True))
    assert reverse.mean_current_a == pytest.approx(-forward.mean_current_a, rel=1e-9)
    assert reverse.mean_voltage_v == pytest.approx(-forward.mean_voltage_v, rel=1e-9)
    assert reverse.overlap_deg == pytest.approx(forward.overlap_deg, rel=1e-6)
    assert reverse.ripple_pp_a == pytest.approx(forward.ripple_pp_a, rel=1e-9)


def test_no_current_where_none_can_flow():
    for alpha, emf in ((60.0, 651.0), (100.0, 240.0), (180.0, 0.0), (120.0, 1.0)):
        state = steady_state(BridgeCase(emf_v=emf, alpha_deg=alpha))
        assert (state.mean_current_a, state.rms_current_a, state.ripple_pp_a, state.continuous) == (0, 0, 0, False)
        assert state.mean_voltage_v == pytest.approx(emf)
        assert state.zero_current_us == pytest.approx(1e6 / 360)


def test_long_gates_start_conduction_after_the_firing():
    """At alpha 10 and an EMF of 640 V the pair gets forward voltage only where the line passes 640 V on its way up."""
    case = BridgeCase(460.0, 60.0, 0.0, 0.0, 0.3, 2e-3, 640.0, 10.0)
    state = steady_state(case)
    first = next(moment for moment in waveforms(case, state, step_ns=1000) if moment.conducting)
    # v = sqrt2 V sin(60 + alpha + w t) = 640
    expected = (180 / pi * np.arcsin(640 / (sqrt(2) * 460)) - 70) / 21600
    assert first.time_s == pytest.approx(expected, abs=2e-6)
    assert state.mean_current_a > 0


def test_overlap_beyond_60_degrees_settles_by_simulation():
    """With a weak line three or four SCRs conduct all the time: the DC short of the textbooks' third mode."""
    state = steady_state(BridgeCase(460.0, 60.0, 2e-3, 0.005, 0.05, 2e-3, 0.0, 0.0))
    assert state.overlap_deg == pytest.approx(60.0, abs=1e-6)
    assert 0 < state.mean_current_a < sqrt(2) * 460 / sqrt(3) / (2 * pi * 60 * 2e-3)


def test_commutation_that_fails_is_told():
    with pytest.raises(SteadyStateError, match="no steady state at alpha 170 degrees: SCRs fail to commutate"):
        steady_state(BridgeCase(alpha_deg=170.0, emf_v=-640.0, source_h=60e-6))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"v_ll_v": 0.0}, "line-to-line voltage in V is 0, it must be 1e-09 to 1e\\+06"),
        ({"frequency_hz": 47.0}, "frequency in Hz is 47, it must be 48 to 62"),
        ({"source_h": -1e-6}, "source inductance in H is -1e-06"),
        ({"inductance_h": 0.0}, "armature inductance in H is 0, it must be 1e-09 to 1e\\+06"),
        ({"resistance_ohm": float("nan")}, "armature resistance in ohm is nan"),
        ({"alpha_deg": 181.0}, "alpha in degrees is 181, it must be 0 to 180"),
    ],
)
def test_impossible_parameters_are_told(change, told):
    with pytest.raises(ParameterError, match=told):
        steady_state(BridgeCase(**change))
