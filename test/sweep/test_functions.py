"""What measures compute, against the same definitions on every nanosecond of a signal, by numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.faults import UserError
from automax_ros.core.ticks import NS_PER_S
from automax_ros.sweep import functions
from automax_ros.sweep.functions import Accumulator

NUMBERS = st.one_of(
    st.lists(st.integers(-5, 5), min_size=1, max_size=25),
    st.lists(st.integers(-32768, 32767), min_size=1, max_size=25),
    st.lists(st.floats(-1e6, 1e6, width=32), min_size=1, max_size=25),
)
SIGNALS = NUMBERS.flatmap(
    lambda values: st.tuples(
        st.just(values), st.lists(st.integers(1, 9), min_size=len(values), max_size=len(values)), st.integers(-6, 6)
    )
)
"""Values, for how many ns each holds, and the value before them."""
Signal = tuple[list[float], list[int], float]


def computed(accumulator: Accumulator, signal: Signal) -> float | None:
    values, lengths, before = signal
    begin = 0
    accumulator.begin(before)
    for value, length in zip(values, lengths, strict=True):
        accumulator.hold(value, begin, begin + length)
        begin += length
    return accumulator.result(values[-1], begin)


def each_ns(signal: Signal) -> np.ndarray:
    values, lengths, _ = signal
    return np.repeat(np.array(values, float), lengths)


@given(SIGNALS)
def test_averages(signal: Signal):
    v = each_ns(signal)
    assert computed(functions.Mean(), signal) == pytest.approx(v.mean(), rel=1e-9, abs=1e-6)
    assert computed(functions.Rms(), signal) == pytest.approx(np.sqrt((v**2).mean()), rel=1e-9, abs=1e-9)


@given(SIGNALS)
def test_extremes_and_the_last_value(signal: Signal):
    v = each_ns(signal)
    assert computed(functions.Least(), signal) == v.min()
    assert computed(functions.Most(), signal) == v.max()
    assert computed(functions.MostAbsolute(), signal) == np.abs(v).max()
    assert computed(functions.Final(), signal) == signal[0][-1]


@given(SIGNALS, st.none() | st.integers(-6, 6))
def test_itae(signal: Signal, target: int | None):
    v, begin = each_ns(signal), np.arange(len(each_ns(signal)), dtype=float)
    arguments = () if target is None else (target,)
    expected = (np.abs(v - (target or 0)) * ((begin + 1) ** 2 - begin**2) / 2).sum() / NS_PER_S**2
    assert computed(functions.Itae(*arguments), signal) == pytest.approx(expected, rel=1e-9, abs=1e-20)


@given(SIGNALS, st.sampled_from([0, 0.5, 1, 2.5, 40, 1000]), st.booleans(), st.none() | st.integers(-6, 6))
def test_settle(signal: Signal, band: float, percent: bool, target: int | None):
    meant = signal[0][-1] if target is None else target
    width = abs(meant) * band / 100 if percent else band
    v = each_ns(signal)
    # With an unknown target the ends of the band are rounded, so what stands on them is not asked for.
    edges = [abs(abs(value - meant) - width) for value in signal[0]]
    if any(0 < edge <= 1e-9 * max(1, abs(meant)) for edge in edges):
        return
    outside = np.flatnonzero(np.abs(v - meant) > width)
    expected = (outside[-1] + 1 if len(outside) else 0) / NS_PER_S
    if abs(signal[0][-1] - meant) > width:
        expected = None
    assert computed(functions.Settle(band, percent=percent, target=target), signal) == expected


@given(SIGNALS, st.none() | st.integers(-6, 6))
def test_overshoot(signal: Signal, target: int | None):
    v = each_ns(signal)
    meant = signal[0][-1] if target is None else target
    step = meant - signal[2]
    expected = None if step == 0 else max(0.0, ((v - meant) * np.sign(step)).max() / abs(step) * 100)
    assert computed(functions.Overshoot(target), signal) == pytest.approx(expected)


@given(SIGNALS, st.none() | st.integers(-6, 6))
def test_rise(signal: Signal, target: int | None):
    v = each_ns(signal)
    meant = signal[0][-1] if target is None else target
    start, step = signal[2], meant - signal[2]
    expected = None
    if step:
        sign = 1 if step > 0 else -1
        reached = [np.flatnonzero(v * sign >= sign * (start + share * step)) for share in (0.1, 0.9)]
        if all(len(found) for found in reached):
            expected = (reached[1][0] - reached[0][0]) / NS_PER_S
    assert computed(functions.Rise(target), signal) == expected


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 9)), min_size=1, max_size=30), st.booleans())
def test_edges_and_time_of_a_boolean(pieces: list[tuple[bool, int]], before: bool):
    signal = [float(value) for value, _ in pieces], [length for _, length in pieces], before
    v = each_ns(signal)
    assert computed(functions.Count(), signal) == int((np.diff(np.insert(v, 0, before)) > 0).sum())
    assert computed(functions.TimeTrue(), signal) == v.sum() / NS_PER_S


def test_averages_of_whole_numbers_are_exact_over_a_day():
    mean, rms = functions.Mean(), functions.Rms()
    day = 86_400 * NS_PER_S
    for accumulator in (mean, rms):
        accumulator.hold(32767, 0, day - 1)
        accumulator.hold(-32768, day - 1, day)
    assert mean.result(0, day) == (32767 * (day - 1) - 32768) / day
    assert rms.result(0, day) == np.sqrt((32767**2 * (day - 1) + 32768**2) / day)


@pytest.mark.parametrize("slope", [1, -1])
def test_what_is_kept_for_an_unknown_target_is_bounded(slope: int, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(functions, "MOST_STEPS", 100)
    for accumulator in (functions.Settle(2, percent=True), functions.Rise()):
        for step in range(100):
            accumulator.hold(slope * step * 0.5, step, step + 1)
        with pytest.raises(UserError, match="more than 100 values"):
            accumulator.hold(slope * 50.0, 100, 101)
    known = functions.Settle(2, percent=True, target=5)
    for step in range(200):
        known.hold(slope * step * 0.5, step, step + 1)
    back_and_forth = functions.Settle(2, percent=True)
    for step in range(10_000):
        back_and_forth.hold(step % 7, step, step + 1)
