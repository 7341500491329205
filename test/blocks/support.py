"""What the tests of the blocks share: repeatable hypothesis settings, strategies, signals and a filter model."""

import math

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.instance import Instance

TICK = 5_500_000
"""The default tick in ns: a scan period of TICKS = 1."""

repeatable = settings(deadline=None, derandomize=True, max_examples=60, database=None)
int16 = st.integers(-32768, 32767) | st.sampled_from([-32768, -32767, -1, 0, 1, 32766, 32767])


def run(name, period_ns=TICK, **literals):
    """Return an instance of a block of the catalogue."""
    return Instance(CATALOGUE[name], period_ns, **literals)


def mapping_constant(period_s, wm=None):
    """C of sections 41 to 50, written from the manual's text."""
    wm = (2 * math.pi / period_s) / 20 if wm is None else wm
    return wm / math.tan(wm * period_s / 2)


def filtered(numerator, denominator, c, inputs):
    """Filter inputs by a Laplace function under s = C (z - 1)/(z + 1), from rest, by scipy."""
    b, a = signal.bilinear(numerator, denominator, fs=c / 2)
    return signal.lfilter(b, a, np.asarray(inputs, dtype=float))


def changed(before, after, inputs, at=200):
    """Filter inputs by scipy with (b, a) of ``before``, from place ``at`` on with those of ``after``: direct form I."""
    first = signal.lfilter(*before, inputs[:at])
    order = len(after[1]) - 1
    state = signal.lfiltic(*after, first[: -order - 1 : -1], inputs[at - 1 : at - 1 - order : -1])
    return np.concatenate([first, signal.lfilter(*after, inputs[at:], zi=state)[0]])


def signals(amplitude, scans=10_000):
    """Steps, a sine and noise, whole counts up to an amplitude, without a mean that an integrator would run away on."""
    n = np.arange(scans)
    noise = np.random.default_rng(1985).uniform(-amplitude, amplitude, scans)
    return {
        "steps": np.where((n // 250) % 2 == 0, amplitude, -amplitude),
        "sine": amplitude * np.sin(2 * math.pi * n / 97),
        "noise": noise,
    }


def outputs_of(instance, inputs):
    """Run an instance over a signal of whole counts and return OUTPUT of each scan."""
    return [instance.scan(input=int(value))["output"] for value in inputs]
