"""Phase firing: each SCR at its angle, once, on both bridges and rotations, at 48 to 62 Hz, however DELTA moves."""

from itertools import pairwise
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.circuit.ac_line import AcLine, Rotation
from automax_ros.drive.circuit.firing import natural_angle
from automax_ros.drive.current_loop.firing import Firing
from automax_ros.drive.current_loop.signals import gate_numbers
from drive.support import repeatable


def planned(deltas_ns, *, period_ns=16_666_667, bridge=1, reverse=False, position=0):
    """The pulses of scans, with the time since the first interrupt."""
    firing, pulses = Firing(), []
    firing.begin()
    sixth = period_ns // 6
    for index, delta_ns in enumerate(deltas_ns):
        made = firing.pulses((position + index) % 6, period_ns, sixth, delta_ns, bridge, reverse)
        assert all(0 <= pulse.after_ns < sixth and pulse.length_ns > 0 for pulse in made)
        pulses += [(index * sixth + pulse.after_ns, pulse.length_ns, pulse.gates) for pulse in made]
    return pulses


@pytest.mark.parametrize("hertz", [48, 50, 60, 62])
@pytest.mark.parametrize("bridge", [1, 2])
@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("alpha", [0.0, 35.0, 60.0, 90.0, 119.9, 153.0, 179.0])
def test_each_scr_is_fired_at_alpha_after_its_natural_commutation(hertz, bridge, reverse, alpha):
    period_ns = round(1e9 / hertz)
    line = AcLine(460.0, hertz, rotation=Rotation.CBA if reverse else Rotation.ABC)
    deltas = [round((180 - alpha) / 360 * period_ns)] * 30
    pulses = planned(deltas, period_ns=period_ns, bridge=bridge, reverse=reverse)[6:]
    assert len(pulses) >= 20
    fired = []
    for at_ns, length_ns, gates in pulses:
        assert length_ns == period_ns // 6
        # Position 0 is T1's maximum, where the line's angle is 0.
        angle = line.angle(at_ns)
        late = {n: ((angle - natural_angle(n, line)) * 180 / pi + 1) % 360 - 1 for n in gate_numbers(gates)}
        main, partner = sorted(late, key=late.get)
        assert late[main] == pytest.approx(alpha, abs=0.02)
        assert (late[partner] - late[main]) % 360 == pytest.approx(60, abs=0.02)
        assert main // 10 == partner // 10 == bridge - 1
        fired.append(main)
    assert all(fired[i] == fired[i + 6] and len(set(fired[i : i + 6])) == 6 for i in range(len(fired) - 6))


def test_nothing_is_fired_at_delta_0_before_alpha_180():
    pulses = planned([0] * 12)
    assert [at_ns % 2_777_777 for at_ns, _, _ in pulses] == [0] * len(pulses)


@repeatable
@given(st.lists(st.integers(0, 8_333_333), min_size=10, max_size=60), st.integers(0, 5), st.booleans())
def test_no_scr_is_fired_twice(deltas, position, reverse):
    pulses = planned(deltas, reverse=reverse, position=position)
    times = [at_ns for at_ns, _, _ in pulses]
    assert times == sorted(set(times))
    # Where one pulse follows another within two sixths, its gates are others.
    for (one_ns, _, one), (two_ns, _, two) in pairwise(pulses):
        assert one != two or two_ns - one_ns > 4 * 2_777_777


def test_a_jump_fires_at_once_what_has_become_late():
    sixth = 2_777_777
    alpha_150, alpha_90 = 1_388_889, 4_166_667
    before = planned([alpha_150] * 12)
    after = planned([alpha_150] * 12 + [alpha_90])
    new = after[len(before) :]
    # One SCR has become due half a sixth before this interrupt: at once; the next in the middle of the scan.
    assert [at_ns - 12 * sixth for at_ns, _, _ in new] == [0, pytest.approx(1_388_886, abs=2)]
    assert [length_ns for _, length_ns, _ in new] == [pytest.approx(1_388_887, abs=2), sixth]
    assert new[-1][0] - before[-1][0] < 2 * sixth


def test_a_drop_of_delta_delays_and_repeats_nothing():
    sixth = 2_777_777
    pulses = planned([4_166_667] * 12 + [1_250_000] * 6)
    gaps = [two - one for (one, _, _), (two, _, _) in pairwise(pulses[2:])]
    assert max(gaps) == pytest.approx(sixth + 4_166_667 - 1_250_000, abs=2)
    assert all(gap == pytest.approx(sixth, abs=2) for gap in gaps if gap < max(gaps))
