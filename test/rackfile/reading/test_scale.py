"""`scale` of a common variable: counts and the engineer's unit, what is refused, the topic that is made of it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rack.helpers import HEAD, codes, common, rack_from

from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rackfile.reading.scale import Scale

COUNTS = st.integers(-32768, 32767)
VALUES = st.integers(-10_000, 10_000).map(lambda number: number / 8)


@given(COUNTS, COUNTS, VALUES, VALUES, st.integers(-(2**31), 2**31 - 1))
def test_counts_come_back_from_the_value_that_they_mean(first, last, low, high, counts):
    assume(first != last)
    assume(low != high)
    scale = Scale((first, last), (low, high))
    exact = Fraction(low) + Fraction(counts - first) * Fraction(high - low) / (last - first)
    assert scale.value_of(counts) == pytest.approx(float(exact), rel=1e-12, abs=1e-9)
    inside = min(first, last) <= counts <= max(first, last)
    if inside:
        assert scale.counts_of(float(exact)) == (counts, False)
    else:
        nearest = first if abs(counts - first) < abs(counts - last) else last
        assert scale.counts_of(float(exact)) == (nearest, True)


def test_the_ends_are_exact_and_halves_go_away_from_zero():
    scale = Scale((0, 4095), (0.0, 10.0))
    assert (scale.value_of(0), scale.value_of(4095)) == (0.0, 10.0)
    assert (scale.counts_of(10.0), scale.counts_of(10.0000001), scale.counts_of(-0.0000001)) == (
        (4095, False),
        (4095, True),
        (0, True),
    )
    assert Scale((-3, 3), (-3.0, 3.0)).counts_of(-1.0) == (-1, False)
    assert [Scale((0, 10), (0.0, 20.0)).counts_of(value)[0] for value in (0.99, 1.0, 2.99, 3.0)] == [0, 1, 1, 2]
    assert Scale((4095, 0), (0.0, 10.0)).counts_of(2.5) == (3071, False)


@pytest.mark.parametrize("value", [3e38, -3e38])
def test_any_finite_value_has_counts(value):
    assert Scale((-4095, 4095), (-1e-300, 1e-300)).counts_of(value)[1]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("A%: {scale: {counts: [0, 4095], value: [0.0, 10.0]}}", []),
        ("A!: {scale: {counts: [-8388607, 8388607], value: [10, 0]}}", []),
        ("A%: {scale: {counts: [0, 40950], value: [0.0, 10.0]}}", ["AMX6450"]),
        ("A%: {scale: {counts: [5, 5], value: [0.0, 10.0]}}", ["AMX6450"]),
        ("A%: {scale: {counts: [0, 5], value: [1.0, 1]}}", ["AMX6450"]),
        ("A%: {scale: {counts: [0, 5], value: [0, 1e19]}}", ["AMX6450"]),
        ("A%: {scale: {counts: [0, 5], value: [0, 1e-320]}}", ["AMX6450"]),
        ("A%: {scale: {counts: [0, 1.5], value: [0, 1]}}", ["AMX6008"]),
        ("A%: {scale: {counts: [0, 5, 7], value: [0, 1]}}", ["AMX6008"]),
        ("A%: {scale: {counts: 5, value: [0, .nan]}}", ["AMX6008", "AMX6008"]),
        ("A%: {scale: {counts: [0, 5]}}", ["AMX6009"]),
        ("A%: {scale: {counts: [0, 5], values: [0, 1]}}", ["AMX6007", "AMX6009"]),
        ("A%: {scale: 0.5}", ["AMX6008"]),
        ("A: {scale: {counts: [0, 5], value: [0, 1]}}", ["AMX6450"]),
        ("A@: {scale: {counts: [0, 1], value: [0, 1]}}", ["AMX6450"]),
        ("A%(3): {ros: out, scale: {counts: [0, 5], value: [0, 1]}}", ["AMX6450"]),
        ("A%: {ros: closed, scale: {counts: [0, 5], value: [0, 1]}}", ["AMX6451"]),
    ],
)
def test_a_scale_is_right_or_has_its_problem(tmp_path, line, expected):
    assert sorted(codes(tmp_path, f"{HEAD}common:\n  {line}\n")) == sorted(expected)


def test_a_scale_is_part_of_the_configuration(tmp_path):
    variable = common(tmp_path, "A%: {ros: in, unit: bar, scale: {counts: [0, 4095], value: [0, 10]}}")
    assert (variable.scale, variable.unit) == (Scale((0, 4095), (0.0, 10.0)), "bar")


def test_the_topic_is_in_the_engineers_unit_and_memory_in_counts(tmp_path: Path):
    rack = rack_from(
        tmp_path,
        f"{HEAD}common:\n  A%: {{scale: {{counts: [0, 4096], value: [-1.0, 1.0]}}}}\n",
        LINE="10 COMMON A%\n20 CALL SCAN_LOOP(TICKS=1)\n30 A% = A% + 1024\n40 END\n",
    )
    stream = RackStream(rack, 1)
    values: list[float] = []
    kinds = {topic.name: topic.type_name for topic in stream.topics}
    assert kinds["/line1/common/A"] == "std_msgs/msg/Float32"

    def sink(topic):
        if topic.name != "/line1/common/A":
            return None
        return lambda _, payload: values.append(decode(topic.type_name, payload).data)

    stream.add_sink(sink)
    stream.begin()
    rack.start()
    rack.run(0.0055 * 5)
    assert values == [-1.0, -0.5, 0.0, 0.5, 1.0, 1.5]
    assert rack.value("A%") == 5 * 1024
