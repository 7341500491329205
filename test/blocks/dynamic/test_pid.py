"""PID (50), against a plain model of its pseudo-code, and in closed loops with a first-order plant."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import int16, repeatable, run

LIMITED = 7004
LARGEST = 9.2233717e18
PERIOD = 11_000_000


@dataclasses.dataclass
class Model:
    """Section 50 word for word, with what the manual leaves open settled as its docstrings say."""

    loop_time: float
    isa: bool = False
    action: bool = False
    derivative: bool = False
    integrator: float = 0.0
    last_error: float = 0.0
    last_d_error: float = 0.0
    output: int = 0
    out_of_limits: frozenset = frozenset()
    log: int = 0

    def gains(self, kp, ki, kd):
        """KP, KI and KD below 0 count as 0 and are logged on the scan on which they leave."""
        named = {"kp": kp, "ki": ki, "kd": kd}
        out = frozenset(name for name, value in named.items() if value < 0)
        self.log = LIMITED if out - self.out_of_limits else 0
        self.out_of_limits = out
        kp, ki, kd = (max(value, 0.0) for value in named.values())
        return (kp, ki * kp, kd * kp) if self.isa else (kp, ki, kd)

    def scan(
        self,
        *,
        input,
        feedback,
        kp,
        ki,
        kd=0.0,
        manual=False,
        initial_value=0,
        feed_forward=0,
        dead_band=0,
        max_change=32767,
        limit_plus=32767,
        limit_minus=-32767,
        hold_plus=False,
        hold_minus=False,
    ):
        kp, ki, kd = self.gains(kp, ki, kd)
        if manual:
            error = 0
            self.integrator = float(initial_value)
            total = self.integrator
            self.last_error = self.last_d_error = 0.0
        else:
            error = feedback - input if self.action else input - feedback
            p_term = error * kp
            i_term = (error + self.last_error) * ki * self.loop_time / 2
            if abs(error) < max(dead_band, 0):
                i_term = 0.0
            if (i_term > 0 and hold_plus) or (i_term < 0 and hold_minus):
                i_term = 0.0
            self.integrator = limited(self.integrator + i_term, limit_minus, limit_plus)
            d_error = (feedback if self.action else -feedback) if self.derivative else error
            d_term = (d_error - self.last_d_error) * kd / self.loop_time
            self.last_error, self.last_d_error = error, d_error
            total = self.integrator + p_term + d_term
        total += feed_forward
        self.before_rounding = total
        most = max(max_change, 0)
        change = min(max(nearest(total) - self.output, -most), most)
        self.output = int(limited(self.output + change, limit_minus, limit_plus))
        return {
            "saturated_plus": self.output >= limit_plus,
            "saturated_minus": self.output <= limit_minus,
            "error": int(limited(error, -32768, 32767)),
            "output": self.output,
        }


def limited(value, low, high):
    """LIMIT_PLUS wins where it lies below LIMIT_MINUS."""
    value = max(value, low)
    return min(value, high)


def nearest(value):
    """The nearest count, halves away from zero."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def half_way(value):
    """So close to a half count that the order of the sums decides."""
    return abs(abs(value) % 1.0 - 0.5) < 1e-9 * max(1.0, abs(value))


small = st.integers(-300, 300)
counts = small | int16
gains = st.sampled_from([0.0, 0.25, 1.0, 2.0, -1.0, -0.001]) | st.floats(0.0, 20.0) | st.floats(0.0, 1e6)
magnitudes = st.integers(0, 400) | st.integers(-32768, 32767)
OPTIONAL = {
    "kd": gains,
    "manual": st.booleans(),
    "initial_value": counts,
    "feed_forward": counts,
    "dead_band": magnitudes,
    "max_change": magnitudes,
    "limit_plus": counts,
    "limit_minus": counts,
    "hold_plus": st.booleans(),
    "hold_minus": st.booleans(),
}


@st.composite
def programs(draw):
    """Literals, and the variables that each of some scans gives; each variable stays for a few scans."""
    literals = {
        "loop_time": draw(st.sampled_from([0.01, 0.0125, 0.5]) | st.floats(0.01, 10.0)),
        **draw(st.fixed_dictionaries({}, optional=dict.fromkeys(("isa", "action", "derivative"), st.booleans()))),
    }
    wanted = draw(st.sets(st.sampled_from(sorted(OPTIONAL))))
    strategies = {"kp": gains, "ki": gains, "input": counts, "feedback": counts}
    strategies.update({name: OPTIONAL[name] for name in sorted(wanted)})
    row = {name: draw(strategy) for name, strategy in strategies.items()}
    rows = []
    for _ in range(draw(st.integers(1, 14))):
        for name in draw(st.sets(st.sampled_from(sorted(strategies)), max_size=4)):
            row[name] = draw(strategies[name])
        rows += [dict(row)] * draw(st.integers(1, 4))
    return literals, rows


