"""Windows on a signal that is written from outside at any time, several times at one instant too."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.sweep.measures import read_measures
from automax_ros.sweep.run import RackTemplate
from automax_ros.sweep.watching import Watch
from sweep.helpers import rack_in

LENGTH_MS = 40


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> RackTemplate:
    return RackTemplate.of(rack_in(Path(tmp_path_factory.mktemp("watching"))))


WRITES = st.lists(st.tuples(st.integers(0, LENGTH_MS), st.integers(-9, 9)), max_size=30)
WINDOWS = st.tuples(st.integers(0, LENGTH_MS - 1), st.integers(1, LENGTH_MS)).filter(lambda ends: ends[0] < ends[1])


@given(WRITES, WINDOWS, st.booleans())
def test_a_window_sees_what_holds_within_it(
    template: RackTemplate, writes: list[tuple[int, int]], window: tuple[int, int], looks: bool
):
    start, end = window
    times = f"from={start / 1000} to={end / 1000}"
    text = " ".join(f"{name}(SLOW, {times})" for name in ("mean", "min", "max", "final", "itae", "overshoot"))
    rack = template.rack({})
    measures = read_measures(text, rack.config, NS_PER_S)
    rack.start()
    watch = Watch(rack, measures, NS_PER_S)
    held = np.full(LENGTH_MS, 4.0)
    before = 4.0
    for time, value in sorted(writes, key=lambda item: item[0]):
        rack.scheduler.run_until(time * NS_PER_MS)
        rack.memory.now_ns = rack.now_ns
        rack.memory.write_now(rack.memory.view("SLOW"), float(value), 1)
        if looks:
            rack.observers.report_writes()
        held[time:] = value
        before = value if time < start else before
    rack.scheduler.run_until(LENGTH_MS * NS_PER_MS)
    rack.observers.report_writes()
    v = held[start:end]
    t = np.arange(len(v)) * 1e-3
    step = v[-1] - before
    expected = [
        v.mean(),
        v.min(),
        v.max(),
        v[-1],
        (np.abs(v) * ((t + 1e-3) ** 2 - t**2) / 2).sum(),
        None if step == 0 else max(0, ((v - v[-1]) * np.sign(step)).max()) / abs(step) * 100,
    ]
    found = watch.results(LENGTH_MS * NS_PER_MS)
    assert [found[measure] for measure in measures] == [
        value if value is None else pytest.approx(value, rel=1e-9, abs=1e-15) for value in expected
    ]
