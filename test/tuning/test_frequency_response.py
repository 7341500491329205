"""Gain and phase of the dynamic blocks (41 to 50), swept with sines in whole counts.

A sine of 4095 counts (less where the block amplifies) runs until the transient is gone, then over whole periods;
input and output are correlated with it. The design is the Laplace function under s = C (z - 1)/(z + 1), and equals the
Laplace function itself at the mapping frequency. The output is rounded to whole counts: below ``MEASURABLE`` counts
that is no longer small against 0.1 dB (1.2 %) and 1 degree (1.7 %), and only the amplitude is bounded.
"""

import cmath
import math
from dataclasses import dataclass

import numpy as np
import pytest
from blocks.support import mapping_constant, run

WINDOW = 1999
"""Scans of a measurement: a prime, so that no two scans see the same phase and roundings average out."""
MEASURABLE = 60
NORMAL = 4095
AROUND = (0.1, 0.5, 0.8, 1.0, 1.25, 2.0, 10.0)
"""Measured frequencies over a corner frequency."""
DB, DEGREES = 0.1, 1.0


@dataclass(frozen=True)
class Case:
    """A block with its literals, the Laplace function, frequencies of interest in rad/s, C in 1/s."""

    name: str
    literals: dict
    numerator: list
    denominator: list
    corners: list
    c: float
    period_ns: int
    amplitude: int = NORMAL

    @property
    def period_s(self):
        return self.period_ns / 1e9

    def laplace(self, w):
        return np.polyval(self.numerator, 1j * w) / np.polyval(self.denominator, 1j * w)

    def design(self, w):
        z = cmath.exp(1j * w * self.period_s)
        s = self.c * (z - 1) / (z + 1)
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)

    def settling(self):
        """Scans until a transient is below 1e-5 of what it was; an integrator keeps its offset, which has no sine."""
        roots = np.roots(self.denominator)
        poles = np.abs((self.c + roots) / (self.c - roots))
        slowest = max((pole for pole in poles if pole < 1 - 1e-9), default=0.5)
        return math.ceil(math.log(1e-5) / math.log(slowest)) if slowest > 0 else 10

    def __str__(self):
        numbers = "-".join(f"{value:.4g}" for value in self.literals.values())
        return f"{self.name}-{numbers}-{self.period_ns / 1e6:g}ms"


def measured(case, k):
    """Complex gain at the frequency of ``k`` periods in the window."""
    block = run(case.name, case.period_ns, **case.literals)
    n = np.arange(-case.settling(), WINDOW)
    inputs = np.round(case.amplitude * np.sin(2 * math.pi * ((k * n) % WINDOW) / WINDOW)).astype(int)
    feedback = {"feedback": 0} if case.name == "PID" else {}
    outputs = np.array([block.scan(input=value, **feedback)["output"] for value in inputs.tolist()][-WINDOW:])
    inputs = inputs[-WINDOW:]
    assert np.max(np.abs(outputs)) < 32767, "the output clips: the amplitude is too large for this case"
    wave = np.exp(-2j * math.pi * ((k * np.arange(WINDOW)) % WINDOW) / WINDOW)
    return np.sum(outputs * wave) / np.sum(inputs * wave)


def compare(gain, expected, amplitude):
    if abs(expected) * amplitude < MEASURABLE:
        assert abs(gain) * amplitude < MEASURABLE + 1
        return
    assert abs(20 * math.log10(abs(gain) / abs(expected))) < DB
    assert abs(math.degrees(cmath.phase(gain / expected))) < DEGREES