@settings(repeatable, max_examples=400)
@given(programs())
def test_scan_by_scan_against_the_model(program):
    literals, rows = program
    block, model = run("PID", PERIOD, **literals), Model(**literals)
    for row in rows:
        expected = model.scan(**row)
        shown = block.scan(**row)
        if shown != expected and half_way(model.before_rounding):
            assert abs(shown["output"] - expected["output"]) <= 1
            return
        assert shown == expected
        assert block.error == model.log


def pid(**literals):
    return run("PID", PERIOD, **{"loop_time": 0.01, **literals})


def test_before_its_first_scan_all_is_zero():
    """P, I of (error + 0), D of (error - 0), and a change from 0."""
    shown = pid(kp=1.0, ki=2.0, kd=0.5).scan(input=100, feedback=0)
    assert shown["output"] == 100 + 100 * 2.0 * 0.01 / 2 + 100 * 0.5 / 0.01
    assert pid(kp=1.0, ki=0.0).scan(input=100, feedback=0, max_change=30)["output"] == 30


def test_small_integral_terms_are_not_lost():
    """An error of 1 with KI = 1 at 10 ms is 0.01 count per scan: 1 count in 100 scans, 1000 counts in 100,000."""
    block = pid(kp=0.0, ki=1.0)
    outputs = [block.scan(input=1, feedback=0)["output"] for _ in range(10_000)]
    assert outputs[48:52] == [0, 0, 1, 1]
    assert outputs[-1] == 100
    assert outputs == [int((n - 0.5) * 0.01 + 0.5) for n in range(1, 10_001)]


def test_manual_shows_initial_value_and_feed_forward():
    block = pid(kp=3.0, ki=2.0, kd=1.0)
    for _ in range(20):
        block.scan(input=500, feedback=0)
    shown = block.scan(input=500, feedback=100, manual=True, initial_value=1200, feed_forward=34)
    assert shown == {"saturated_plus": False, "saturated_minus": False, "error": 0, "output": 1234}


def test_manual_keeps_to_the_change_and_the_limits():
    block = pid(kp=3.0, ki=2.0)
    shown = [
        block.scan(input=0, feedback=0, manual=True, initial_value=1000, max_change=300, limit_plus=700)
        for _ in range(4)
    ]
    assert [row["output"] for row in shown] == [300, 600, 700, 700]
    assert [row["saturated_plus"] for row in shown] == [False, False, True, True]


@pytest.mark.parametrize("isa", [False, True])
def test_from_manual_to_automatic_without_a_bump_when_the_error_is_0(isa):
    block = pid(isa=isa, kp=3.0, ki=2.0, kd=1.0)
    for _ in range(20):
        block.scan(input=900, feedback=-20)
    for _ in range(3):
        block.scan(input=900, feedback=900, manual=True, initial_value=4321)
    for _ in range(10):
        assert block.scan(input=900, feedback=900, manual=False, initial_value=0)["output"] == 4321


def test_with_derivative_of_feedback_automatic_begins_with_a_kick():
    """MANUAL resets the internal variables to zero, so FEEDBACK comes all at once: -900 x 0.1 / 0.01, in one scan."""
    block = pid(derivative=True, kp=3.0, ki=2.0, kd=0.1)
    for _ in range(20):
        block.scan(input=900, feedback=880)
    for _ in range(3):
        shown = block.scan(input=900, feedback=900, manual=True, initial_value=4321)
        assert shown["output"] == 4321
    kicked = block.scan(input=900, feedback=900)
    assert (kicked["error"], kicked["output"]) == (0, 4321 - 9000)
    assert [block.scan(input=900, feedback=900)["output"] for _ in range(5)] == [4321] * 5


def test_after_manual_the_histories_start_at_zero():
    block = pid(kp=1.0, ki=2.0, kd=0.1)
    for _ in range(5):
        block.scan(input=500, feedback=0)
    block.scan(input=500, feedback=0, manual=True, initial_value=100)
    assert block.scan(input=500, feedback=300)["output"] == 100 + 200 + 200 * 2.0 * 0.005 + 200 * 0.1 / 0.01


@pytest.mark.parametrize("action", [False, True])
@pytest.mark.parametrize("derivative", [False, True])
def test_signs_of_error_and_derivative(action, derivative):
    sign = -1 if action else 1
    block = pid(action=action, derivative=derivative, kp=0.0, ki=0.0, kd=0.1)
    block.scan(input=0, feedback=0)
    shown = block.scan(input=70, feedback=30)
    assert shown["error"] == sign * 40
    assert shown["output"] == sign * 10 * (-30 if derivative else 40)


