"""A day at constant alpha: nothing drifts, nothing hangs, no memory grows."""

import gc
import sys
from math import pi, radians
from typing import NamedTuple

import pytest
from soaking import in_soak

from automax_ros.drive.base.motor import FixedLoad
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.firing import ConstantAlpha

HOUR_NS = 3_600_000_000_000


class Figures(NamedTuple):
    """What is looked at of a sample; the sample itself would keep the intervals that it integrates over."""

    mean_current_a: float
    rms_current_a: float
    zero_current_s: float
    overlap_s: float

    @classmethod
    def of(cls, sample):
        return cls(*(getattr(sample, name) for name in cls._fields))


def run(emf, hours, parts):
    """Samples of a second each, spread over some hours, and how many blocks of memory were in use after each."""
    line = AcLine(460.0, inductance_h=60e-6, resistance_ohm=0.005)
    circuit = Circuit(line, Bridge(), FixedLoad(0.3, 2e-3, emf))
    firing = ConstantAlpha(circuit, radians(60))
    firing.advance(1_000_000_000)
    samples, blocks = [], []
    for part in range(1, parts + 1):
        firing.advance(max(round(hours * HOUR_NS * part / parts) - 1_000_000_000, circuit.now_ns))
        circuit.sample()
        firing.advance(circuit.now_ns + 1_000_000_000)
        samples.append(Figures.of(circuit.sample()))
        gc.collect()
        blocks.append(sys.getallocatedblocks())
    return samples, blocks, circuit


def check(samples, blocks, circuit):
    first = samples[0]
    for sample in samples:
        # A second holds 60 cycles, wherever it begins.
        assert sample.mean_current_a == pytest.approx(first.mean_current_a, rel=1e-6)
        assert sample.rms_current_a == pytest.approx(first.rms_current_a, rel=1e-6)
        assert sample.zero_current_s == pytest.approx(first.zero_current_s, abs=1e-6)
        assert sample.overlap_s == pytest.approx(first.overlap_s, abs=1e-7)
    assert max(blocks) - blocks[1] < 1000
    angle = circuit.line.angle(circuit.now_ns)
    expected = circuit.now_ns * 60 % 1_000_000_000 / 1e9 * 2 * pi
    assert abs((angle - expected + pi) % (2 * pi) - pi) < 1e-6


@pytest.mark.parametrize("emf", [150.0, 300.0])
@pytest.mark.parametrize(("hours", "parts"), [(1 / 60, 4), in_soak(24, 24, timeout_s=3600)])
def test_hours_at_constant_alpha(emf, hours, parts):
    check(*run(emf, hours, parts))