def turns(case, w):
    """The number of periods in the window nearest to a frequency, at most near half the scan frequency."""
    return min(max(round(w * case.period_s * WINDOW / (2 * math.pi)), 1), WINDOW // 2 - 20)


def frequency(case, k):
    return 2 * math.pi * k / (WINDOW * case.period_s)


def grid(k, period_s):
    """The frequency of k periods in the window: there a sweep meets a mapping frequency exactly."""
    return 2 * math.pi * k / (WINDOW * period_s)


def warped(w, c, period_s):
    """Where the mapping puts a corner of the Laplace function."""
    return 2 * math.atan(w / c) / period_s


def cases():
    yield from first_order(5_500_000, [None, 37, 290])
    yield from first_order(22_000_000, [None])
    yield from on_udc(500_000, [53, 200, 800])
    yield from on_udc(10_000_000, [200])
    yield from notches(5_500_000, [30, 199])
    yield from notches(55_000_000, [60])


def first_order(period_ns, mapped_at):
    """``mapped_at``: WM as periods in the window, None for the default."""
    period = period_ns / 1e9
    for wm in (None if k is None else grid(k, period) for k in mapped_at):
        c = mapping_constant(period, wm)
        given = {} if wm is None else {"wm": wm}
        for share in (0.02, 0.3):
            w = share * c
            corner = [warped(w, c, period)]
            yield Case("LAG", {"wlg": w, **given}, [1.0], [1 / w, 1.0], corner, c, period_ns)
            yield Case("DIFF_LAG", {"wlg": w, **given}, [1 / w, 0.0], [1 / w, 1.0], corner, c, period_ns)
        for wld, wlg in ((0.02 * c, 0.2 * c), (0.3 * c, 0.04 * c)):
            corners = [warped(wld, c, period), warped(wlg, c, period)]
            literals = {"wld": wld, "wlg": wlg, **given}
            amplitude = int(NORMAL * min(1, 6 * wld / wlg))
            yield Case("LEAD_LAG", literals, [1 / wld, 1.0], [1 / wlg, 1.0], corners, c, period_ns, amplitude)
        ki = 0.02 * c
        yield Case("INTEGRATE", {"ki": ki, **given}, [ki], [1.0, 0.0], [warped(ki, c, period)], c, period_ns, 350)
        literals = {"kp": 2.0, "wld": 0.03 * c, **given}
        corner = [warped(0.03 * c, c, period)]
        yield Case("PROP_INT", literals, [2.0, 0.06 * c], [1.0, 0.0], corner, c, period_ns, 180)


def on_udc(period_ns, frequencies):
    period = period_ns / 1e9
    for k in frequencies:
        w = grid(k, period)
        c = mapping_constant(period, w)
        root = math.sqrt(2.0)
        denominators = {1: [1, w], 2: [1, root * w, w**2], 3: [1, 2 * w, 2 * w**2, w**3]}
        for order, below in denominators.items():
            high = [1.0] + [0.0] * order
            yield Case("HIGH_PASS_FILTER", {"wld": w, "order": order}, high, below, [w], c, period_ns)
            yield Case("LOW_PASS_FILTER", {"wlg": w, "order": order}, [w**order], below, [w], c, period_ns)
        for order, q in ((2, 0.6), (2, 8.0), (4, 3.0)):
            if order == 2 or k > 100:
                yield notch("NOTCHN", {"q_factor": q, "wn": w, "order": order}, w, q, order // 2, period_ns)


def notches(period_ns, frequencies):
    for k in frequencies:
        w = grid(k, period_ns / 1e9)
        for q in (0.5, 5.0, 20.0):
            yield notch("NOTCH", {"q_factor": q, "wn": w}, w, q, 1, period_ns)


def notch(name, literals, w, q, times, period_ns):
    above, below = [1.0, 0.0, w**2], [1.0, w / q, w**2]
    if times == 2:
        above, below = np.polymul(above, above), np.polymul(below, below)
    edges = [w * (1 - 0.5 / q), w, w * (1 + 0.5 / q)]
    return Case(name, literals, above, below, edges, mapping_constant(period_ns / 1e9, w), period_ns)


CASES = list(cases())


@pytest.mark.parametrize("case", CASES, ids=str)
def test_follows_the_discrete_design_around_its_corners(case):
    wanted = AROUND if len(case.corners) == 1 and case.settling() < 1500 else (0.5, 1.0, 2.0)
    loud = 0
    for k in sorted({turns(case, factor * corner) for corner in case.corners for factor in wanted}):
        expected = case.design(frequency(case, k))
        if case.name in ("INTEGRATE", "PROP_INT") and 2 * abs(expected) * case.amplitude > 8000:
            continue
        compare(measured(case, k), expected, case.amplitude)
        loud += abs(expected) * case.amplitude >= MEASURABLE
    assert loud >= 2


@pytest.mark.parametrize("case", [case for case in CASES if "wm" in case.literals], ids=str)
def test_is_the_laplace_function_at_wm(case):
    wm = case.literals["wm"]
    compare(measured(case, turns(case, wm)), case.laplace(wm), case.amplitude)
    assert frequency(case, turns(case, wm)) == pytest.approx(wm)


@pytest.mark.parametrize("case", [case for case in CASES if "PASS" in case.name], ids=str)
def test_is_the_laplace_function_at_its_own_frequency(case):
    """1 / sqrt 2 and 45 degrees an order."""
    w = case.corners[0]
    gain = measured(case, turns(case, w))
    compare(gain, case.laplace(w), case.amplitude)
    sign = 1 if case.name == "HIGH_PASS_FILTER" else -1
    turned = cmath.exp(-1j * sign * math.radians(45) * case.literals["order"])
    compare(gain * turned, math.sqrt(0.5), case.amplitude)


@pytest.mark.parametrize("case", [case for case in CASES if "NOTCH" in case.name], ids=str)
def test_nothing_is_left_at_the_notch(case):
    """Half a count of rounding is all there is: 4095 counts in, less than 1 out, -72 dB."""
    assert abs(measured(case, turns(case, case.literals["wn"]))) * case.amplitude < 1


@pytest.mark.parametrize("period_ns", [5_500_000, 22_000_000])
@pytest.mark.parametrize("name", ["LAG", "DIFF_LAG", "LEAD_LAG", "INTEGRATE", "PROP_INT"])
def test_is_the_laplace_function_at_a_20th_of_the_scan_frequency_by_default(name, period_ns):
    """20 scans a period: the roundings repeat, and stay below 1 count."""
    period = period_ns / 1e9
    wm = 2 * math.pi / period / 20
    literals, numerator, denominator = {
        "LAG": ({"wlg": wm}, [1.0], [1 / wm, 1.0]),
        "DIFF_LAG": ({"wlg": wm}, [1 / wm, 0.0], [1 / wm, 1.0]),
        "LEAD_LAG": ({"wld": wm, "wlg": 3 * wm}, [1 / wm, 1.0], [1 / (3 * wm), 1.0]),
        "INTEGRATE": ({"ki": wm}, [wm], [1.0, 0.0]),
        "PROP_INT": ({"kp": 1.0, "wld": wm}, [1.0, wm], [1.0, 0.0]),
    }[name]
    block = run(name, period_ns, **literals)
    n = np.arange(3000)
    inputs = np.round(NORMAL * np.sin(2 * math.pi * (n % 20) / 20))
    outputs = np.array([block.scan(input=int(value))["output"] for value in inputs])
    wave = np.exp(-2j * math.pi * (n % 20) / 20)[-2000:]
    gain = np.sum(outputs[-2000:] * wave) / np.sum(inputs[-2000:] * wave)
    compare(gain, np.polyval(numerator, 1j * wm) / np.polyval(denominator, 1j * wm), NORMAL)


@pytest.mark.parametrize(
    ("literals", "gain"),
    [
        ({"kp": 2.0, "ki": 0.0}, lambda _z, _t: 2.0),
        ({"kp": 1.0, "ki": 4.0}, lambda z, t: 1.0 + 4.0 * t / 2 * (z + 1) / (z - 1)),
        ({"kp": 0.5, "ki": 4.0, "kd": 0.05}, lambda z, t: 0.5 + 2.0 * t * (z + 1) / (z - 1) + 0.05 / t * (1 - 1 / z)),
        (
            {"kp": 2.0, "ki": 2.0, "kd": 0.02, "isa": True},
            lambda z, t: 2.0 + 2.0 * t * (z + 1) / (z - 1) + 0.04 / t * (1 - 1 / z),
        ),
    ],
)
@pytest.mark.parametrize("loop_time", [0.011, 0.055])
def test_pid_follows_its_difference_equations(literals, gain, loop_time):
    """The integral by the trapezoid rule, the derivative KD (1 - 1/z) / LOOP_TIME."""
    period_ns = round(loop_time * 1e9)
    for k in (40, 150, 500, 900):
        z = cmath.exp(2j * math.pi * k / WINDOW)
        expected = gain(z, loop_time)
        amplitude = min(NORMAL, int(12000 / abs(expected)))
        case = Case("PID", {"loop_time": loop_time, **literals}, [1.0], [1.0, 1.0], [], 1.0, period_ns, amplitude)
        compare(measured(case, k), expected, amplitude)