def test_isa_multiplies_ki_and_kd_by_kp():
    isa, plain = pid(isa=True, kp=4.0, ki=2.0, kd=0.01), pid(kp=4.0, ki=8.0, kd=0.04)
    for value in (100, 300, -50, 0, 7, 7, 7):
        assert isa.scan(input=value, feedback=20) == plain.scan(input=value, feedback=20)


def test_the_dead_band_compares_the_error():
    block = pid(kp=0.0, ki=100.0)
    assert block.scan(input=9, feedback=0, dead_band=10)["output"] == 0
    assert block.scan(input=10, feedback=0, dead_band=10)["output"] == 10
    assert block.scan(input=-10, feedback=0, dead_band=11)["output"] == 10
    assert block.scan(input=-10, feedback=0, dead_band=10)["output"] == -1


def test_holds_stop_the_integral_term_of_one_sign():
    block = pid(kp=0.0, ki=100.0)
    shown = [block.scan(input=value, feedback=0, hold_plus=True)["output"] for value in (100, 100, -20, -20)]
    assert shown == [0, 0, 0, -20]
    shown = [block.scan(input=value, feedback=0, hold_minus=True)["output"] for value in (-20, 100, 100)]
    assert shown == [-20, 20, 120]


def test_the_integrator_does_not_wind_up():
    block = pid(kp=0.0, ki=100.0)
    for _ in range(50):
        block.scan(input=1000, feedback=0, limit_plus=500, limit_minus=-500)
    assert block.outputs["saturated_plus"]
    block.scan(input=-100, feedback=0, limit_plus=500, limit_minus=-500)
    assert block.scan(input=-100, feedback=0, limit_plus=500, limit_minus=-500)["output"] == 400


def test_limit_plus_wins_where_it_lies_below_limit_minus():
    shown = pid(kp=1.0, ki=1.0).scan(input=0, feedback=0, limit_plus=-100, limit_minus=100)
    assert shown == {"saturated_plus": True, "saturated_minus": True, "error": 0, "output": -100}


def test_default_limits_are_those_printed():
    block = pid(kp=100.0, ki=0.0)
    assert block.scan(input=-32768, feedback=0)["output"] == -32767
    assert block.outputs["saturated_minus"]
    assert [block.scan(input=32767, feedback=0)["output"] for _ in range(2)] == [0, 32767]


def test_default_change_is_32767_a_scan():
    block = pid(kp=1.0, ki=0.0)
    block.scan(input=-20000, feedback=0)
    assert block.scan(input=20000, feedback=0)["output"] == 12767


def test_error_shows_16_bits_but_counts_with_all():
    block = pid(kp=0.25, ki=0.0)
    assert block.scan(input=32767, feedback=-32768)["error"] == 32767
    assert block.outputs["output"] == nearest(65535 * 0.25)
    assert block.scan(input=-32768, feedback=32767)["error"] == -32768


def test_output_rounds_halves_away_from_zero():
    block = pid(kp=0.5, ki=0.0)
    assert [block.scan(input=value, feedback=0)["output"] for value in (1, 3, -1, -3)] == [1, 2, -1, -2]


def test_a_negative_dead_band_and_change_count_as_zero():
    block = pid(kp=0.0, ki=100.0)
    assert block.scan(input=10, feedback=0, dead_band=-5)["output"] == 5
    assert block.scan(input=10, feedback=0, dead_band=-5, max_change=-3)["output"] == 5
    assert block.error == 0


@pytest.mark.parametrize("gain", ["kp", "ki", "kd"])
def test_a_negative_gain_counts_as_zero_and_is_logged_once(gain):
    block, zero = pid(), pid()
    good = {"kp": 1.0, "ki": 3.0, "kd": 0.2}
    errors = []
    for value in (2.0, -1.0, -1.0, -2.0, 2.0, -1e-6, 0.0, -1.0):
        zero_value = max(value, 0.0)
        shown = block.scan(input=90, feedback=30, **{**good, gain: value})
        assert shown == zero.scan(input=90, feedback=30, **{**good, gain: zero_value})
        errors.append(block.error)
        assert zero.error == 0
    assert errors == [0, LIMITED, 0, 0, 0, LIMITED, 0, LIMITED]


def test_another_gain_that_turns_negative_is_logged_too():
    block = pid()
    errors = []
    for kp, ki in ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, -1.0)):
        block.scan(input=0, feedback=0, kp=kp, ki=ki)
        errors.append(block.error)
    assert errors == [0, LIMITED, LIMITED, 0, LIMITED]


@pytest.mark.parametrize("literals", [{"kp": LARGEST}, {"ki": LARGEST}, {"kd": LARGEST}, {"loop_time": LARGEST}])
@pytest.mark.parametrize("isa", [False, True])
def test_the_largest_values_only_saturate(literals, isa):
    block = run("PID", PERIOD, **{"loop_time": 0.01, "kp": 1.0, "ki": 1.0, "kd": 1.0, "isa": isa, **literals})
    for _ in range(3):
        assert block.scan(input=32767, feedback=-32768)["output"] == 32767
    assert block.outputs["saturated_plus"]
    for _ in range(3):
        block.scan(input=-32768, feedback=32767)
    assert block.outputs["output"] == -32767


def closed_loop(block, set_point, seconds, *, gain, tau, period_s):
    """Output of a plant gain / (1 + tau s), sampled in whole counts, the block's output held over each scan."""
    pole = math.exp(-period_s / tau)
    plant, shown = 0.0, []
    for _ in range(round(seconds / period_s)):
        feedback = nearest(plant)
        shown.append(plant)
        u = block.scan(input=set_point, feedback=feedback)["output"]
        plant = pole * plant + (1 - pole) * gain * u
    return np.array(shown)


def discrete_loop(kp, ki, set_point, scans, *, gain, tau, period_s):
    """The same loop without rounding, by scipy: PI by the trapezoid rule, the plant after a zero-order hold."""
    pole = math.exp(-period_s / tau)
    half = ki * period_s / 2
    controller = np.array([kp + half, half - kp]), np.array([1.0, -1.0])
    plant = np.array([0.0, (1 - pole) * gain]), np.array([1.0, -pole])
    forward, below = np.convolve(controller[0], plant[0]), np.convolve(controller[1], plant[1])
    return set_point * signal.lfilter(forward, forward + below, np.ones(scans))


@pytest.mark.parametrize(("kp", "ki"), [(0.0, 1.0), (0.0, 4.0), (1.0, 4.0), (4.0, 2.0), (3.0, 16.0)])
@pytest.mark.parametrize("isa", [False, True])
def test_closed_loop_against_scipy(kp, ki, isa):
    """Feedback and output are whole counts: the plant stays within some counts of the loop without rounding."""
    if isa and kp == 0.0:
        return
    block = run("PID", PERIOD, loop_time=0.011, kp=kp, ki=ki / kp if isa else ki, isa=isa)
    shown = closed_loop(block, 2000, 30.0, gain=1.0, tau=1.0, period_s=0.011)
    expected = discrete_loop(kp, ki, 2000, len(shown), gain=1.0, tau=1.0, period_s=0.011)
    assert np.max(np.abs(shown - expected)) < 4
    assert np.max(np.abs(shown[-100:] - 2000)) <= 2


@pytest.mark.parametrize(("ki", "gain", "tau"), [(1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (1.0, 0.5, 4.0), (5.0, 1.0, 0.5)])
def test_integral_control_overshoots_as_the_second_order_formula_says(ki, gain, tau):
    """KI only: wn**2 = K KI / tau, zeta = 1 / (2 sqrt(K KI tau)); overshoot exp(-pi zeta / sqrt(1 - zeta**2))."""
    wn = math.sqrt(gain * ki / tau)
    zeta = 1 / (2 * math.sqrt(gain * ki * tau))
    block = run("PID", PERIOD, loop_time=0.011, kp=0.0, ki=ki)
    shown = closed_loop(block, 4000, 10 / (zeta * wn), gain=gain, tau=tau, period_s=0.011) / 4000
    root = math.sqrt(1 - zeta**2)
    assert np.max(shown) - 1 == pytest.approx(math.exp(-math.pi * zeta / root), abs=0.015)
    assert np.argmax(shown) * 0.011 == pytest.approx(math.pi / (wn * root), rel=0.03)
    envelope = math.exp(-4) / root + 0.015
    assert np.max(np.abs(shown[int(4 / (zeta * wn) / 0.011) :] - 1)) < envelope


def test_cancelling_the_plants_pole_makes_the_loop_first_order():
    """KP = KI tau: the loop is 1 / (1 + s tau / (K KP))."""
    block = run("PID", PERIOD, loop_time=0.011, kp=4.0, ki=2.0)
    shown = closed_loop(block, 4000, 3.0, gain=1.0, tau=2.0, period_s=0.011)
    t = np.arange(len(shown)) * 0.011
    assert np.max(np.abs(shown - 4000 * (1 - np.exp(-t / 0.5)))) < 40
    assert np.max(shown) < 4000 + 3


@pytest.mark.parametrize(
    "literals", [{"kp": -0.1}, {"ki": -0.1}, {"kd": -0.1}, {"loop_time": 0.0099}, {"dead_band": -1}, {"max_change": 0}]
)
def test_a_literal_beyond_its_limit_is_refused(literals):
    with pytest.raises(InstanceError):
        run("PID", PERIOD, **{"loop_time": 0.01, "kp": 1.0, "ki": 1.0, "kd": 1.0, **literals})
